"""In which order a subject's trials are solved."""

from __future__ import annotations

from markerscope.solver.core.errors import InputError
from markerscope.solver.subject.subject_file import Subject, Trial


def determining(subject: Subject) -> tuple[Trial, ...]:
    """The trials that can say what body this is and where its markers sit, the best first.

    A video or pose prior of a movement says most, one of a static trial less, and a static trial alone the least.

    Raises
    ------
    InputError : there is none
    """
    posed = [trial for trial in subject.trials if trial.posed]
    moving = [trial for trial in posed if trial.role != "static"]
    standing = [trial for trial in posed if trial.role == "static"]
    alone = [trial for trial in subject.trials if trial.role == "static" and not trial.posed]
    if not (posed or alone):
        raise InputError(
            "no trial says what body this is: none has a video or a pose prior, and none is static",
            subject.file,
            'give one trial a video or a prior, or mark one in which the person stands with role = "static"',
        )
    return (*moving, *standing, *alone)


def neutral_of(subject: Subject) -> Trial | None:
    """The static trial that all angles are counted from: the first whose markers were not moved."""
    return next((t for t in subject.trials if t.role == "static" and not t.markers_moved), None)
