"""The options of ``markerscope clean``."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path
from typing import get_args

from markerscope.solver.cleaning.request import FILLINGS, OUTLIER_METHODS, CleanRequest, parse_numbers
from markerscope.solver.core.request import Units, Up, parse_range


def clean_options(clean: argparse.ArgumentParser) -> None:
    """Declare them."""
    clean.add_argument("markers", type=Path, metavar="MARKERS", help="C3D, TRC, CSV or TSV file")
    clean.add_argument("--out", type=Path, required=True, metavar="FILE", help="cleaned file: .c3d, .trc or .csv")

    what = clean.add_argument_group("what is done")
    what.add_argument("--fill", choices=FILLINGS, help="how gaps are filled (default: regression)")
    what.add_argument("--weights", type=Path, metavar="FILE", help="of the network that fills (--fill network)")
    what.add_argument("--max-gap", type=float, metavar="SECONDS", help="longer gaps stay (default: 5; inf: no limit)")
    what.add_argument("--min-confidence", type=float, metavar="C", help="less sure fillings are left (default: 0.2)")
    what.add_argument("--outliers", choices=OUTLIER_METHODS, help="how they are found (default: local)")
    what.add_argument("--apply", type=parse_numbers, default=(), metavar="N,N", help="make these proposed edits first")

    reading = clean.add_argument_group("reading the markers (by default as the file says, else guessed and reported)")
    reading.add_argument("--up", choices=get_args(Up), help="vertical axis of the file")
    reading.add_argument("--units", choices=get_args(Units), help="length unit of the file")
    reading.add_argument("--marker-rate", type=float, metavar="HZ", help="frames a second")
    reading.add_argument("--subject", metavar="NAME", help="whose markers, where a file holds several people's")
    reading.add_argument("--range", type=parse_range, metavar="A:B", help="seconds to clean, in the file's clock")


def clean_request(options: argparse.Namespace) -> CleanRequest:
    """What was asked."""
    return CleanRequest(**{field.name: getattr(options, field.name) for field in fields(CleanRequest)})
