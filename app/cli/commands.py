"""What each command does, around the functions of the solver."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path

from markerscope.app.cli.clean import clean_request
from markerscope.app.cli.dataset import dataset_request
from markerscope.app.cli.events import cycles_request, events_request
from markerscope.app.cli.markersets import label_request, learn_request
from markerscope.app.cli.output import Terminal
from markerscope.app.cli.synth import synth_settings
from markerscope.app.cli.train import train_request
from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.cleaning.request import CleanRequest
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress
from markerscope.solver.core.request import (
    EvaluateRequest,
    Outcome,
    SolveOutcome,
    SolveRequest,
    SynthRequest,
    check_inputs,
)
from markerscope.solver.cycles.request import CyclesRequest
from markerscope.solver.datasets.request import DatasetRequest
from markerscope.solver.events.request import EventsRequest
from markerscope.solver.markerset.request import LabelRequest, LearnRequest
from markerscope.solver.neural.request import TrainRequest


def _solve(request: SolveRequest, progress: Progress) -> SolveOutcome:
    from markerscope.solver.commands import solve_session
    from markerscope.solver.subject import is_subject, solve_subject

    return solve_subject(request, progress) if is_subject(request.markers) else solve_session(request, progress)


def _evaluate(request: EvaluateRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands import evaluate_result

    return evaluate_result(request, progress)


def _judge_demo(result: Path, progress: Progress) -> Outcome:
    from markerscope.solver.commands.demo import judge_demo

    return judge_demo(result, progress)


def _bench(request: BenchRequest, progress: Progress) -> Outcome:
    from markerscope.solver.bench import run_bench

    return run_bench(request, progress)


def _synth(request: SynthRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.synth import make_session

    return make_session(request, progress)


def _dataset(request: DatasetRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.dataset import write_sessions

    return write_sessions(request, progress)


def _clean(request: CleanRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.clean import clean_file

    return clean_file(request, progress)


def _label(request: LabelRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.label import label_file

    return label_file(request, progress)


def _list_marker_sets() -> Outcome:
    from markerscope.solver.commands.markersets import list_marker_sets

    return list_marker_sets()


def _show_marker_set(named: str) -> Outcome:
    from markerscope.solver.commands.markersets import show_marker_set

    return show_marker_set(named)


def _learn(request: LearnRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.markersets import learn_marker_set

    return learn_marker_set(request, progress)


def _train(request: TrainRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.train import train_network

    return train_network(request, progress)


def _events(request: EventsRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.events import find_events

    return find_events(request, progress)


def _cycles(request: CyclesRequest, progress: Progress) -> Outcome:
    from markerscope.solver.commands.cycles import make_cycles

    return make_cycles(request, progress)


def _no_window() -> str:
    from markerscope.app.window.start import display_problem

    return display_problem()


def _window(path: Path | None, example: bool) -> int:
    from markerscope.app.window.start import open_window

    return open_window(path, example)


@dataclass(frozen=True)
class Services:
    """The solver's functions that the commands call, loaded when they are needed."""

    solve: Callable[[SolveRequest, Progress], SolveOutcome] = _solve
    evaluate: Callable[[EvaluateRequest, Progress], Outcome] = _evaluate
    judge_demo: Callable[[Path, Progress], Outcome] = _judge_demo
    bench: Callable[[BenchRequest, Progress], Outcome] = _bench
    synth: Callable[[SynthRequest, Progress], Outcome] = _synth
    dataset: Callable[[DatasetRequest, Progress], Outcome] = _dataset
    clean: Callable[[CleanRequest, Progress], Outcome] = _clean
    train: Callable[[TrainRequest, Progress], Outcome] = _train
    events: Callable[[EventsRequest, Progress], Outcome] = _events
    cycles: Callable[[CyclesRequest, Progress], Outcome] = _cycles
    label: Callable[[LabelRequest, Progress], Outcome] = _label
    list_marker_sets: Callable[[], Outcome] = _list_marker_sets
    show_marker_set: Callable[[str], Outcome] = _show_marker_set
    learn: Callable[[LearnRequest, Progress], Outcome] = _learn
    no_window: Callable[[], str] = _no_window
    window: Callable[[Path | None, bool], int] = _window


SERVICES = Services()


def run_solve(options: argparse.Namespace, services: Services) -> int:
    """``markerscope solve``."""
    request = SolveRequest(**{field.name: getattr(options, field.name) for field in fields(SolveRequest)})
    with Terminal(options) as terminal:
        terminal.show(_solve_into(request, services, terminal.progress))
    return 0


def run_demo(options: argparse.Namespace, services: Services) -> int:
    """``markerscope demo``: the embedded session in the window; headless, its result against the truth."""
    if not (options.headless or options.json or options.quiet) and not services.no_window():
        return services.window(None, True)
    with Terminal(options) as terminal:
        request = SolveRequest(markers=DEMO_MARKERS, video=DEMO_VIDEO, out=options.out)
        solved = _solve_into(request, services, terminal.progress)
        compared = services.judge_demo(solved.out, terminal.progress)
        terminal.show(
            Outcome(
                summary={**solved.summary, "evaluation": dict(compared.summary)},
                lines=(*solved.lines, "Against the known truth:", *compared.lines),
                warnings=(*solved.warnings, *compared.warnings),
            )
        )
    return 0


def run_evaluate(options: argparse.Namespace, services: Services) -> int:
    """``markerscope evaluate``."""
    request = EvaluateRequest(options.result, options.reference, options.body)
    with Terminal(options) as terminal:
        check_inputs(request)
        terminal.show(services.evaluate(request, terminal.progress))
    return 0


def run_clean(options: argparse.Namespace, services: Services) -> int:
    """``markerscope clean``."""
    with Terminal(options) as terminal:
        terminal.show(services.clean(clean_request(options), terminal.progress))
    return 0


def run_bench(options: argparse.Namespace, services: Services) -> int:
    """``markerscope bench``."""
    given = {field.name: getattr(options, field.name) for field in fields(BenchRequest)}
    request = BenchRequest(**{name: value for name, value in given.items() if value is not None})
    with Terminal(options) as terminal:
        terminal.show(services.bench(request, terminal.progress))
    return 0


def run_synth(options: argparse.Namespace, services: Services) -> int:
    """``markerscope synth``."""
    request = SynthRequest(
        motion=options.motion,
        out=options.out,
        seed=options.seed,
        skeleton=options.skeleton,
        motion_rate=options.motion_rate,
        settings=synth_settings(options),
    )
    with Terminal(options) as terminal:
        terminal.show(services.synth(request, terminal.progress))
    return 0


def run_dataset(options: argparse.Namespace, services: Services) -> int:
    """``markerscope dataset``."""
    with Terminal(options) as terminal:
        terminal.show(services.dataset(dataset_request(options), terminal.progress))
    return 0


def run_train(options: argparse.Namespace, services: Services) -> int:
    """``markerscope train``."""
    with Terminal(options) as terminal:
        terminal.show(services.train(train_request(options), terminal.progress))
    return 0


def run_events(options: argparse.Namespace, services: Services) -> int:
    """``markerscope events``."""
    with Terminal(options) as terminal:
        terminal.show(services.events(events_request(options), terminal.progress))
    return 0


def run_cycles(options: argparse.Namespace, services: Services) -> int:
    """``markerscope cycles``."""
    with Terminal(options) as terminal:
        terminal.show(services.cycles(cycles_request(options), terminal.progress))
    return 0


def run_label(options: argparse.Namespace, services: Services) -> int:
    """``markerscope label``."""
    with Terminal(options) as terminal:
        terminal.show(services.label(label_request(options), terminal.progress))
    return 0


def run_markerset(options: argparse.Namespace, services: Services) -> int:
    """``markerscope markerset list``, ``show`` and ``learn``."""
    with Terminal(options) as terminal:
        if options.doing == "list":
            terminal.show(services.list_marker_sets())
        elif options.doing == "show":
            terminal.show(services.show_marker_set(options.marker_set))
        else:
            terminal.show(services.learn(learn_request(options), terminal.progress))
    return 0


def _solve_into(request: SolveRequest, services: Services, progress: Progress) -> SolveOutcome:
    """Solve, after a look at whether the result can be written at all; a refused input leaves no empty folder."""
    from markerscope.solver.io.output_folder import check_output_folder, remove_if_empty
    from markerscope.solver.pipeline.session import session_folder

    check_inputs(request)
    out: Path | None = request.out or session_folder(request.markers)
    if out is None:
        raise InputError("no folder for the results was named", remedy="add --out DIR")
    new = not out.exists()
    check_output_folder(out)
    try:
        return services.solve(request, progress)
    except BaseException:
        if new:
            remove_if_empty(out)
        raise
