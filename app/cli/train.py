"""The options of ``markerscope train``."""

from __future__ import annotations

import argparse
from dataclasses import fields
from pathlib import Path

from markerscope.solver.neural.request import NAMED, NETWORKS, SIZES, TrainRequest


def train_options(train: argparse.ArgumentParser) -> None:
    """Declare them."""
    train.add_argument("session", type=Path, nargs="?", metavar="SESSION", help="whose layout and body it is for")
    train.add_argument("--out", type=Path, required=True, metavar="FILE", help="file for the weights")

    what = train.add_argument_group("what it learns")
    what.add_argument("--layout", metavar="NAME", help=f"for anybody with this layout instead: {', '.join(NAMED)}")
    what.add_argument(
        "--network", choices=NETWORKS, help="any layout's (default), or the published solver, or gap filler, of one"
    )
    what.add_argument("--size", choices=SIZES, help="of a published network (default: compact)")
    what.add_argument(
        "--motions", type=Path, nargs="+", default=(), metavar="FOLDER", help="of BVH files, AMC files and their ASF"
    )
    what.add_argument("--made", type=int, metavar="N", help="made motions to learn from beside them (default: 120)")
    what.add_argument("--start", type=Path, metavar="FILE", help="weights to begin with (default: those that ship)")

    how = train.add_argument_group("how it learns")
    how.add_argument("--minutes", type=float, metavar="M", help="that it may take (default: 15)")
    how.add_argument("--steps", type=int, metavar="N", help="that it may take, if the minutes do not end before")
    how.add_argument("--resume", action="store_true", help="go on with a training that was stopped")
    how.add_argument("--seed", type=int, metavar="N", help="of every random choice (default: 0)")


def train_request(options: argparse.Namespace) -> TrainRequest:
    """What was asked."""
    given = {field.name: getattr(options, field.name) for field in fields(TrainRequest)}
    given["motions"] = tuple(given["motions"])
    return TrainRequest(**{name: value for name, value in given.items() if value is not None})
