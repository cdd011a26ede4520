"""The benchmark: declared cases x methods x motions x seeds on synthetic sessions, and the table they make."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from solver.bench.request import BenchRequest
    from solver.pipeline.request import Outcome
    from solver.progress import Progress


def run_bench(request: BenchRequest, progress: Progress) -> Outcome:
    """See ``solver.bench.bench``; loaded when called, so that the command line answers at once."""
    if request.suite == "clean":
        from solver.bench.clean import clean_suite

        return clean_suite(request, progress)
    if request.suite == "neural":
        from solver.bench.neural import neural_suite

        return neural_suite(request, progress)
    from solver.bench.bench import run_bench as run

    return run(request, progress)
