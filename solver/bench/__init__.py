"""The benchmark: declared cases x methods x motions x seeds on synthetic sessions, and the table they make."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from markerscope.solver.bench.request import BenchRequest
    from markerscope.solver.core.progress import Progress
    from markerscope.solver.core.request import Outcome


def run_bench(request: BenchRequest, progress: Progress) -> Outcome:
    """See ``markerscope.solver.bench.bench``; loaded when called, so that the command line answers at once."""
    if request.suite == "clean":
        from markerscope.solver.bench.clean import clean_suite

        return clean_suite(request, progress)
    if request.suite == "neural":
        from markerscope.solver.bench.neural import neural_suite

        return neural_suite(request, progress)
    from markerscope.solver.bench.bench import run_bench as run

    return run(request, progress)
