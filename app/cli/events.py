"""The options of ``markerscope events`` and ``markerscope cycles``."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import get_args

from markerscope.solver.core.request import Units, Up
from markerscope.solver.cycles.request import (
    CyclesRequest,
    FilterRequest,
    parse_filter,
    parse_leave_out,
    parse_quantities,
)
from markerscope.solver.events.request import EventSource, EventsRequest


def events_options(events: argparse.ArgumentParser) -> None:
    """Declare those of ``events``."""
    events.add_argument("trial", type=Path, metavar="RESULT|MARKERS", help="folder that solve wrote, or a marker file")
    events.add_argument(
        "--out", type=Path, nargs="+", default=[], metavar="FILE", help=".csv, or .c3d (default: RESULT/events.csv)"
    )
    what = events.add_argument_group("what is looked for")
    what.add_argument(
        "--from",
        dest="source",
        choices=get_args(EventSource),
        default="auto",
        help="what steps are told by (default: the file's own events, else plates, and the body or the markers)",
    )
    what.add_argument("--plates", type=Path, metavar="FILE", help="ground reaction forces of OpenSim (.mot, .sto)")
    what.add_argument("--threshold", type=float, default=20.0, metavar="N", help="of the plates (default: 20 newtons)")
    what.add_argument("--repetitions", metavar="ANGLE", help="repetitions by an angle of the result, instead of steps")

    reading = events.add_argument_group("reading a marker file (by default as it says, else guessed and reported)")
    reading.add_argument("--up", choices=get_args(Up), help="vertical axis of the file")
    reading.add_argument("--units", choices=get_args(Units), help="length unit of the file")
    reading.add_argument("--marker-rate", type=float, metavar="HZ", help="frames a second")
    reading.add_argument("--subject", metavar="NAME", help="whose markers, where a file holds several people's")


def events_request(options: argparse.Namespace) -> EventsRequest:
    """What was asked."""
    given = {field.name: getattr(options, field.name) for field in fields(EventsRequest)}
    return EventsRequest(**given | {"out": tuple(options.out)})


def cycles_options(cycles: argparse.ArgumentParser) -> None:
    """Declare those of ``cycles``."""
    cycles.add_argument(
        "trials", type=Path, nargs="+", metavar="RESULT", help="trials of one person: folders that solve wrote, or .mot"
    )
    cycles.add_argument("--out", type=Path, metavar="DIR", help="tables and figures (default: RESULT/cycles)")
    what = cycles.add_argument_group("what is cut, and how")
    what.add_argument(
        "--events", type=Path, metavar="FILE", help="CSV of events (default: RESULT/events.csv, else found)"
    )
    what.add_argument("--repetitions", metavar="ANGLE", help="cut by the repetitions of an angle, instead of steps")
    what.add_argument(
        "--what",
        dest="quantities",
        type=parse_quantities,
        default=CyclesRequest.quantities,
        metavar="A,B",
        help="gait, angles, velocities, joints, markers (default: gait,angles)",
    )
    what.add_argument(
        "--filter",
        type=parse_filter,
        default=FilterRequest(),
        metavar="NAME",
        help="of the curves: none (default), butterworth:HZ, butterworth:HZ:ORDER, butterworth:auto, spline",
    )
    what.add_argument(
        "--leave-out",
        type=parse_leave_out,
        action="append",
        default=[],
        metavar="CYCLE:WHY",
        help='leave a cycle out, with the reason: "left 2: stumbled"; of several trials "TRIAL/left 2: stumbled"',
    )
    against = cycles.add_argument_group("against controls")
    against.add_argument(
        "--controls", type=Path, nargs="+", default=[], metavar="RESULT|CSV", help="results of controls, or mean and SD"
    )
    figure = cycles.add_argument_group("the figure")
    figure.add_argument("--title", metavar="TEXT", help="over it (default: the trials' names)")
    figure.add_argument("--width", dest="width_mm", type=float, default=180.0, metavar="MM", help="(default: 180)")


def cycles_request(options: argparse.Namespace) -> CyclesRequest:
    """What was asked."""
    given = {field.name: getattr(options, field.name) for field in fields(CyclesRequest)}
    lists = {name: tuple(given[name]) for name in ("trials", "controls", "leave_out")}
    return CyclesRequest(**given | lists)
