"""What a command does from its request to its files: everything below, joined."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markerscope.solver.core.progress import Progress
    from markerscope.solver.core.request import EvaluateRequest, Outcome, SolveOutcome, SolveRequest
    from markerscope.solver.pipeline.stage import OnEvent


def solve_session(request: SolveRequest, progress: Progress, on_event: OnEvent | None = None) -> SolveOutcome:
    """See ``markerscope.solver.commands.solve``; loaded when called, so that the command line answers at once."""
    from markerscope.solver.commands.solve import solve_session as run

    return run(request, progress, on_event)


def evaluate_result(request: EvaluateRequest, progress: Progress) -> Outcome:
    """See ``markerscope.solver.evaluate.evaluate``."""
    from markerscope.solver.evaluate.evaluate import evaluate_result as run

    return run(request, progress)
