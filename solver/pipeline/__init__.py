"""Stages as data, the store of their results, and the session folder."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solver.pipeline.request import EvaluateRequest, Outcome, SolveOutcome, SolveRequest
    from solver.pipeline.stage import OnEvent
    from solver.progress import Progress


def solve_session(request: SolveRequest, progress: Progress, on_event: OnEvent | None = None) -> SolveOutcome:
    """See ``solver.pipeline.solve``; loaded when called, so that the command line answers at once."""
    from solver.pipeline.solve import solve_session as run

    return run(request, progress, on_event)


def evaluate_result(request: EvaluateRequest, progress: Progress) -> Outcome:
    """See ``solver.evaluate``."""
    from solver.evaluate import evaluate_result as run

    return run(request, progress)
