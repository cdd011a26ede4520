"""The command line: what can be asked, and how every ending is told.

Imports nothing heavy, so that ``--help`` and a mistyped option answer at once.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NoReturn, get_args

from markerscope.app.cli.clean import clean_options
from markerscope.app.cli.commands import (
    SERVICES,
    Services,
    run_bench,
    run_clean,
    run_cycles,
    run_dataset,
    run_demo,
    run_evaluate,
    run_events,
    run_label,
    run_markerset,
    run_solve,
    run_synth,
    run_train,
)
from markerscope.app.cli.dataset import dataset_options
from markerscope.app.cli.endings import CANCELLED, REFUSED, ended
from markerscope.app.cli.events import cycles_options, events_options
from markerscope.app.cli.markersets import SET_HELP, label_options, markerset_options
from markerscope.app.cli.output import standard_output
from markerscope.app.cli.synth import synth_options
from markerscope.app.cli.train import train_options
from markerscope.solver import __version__
from markerscope.solver.bench.request import OUT, names
from markerscope.solver.core.plain import shown
from markerscope.solver.core.request import Convention, LandmarkPull, Method, Units, Up, parse_neutral, parse_range

COMMANDS = {
    "demo": "solve the embedded session and say how close it came to the known truth",
    "solve": "from markers and a video to a body, named markers and joint angles",
    "evaluate": "how far a result is from another one or from a reference",
    "events": "foot strikes and offs of a trial, or repetitions of a movement",
    "cycles": "curves cut into cycles: mean and spread, steps in space and time, scores, a figure",
    "label": "give trajectories the names of a marker set, breaks joined and exchanges mended",
    "markerset": "list and show marker sets, and learn one from a labelled trial",
    "clean": "cut outliers and fill gaps of a marker file, every change listed",
    "bench": "how good the methods are on synthetic sessions whose truth is known",
    "synth": "make a session whose truth is known, as files",
    "train": "train a network for a layout: a session's own, or one with a name",
    "dataset": "cut your own copy of a public dataset into sessions",
}


_HELP = "markerscope --help"


def main(arguments: Sequence[str] | None = None, services: Services = SERVICES) -> int:
    """Run one command; returns its exit code."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError):  # a terminal that cannot show a character shows its code instead
            stream.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]
    words = _attach_negative_values(sys.argv[1:] if arguments is None else list(arguments))
    try:
        code = _run(words, services)
        with standard_output():
            sys.stdout.flush()  # here, where a reader that has left can still be told from a mistake
        return code
    except KeyboardInterrupt:
        print("Cancelled.", file=sys.stderr)
        return CANCELLED
    except Exception as error:
        return ended(error, debug="--debug" in words)


def _run(words: list[str], services: Services) -> int:
    if not words or (words[0] not in COMMANDS and not words[0].startswith("-")):
        return _open(words, services)
    try:
        options = _parser().parse_args(words)
    except SystemExit as error:  # --help, or a wrong word that has been told
        return int(error.code or 0)
    return int(options.run(options, services))


class _Parser(argparse.ArgumentParser):
    """Says what is wrong in one line."""

    def error(self, message: str) -> NoReturn:
        """End with exit code 2."""
        print(shown(f"{self.prog}: {message}; see {self.prog} --help."), file=sys.stderr)
        raise SystemExit(REFUSED)


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(prog="markerscope", description="From unlabelled optical markers and one video to joint angles.")
    parser.add_argument("--version", action="version", version=f"markerscope {__version__}")
    commands = parser.add_subparsers(title="commands", metavar="COMMAND", required=True, parser_class=_Parser)

    demo = commands.add_parser("demo", help=COMMANDS["demo"], description=_sentence("demo"))
    demo.add_argument(
        "--out", type=Path, default=Path("demo-out"), metavar="DIR", help="results (default: %(default)s)"
    )
    demo.add_argument("--headless", action="store_true", help="stay in the terminal, open no window")
    _common(demo)
    demo.set_defaults(run=run_demo)

    solve = commands.add_parser("solve", help=COMMANDS["solve"], description=_sentence("solve"))
    _solve_options(solve)
    _common(solve)
    solve.set_defaults(run=run_solve)

    clean = commands.add_parser("clean", help=COMMANDS["clean"], description=_sentence("clean"))
    clean_options(clean)
    _common(clean)
    clean.set_defaults(run=run_clean)

    label = commands.add_parser("label", help=COMMANDS["label"], description=_sentence("label"))
    label_options(label)
    _common(label)
    label.set_defaults(run=run_label)

    markerset = commands.add_parser("markerset", help=COMMANDS["markerset"], description=_sentence("markerset"))
    markerset_options(markerset, _common)
    markerset.set_defaults(run=run_markerset)

    evaluate = commands.add_parser("evaluate", help=COMMANDS["evaluate"], description=_sentence("evaluate"))
    evaluate.add_argument("result", type=Path, metavar="RESULT", help="folder that solve wrote, or its motion.npz")
    evaluate.add_argument("reference", type=Path, metavar="REFERENCE", help="another result, npz, stageii.pkl or .mot")
    evaluate.add_argument("--body", type=Path, metavar="FILE", help="SMPL-layout model of the reference")
    _common(evaluate)
    evaluate.set_defaults(run=run_evaluate)

    events = commands.add_parser("events", help=COMMANDS["events"], description=_sentence("events"))
    events_options(events)
    _common(events)
    events.set_defaults(run=run_events)

    cycles = commands.add_parser("cycles", help=COMMANDS["cycles"], description=_sentence("cycles"))
    cycles_options(cycles)
    _common(cycles)
    cycles.set_defaults(run=run_cycles)

    bench = commands.add_parser("bench", help=COMMANDS["bench"], description=_sentence("bench"))
    _bench_options(bench)
    _common(bench)
    bench.set_defaults(run=run_bench)

    synth = commands.add_parser("synth", help=COMMANDS["synth"], description=_sentence("synth"))
    synth_options(synth)
    _common(synth)
    synth.set_defaults(run=run_synth)

    train = commands.add_parser("train", help=COMMANDS["train"], description=_sentence("train"))
    train_options(train)
    _common(train)
    train.set_defaults(run=run_train)

    dataset = commands.add_parser("dataset", help=COMMANDS["dataset"], description=_sentence("dataset"))
    dataset_options(dataset)
    _common(dataset)
    dataset.set_defaults(run=run_dataset)
    return parser


def _solve_options(solve: argparse.ArgumentParser) -> None:
    solve.add_argument(
        "markers",
        type=Path,
        metavar="MARKERS|SESSION|SUBJECT",
        help="C3D, TRC, CSV or TSV file, a session, or a subject's TOML file",
    )
    solve.add_argument("--out", type=Path, metavar="DIR", help="folder for the results (a session has its own)")

    inputs = solve.add_argument_group("beside the markers")
    inputs.add_argument("--video", type=Path, metavar="FILE", help="video of the same movement")
    inputs.add_argument("--prior", type=Path, metavar="FILE", help="poses by 4D-Humans, WHAM, GVHMR, TRAM; AMASS npz")
    inputs.add_argument("--camera", type=Path, metavar="RESULT", help="take the camera from another trial's result")
    inputs.add_argument("--marker-set", metavar="NAME|FILE", help=f"name the markers first: {SET_HELP}")
    inputs.add_argument("--known", type=Path, metavar="FILE", help="a person known from other trials (person.npz)")
    inputs.add_argument(
        "--markers-moved",
        action="store_true",
        default=None,
        help="with --known and no video: markers were put on anew near the same places",
    )
    inputs.add_argument("--body", type=Path, metavar="FILE", help="an SMPL-layout model instead of the embedded body")

    reading = solve.add_argument_group("reading the markers (by default as the file says, else guessed and reported)")
    reading.add_argument("--up", choices=get_args(Up), help="vertical axis of the file")
    reading.add_argument("--units", choices=get_args(Units), help="length unit of the file")
    reading.add_argument("--marker-rate", type=float, metavar="HZ", help="frames a second")
    reading.add_argument("--subject", metavar="NAME", help="whose markers, where a file holds several people's")
    reading.add_argument(
        "--part-of-cloud", type=int, metavar="N", help="which of several clouds of markers to solve, counted from 1"
    )
    reading.add_argument("--range", type=parse_range, metavar="A:B", help="seconds to solve, in the file's clock")

    timing = solve.add_argument_group("timing of the video (by default found from the motion)")
    timing.add_argument("--offset", type=float, metavar="SECONDS", help="marker time = R * video time + SECONDS")
    timing.add_argument("--rate-ratio", type=float, metavar="R", help="see --offset; 1 where both clocks are right")

    how = solve.add_argument_group("solving")
    how.add_argument(
        "--method", choices=get_args(Method), help="bundle (default), paper: Milef et al. (2024), or neural"
    )
    how.add_argument("--weights", type=Path, metavar="FILE", help="of the network, instead of those that ship (neural)")
    how.add_argument("--iterations", type=int, metavar="N", help="of each optimisation at most (method paper)")
    how.add_argument(
        "--landmark-pull",
        choices=get_args(LandmarkPull),
        help="draw markers to the bony landmarks that they were put on: earned (default: where their places say so) "
        "or off",
    )
    how.add_argument("--convention", choices=get_args(Convention), help="names and signs of the angles")
    how.add_argument(
        "--standard-errors",
        action=argparse.BooleanOptionalAction,
        default=None,
        help="write a column NAME_se beside each angle in angles.csv (angles.json sums them up in any case)",
    )
    how.add_argument(
        "--neutral",
        type=parse_neutral,
        metavar="A:B|FILE|recorded",
        help="count angles from this pose: a span of the trial in seconds, or a static trial's file",
    )
    how.add_argument("--seed", type=int, metavar="N", help="of every random choice (default: 0)")


def _bench_options(bench: argparse.ArgumentParser) -> None:
    bench.add_argument(
        "suite", metavar="SUITE", help="accuracy, parts, layouts, scaling, ablation, short, clean or neural"
    )
    bench.add_argument("--out", type=Path, default=OUT, metavar="DIR", help="tables and records (default: %(default)s)")

    what = bench.add_argument_group("what is run")
    what.add_argument("--motions", type=Path, metavar="DIR", help="movements: BVH files, AMC files and their ASF")
    what.add_argument("--motion-count", type=int, metavar="N", help="movements (default: 5, evenly spread)")
    what.add_argument("--methods", type=names, metavar="A,B", help="methods to compare (default: the suite's)")
    what.add_argument("--cases", type=names, metavar="A,B", help="some of the suite's cases")
    what.add_argument("--seeds", type=int, metavar="N", help="sessions of each case and movement (default: 1)")
    what.add_argument("--frames", type=int, metavar="N", help="frames of a session (default: 450)")
    what.add_argument("--gaps", type=Path, metavar="FILE", help="statistics of real gaps, for the case real-gaps")
    what.add_argument("--minutes", type=float, metavar="M", help="training of each network (suite neural; default: 8)")
    what.add_argument("--iterations", type=int, metavar="N", help="cap of the published method's optimisations")

    how = bench.add_argument_group("how it is run")
    how.add_argument("--workers", type=int, metavar="N", help="runs at a time (default: one a core)")
    how.add_argument("--limit", type=float, metavar="SECONDS", help="time that one run may take")


def _common(parser: argparse.ArgumentParser) -> None:
    output = parser.add_argument_group("output")
    output.add_argument("--json", action="store_true", help="print a machine-readable summary as the last line")
    output.add_argument("--quiet", action="store_true", help="no progress and no text, only errors")
    output.add_argument("--debug", action="store_true", help="show where in the program an error arose")


def _sentence(command: str) -> str:
    text = COMMANDS[command]
    return f"{text[0].upper()}{text[1:]}."


def _attach_negative_values(words: list[str]) -> list[str]:
    """``--neutral -2:4`` as ``--neutral=-2:4``, of any option: argparse would take such a value for an option."""
    joined: list[str] = []
    for word in words:
        if joined and re.fullmatch(r"--[^=]+", joined[-1]) and re.match(r"-[\d.:]", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


def _open(words: Sequence[str], services: Services) -> int:
    """Open the window: empty, or on the session or marker file that is named."""
    path = Path(words[0]) if words else None
    if path is not None and not path.exists():
        names = ", ".join(COMMANDS)
        print(
            f'markerscope: "{shown(str(path))}" is neither a command nor a file; the commands are {names} ({_HELP}).',
            file=sys.stderr,
        )
        return REFUSED
    if len(words) > 1:
        print(f"markerscope: one session or marker file at a time; see {_HELP}.", file=sys.stderr)
        return REFUSED
    return services.window(path, False)
