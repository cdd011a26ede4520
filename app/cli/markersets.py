"""The options of ``markerscope label`` and of ``markerscope markerset``."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import Any, get_args

from markerscope.solver.core.request import Units, Up, parse_range
from markerscope.solver.markerset.request import LabelRequest, LearnRequest

SET_HELP = "plug-in-gait, ior-cast, rajagopal, opencap, helen-hayes, cmu-41, or a file"


def label_options(label: argparse.ArgumentParser) -> None:
    """Declare them."""
    label.add_argument("markers", type=Path, metavar="MARKERS", help="C3D, TRC, CSV or TSV file; names do not matter")
    label.add_argument("--marker-set", required=True, metavar="NAME|FILE", help=SET_HELP)
    label.add_argument("--out", type=Path, required=True, metavar="FILE", help="labelled file: .c3d, .trc or .csv")
    _reading(label)


def label_request(options: argparse.Namespace) -> LabelRequest:
    """What was asked."""
    return LabelRequest(**{field.name: getattr(options, field.name) for field in fields(LabelRequest)})


def markerset_options(parser: argparse.ArgumentParser, common: Any) -> None:
    """Declare ``list``, ``show`` and ``learn``; ``common`` adds what all commands have."""
    doing = parser.add_subparsers(title="what", dest="doing", metavar="WHAT", required=True, parser_class=type(parser))
    listing = doing.add_parser("list", help="the sets that ship", description="The sets that ship.")
    common(listing)
    show = doing.add_parser("show", help="one set, as its file says it", description="One set, as its file says it.")
    show.add_argument("marker_set", metavar="NAME|FILE", help=SET_HELP)
    common(show)
    learn = doing.add_parser(
        "learn", help="a set from one labelled trial", description="A marker set from one labelled trial."
    )
    learn.add_argument(
        "markers", type=Path, metavar="MARKERS|SESSION", help="labelled C3D, TRC, CSV or TSV; or what solve wrote"
    )
    learn.add_argument("--out", type=Path, required=True, metavar="FILE", help="the marker set, .toml")
    learn.add_argument("--name", metavar="NAME", help="of the set (default: the file's)")
    learn.add_argument("--video", type=Path, metavar="FILE", help="of the trial, where no shipped set knows its names")
    learn.add_argument("--prior", type=Path, metavar="FILE", help="poses of the trial, likewise")
    _reading(learn)
    common(learn)


def learn_request(options: argparse.Namespace) -> LearnRequest:
    """What was asked."""
    return LearnRequest(**{field.name: getattr(options, field.name) for field in fields(LearnRequest)})


def _reading(parser: argparse.ArgumentParser) -> None:
    reading = parser.add_argument_group("reading the markers (by default as the file says, else guessed and reported)")
    reading.add_argument("--up", choices=get_args(Up), help="vertical axis of the file")
    reading.add_argument("--units", choices=get_args(Units), help="length unit of the file")
    reading.add_argument("--marker-rate", type=float, metavar="HZ", help="frames a second")
    reading.add_argument("--subject", metavar="NAME", help="whose markers, where a file holds several people's")
    reading.add_argument("--range", type=parse_range, metavar="A:B", help="seconds to take, in the file's clock")
