"""A subject from its file to its results: the trial that determines the body first, then the others by that body."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.commands.solve import solve_session
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import SolveOutcome, SolveRequest, option
from markerscope.solver.fit.known.body import KnownBody, known_body
from markerscope.solver.fit.known.person_file import write_person
from markerscope.solver.fit.known.together import Followed, estimated_together, placed_anew
from markerscope.solver.fit.known.track import follow
from markerscope.solver.fit.results import Localization
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.io import load_markers
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.pipeline.names import FIT, LOCALIZE, ORIENT
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import load_session, save_session
from markerscope.solver.subject.order import determining, neutral_of
from markerscope.solver.subject.report import SubjectReport, TrialRow, write_subject_report
from markerscope.solver.subject.resolve import CLEAR, KEYFRAMES, resolve
from markerscope.solver.subject.standing import write_standing
from markerscope.solver.subject.subject_file import Subject, Trial, read_subject

PERSON, ABOUT, REPORT = "person.npz", "subject.json", "report.html"
_FOR_ALL = {"markers", "out", "seed", "body", "convention", "landmark_pull", "neutral", "method"}
_DECIDING = 2
"""Movements that decide what a standing pose left open."""
_WITH_VIDEO, _ALONE = 12.0, 4.0
"""How long a trial takes beside others; only the progress bar believes it."""

State = Literal["solved", "refused"]


@dataclass(frozen=True)
class TrialEnd:
    """What became of a trial.

    Attributes
    ----------
    name, state : and whether there is a result
    determines : whether it is the one that says what body this is
    doubts : what speaks against its result, or why there is none
    summary : of its solve, as of a single one; empty where it was refused
    """

    name: str
    state: State
    determines: bool = False
    doubts: tuple[str, ...] = ()
    summary: dict[str, Any] = field(default_factory=dict)


def solve_subject(request: SolveRequest, progress: Progress = silent) -> SolveOutcome:
    """All trials of a subject.

    Parameters
    ----------
    request : its ``markers`` is the subject's file; options that belong to one trial are refused

    Raises
    ------
    InputError : the file cannot be used, or no trial determines the body
    """
    for name in (f for f in asdict(request) if f not in _FOR_ALL and getattr(request, f) is not None):
        raise InputError("belongs to one trial", option(name), f"write it below its [[trial]] in {request.markers}")
    if request.out is None:
        raise InputError("no folder for the results was named", remedy="add --out DIR")
    subject, out = read_subject(request.markers), Path(os.path.abspath(request.out))
    order = determining(subject)
    make_folder(out)
    work = _Work(subject, request, out, progress)
    first = work.determine(order)
    for trial in subject.trials:
        if trial.name not in work.ends or (trial == first and not first.posed):
            work.follow(trial)
    return work.end(first)


class _Work:
    """The trials of one run, and what became of them so far."""

    def __init__(self, subject: Subject, request: SolveRequest, out: Path, progress: Progress) -> None:
        self.subject, self.request, self.out = subject, request, out
        self.ends: dict[str, TrialEnd] = {}
        self._progress = progress
        self._cost = {t.name: _WITH_VIDEO if t.video or t.role == "static" else _ALONE for t in subject.trials}
        # A static trial alone is solved twice: standing, and by the body that the movements make of it.
        again = 0.0 if any(trial.posed for trial in subject.trials) else _WITH_VIDEO
        self._total = sum(self._cost.values()) + again
        self._done = 0.0
        self._notes: list[str] = []
        self._open: tuple[str, ...] = ()
        self._neutral = neutral_of(subject) if request.neutral is None else None

    def determine(self, order: tuple[Trial, ...]) -> Trial:
        """Solve the first trial that can be, and write down whose body it found."""
        for trial in order:
            own = self._request(trial)
            if not trial.posed:
                own = replace(own, out=self._first(trial), prior=self._standing(trial), offset=0.0)
            if self._solve(trial, own, determines=True):
                if not trial.posed:
                    self._resolve(trial, own)
                self._write_person(trial)
                return trial
        raise InputError(
            f"none of the trials that could determine the body can be solved ({self.ends[order[0].name].doubts[0]})",
            self.subject.file,
            "mend one of them, or give another trial a video or a prior",
        )

    def follow(self, trial: Trial) -> None:
        """Solve a trial by the body that is known."""
        person = self.out / PERSON
        own = replace(self._request(trial), known=person, method=None if trial.posed else "known")
        if not trial.posed:
            own = replace(own, markers_moved=trial.markers_moved or None, landmark_pull=None)
        elif trial.markers_moved:  # its own video says where they are now
            own = replace(own, known=None)
        determines = trial.name in self.ends and self.ends[trial.name].determines
        before = self.ends.get(trial.name)
        self._solve(trial, own, determines)
        if before is not None and determines:  # what its own solve had against it stands
            end = self.ends[trial.name]
            self.ends[trial.name] = replace(end, doubts=(*self._open, *end.doubts))

    def end(self, first: Trial) -> SolveOutcome:
        """The report, and what to say."""
        rows = [*self.ends.values()]
        rows += [TrialEnd(name, "refused", doubts=(str(error),)) for name, error in self.subject.refused]
        self._say(rows)
        solved = [row for row in rows if row.state == "solved"]
        warnings = tuple(f"{row.name}: {doubt}" for row in rows for doubt in row.doubts)
        lines = (
            f"{self.subject.name}: {len(solved)} of {len(rows)} trials solved; {first.name} says what body it is.",
            *self._notes,
            *(_line(row) for row in solved),
            f"Results are in {self.out}.",
        )
        summary = {
            "out": str(self.out),
            "subject": self.subject.name,
            "determined_by": first.name,
            "notes": self._notes,
            "trials": [asdict(row) for row in rows],
            "warnings": list(warnings),
        }
        self._progress(1.0, "done")
        return SolveOutcome(summary=summary, lines=lines, warnings=warnings, out=self.out)

    def _request(self, trial: Trial) -> SolveRequest:
        """A trial's solve, with what holds for all."""
        whole = self.request
        return SolveRequest(
            trial.markers,
            out=self.out / trial.name,
            video=trial.video,
            prior=trial.prior,
            camera=self._camera(trial),
            offset=trial.offset,
            up=trial.up,
            units=trial.units,
            subject=trial.person,
            marker_rate=trial.rate,
            range=None if trial.start is None else (trial.start, trial.stop),
            method=whole.method,
            seed=whole.seed,
            body=whole.body,
            convention=whole.convention,
            neutral=whole.neutral if self._neutral is None else self._neutral.markers,
            landmark_pull=whole.landmark_pull,
        )

    def _camera(self, trial: Trial) -> Path | None:
        if trial.camera is None:
            return None
        if trial.camera in {other.name for other in self.subject.trials}:
            return self.out / trial.camera
        return self.subject.file.parent / trial.camera

    def _first(self, trial: Trial) -> Path:
        """Folder of the solve that determines the body: a static trial alone is solved apart, and again by the body."""
        return self.out / trial.name if trial.posed else self.out / "standing" / trial.name

    def _standing(self, trial: Trial) -> Path:
        markers = load_markers(trial.markers, up=trial.up, units=trial.units, subject=trial.person, rate=trial.rate)
        return write_standing(self.out / "standing" / f"{trial.name}.npz", float(markers.time[-1]) + 1.0)

    def _solve(self, trial: Trial, own: SolveRequest, determines: bool = False) -> bool:
        share = self._share(trial)
        more: tuple[str, ...] = ()
        try:
            try:
                done = solve_session(own, share)
            except InputError as error:
                if own.neutral is None or own.neutral == "recorded" or not _about(error, own.neutral):
                    raise
                done = solve_session(replace(own, neutral="recorded"), share)
                more = (f"its angles are counted from the convention's zero, for {_clause(error)}",)
        except InputError as error:
            self.ends[trial.name] = TrialEnd(trial.name, "refused", determines, (str(error),))
            return False
        self.ends[trial.name] = TrialEnd(trial.name, "solved", determines, (*done.warnings, *more), dict(done.summary))
        return True

    def _share(self, trial: Trial) -> Progress:
        total = self._total
        start, self._done = min(self._done / total, 1.0), self._done + self._cost[trial.name]
        whole = part_of(self._progress, 0.98 * start, 0.98 * min(self._done / total, 1.0))
        return _Named(whole, f"{trial.name}: ")

    def _resolve(self, trial: Trial, own: SolveRequest) -> None:
        """Have the movements say which of a standing trial's answers is right, and solve it again if it is another."""
        session = load_session(self._first(trial))
        graph = run_stages(session, ("fit",))
        found, ranked = graph[LOCALIZE], graph[ORIENT]
        assert isinstance(found, Localization)
        at = 0.98 * self._done / self._total
        progress = _Named(part_of(self._progress, at, at), f"{trial.name}: movements decide: ")
        told = resolve(self._body(), ranked, found.markers, self._movements(trial), progress)
        if told.row != graph[FIT].chosen and told.margin >= CLEAR:
            edits = {**session.edits, "fit": {**session.edits.get("fit", {}), "candidate": told.row}}
            save_session(replace(session, edits=edits))
            self._solve(trial, replace(own, markers=self._first(trial), out=None), determines=True)
        end = self.ends[trial.name]
        settled = bool(told.trials) and told.margin >= CLEAR
        if settled:
            self._notes.append(told.sentence)
        else:
            self._open = (told.sentence,)
            self.ends[trial.name] = replace(end, doubts=(*end.doubts, told.sentence))

    def _movements(self, static: Trial) -> dict[str, np.ndarray]:
        """Markers of the trials that may tell what a standing pose cannot: a few of those that move."""
        found: dict[str, np.ndarray] = {}
        for trial in self.subject.trials:
            if trial.role == "static" or trial.markers_moved or len(found) == _DECIDING:
                continue
            with suppress(InputError):
                found[trial.name] = self._markers(trial)
        return found

    def _body(self) -> Body:
        return load_body(self.request.body)

    def _write_person(self, trial: Trial) -> None:
        motion = run_stages(load_session(self._first(trial)), ("fit",))[FIT]
        known = known_body(self._body(), motion)
        movements = {} if trial.posed else self._movements(trial)
        if movements:
            known = self._moving(trial, known, movements)
        write_person(self.out / PERSON, known)

    def _moving(self, static: Trial, known: KnownBody, movements: dict[str, np.ndarray]) -> KnownBody:
        """A person found standing, as the movements have them: shape and places of all estimated together."""
        body = self._body()
        first = self._followed(body, known, movements)
        if not first:
            return known
        placed = placed_anew(body, known, first)
        again = self._followed(body, placed, {**movements, static.name: self._markers(static)})
        settings = FitSettings(landmark_pull=self.request.landmark_pull or "earned")
        found = estimated_together(body, placed, again, settings)
        self._notes.append(
            f"Shape and places of {len(found.placement.rest)} markers were estimated over "
            f"{', '.join((static.name, *movements))} together: markers are {1000 * found.off_m:.1f} mm from their "
            "places on average."
        )
        return found

    def _followed(self, body: Body, known: KnownBody, trials: dict[str, np.ndarray]) -> list[Followed]:
        """The person in those of the trials in which they can be found."""
        found = []
        for markers in trials.values():
            with suppress(InputError):
                found.append(Followed(markers, follow(body, known, markers, KEYFRAMES).tracks[0]))
        return found

    def _markers(self, trial: Trial) -> np.ndarray:
        """(T, M, 3) m, of a trial as its file has them."""
        read = load_markers(trial.markers, up=trial.up, units=trial.units, subject=trial.person, rate=trial.rate)
        return read.between(trial.start, trial.stop).positions

    def _say(self, rows: list[TrialEnd]) -> None:
        about = {"subject": self.subject.name, "trials": [asdict(row) for row in rows]}
        write_text_atomic(self.out / ABOUT, json.dumps(about, indent=1, default=str) + "\n")
        write_subject_report(
            self.out / REPORT,
            SubjectReport(
                self.subject.name, tuple(_row(row, self.out) for row in rows), _zero(self._neutral), tuple(self._notes)
            ),
        )


class _Named:
    """A reporter that says which trial is at work."""

    def __init__(self, whole: Progress, name: str) -> None:
        self._whole, self._name = whole, name

    def __call__(self, fraction: float, text: str) -> None:
        self._whole(fraction, f"{self._name}{text}")


def _about(error: InputError, file: Any) -> bool:
    """Whether an error is about a file."""
    return isinstance(file, Path) and error.where is not None and Path(error.where).name == file.name


def _clause(error: InputError) -> str:
    return f"the neutral pose could not be taken ({error.what})"


def _line(row: TrialEnd) -> str:
    said = row.summary
    count = len(row.doubts)
    doubt = "no doubt" if not count else f"{count} doubt{'' if count == 1 else 's'}"
    return (
        f"{row.name}: {said['frames']} frames, markers {said['residual_median_mm']:.1f} mm from their places (median), "
        f"confidence {said['confidence']:.2f}, {doubt}."
    )


def _row(row: TrialEnd, out: Path) -> TrialRow:
    said = row.summary
    return TrialRow(
        name=row.name,
        state="determines the body" if row.determines and said else row.state,
        confidence=said.get("confidence", float("nan")),
        residual_mm=said.get("residual_median_mm", float("nan")),
        frames=said.get("frames", 0),
        doubts=row.doubts,
        angles=out / row.name / "angles.csv" if said else None,
    )


def _zero(neutral: Trial | None) -> str:
    if neutral is None:
        return "Angles are counted from the convention's own zero: no trial is static."
    return f"Angles of all trials are counted from the pose in {neutral.name}."
