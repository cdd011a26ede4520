"""One person over several trials: one body, one place for each marker, one neutral pose."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markerscope.solver.core.progress import Progress
    from markerscope.solver.core.request import SolveOutcome, SolveRequest


def is_subject(path: Path) -> bool:
    """See ``markerscope.solver.subject.subject_file``."""
    from markerscope.solver.subject.subject_file import is_subject as found

    return found(path)


def solve_subject(request: SolveRequest, progress: Progress) -> SolveOutcome:
    """See ``markerscope.solver.subject.solve``; loaded when called, so that the command line answers at once."""
    from markerscope.solver.subject.solve import solve_subject as run

    return run(request, progress)
