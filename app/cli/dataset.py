"""The options of ``markerscope dataset``."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from markerscope.solver.datasets.request import DatasetName, DatasetRequest, Options


def dataset_options(dataset: argparse.ArgumentParser) -> None:
    """Declare them."""
    dataset.add_argument("dataset", choices=get_args(DatasetName), help="which dataset the folder holds")
    dataset.add_argument("folder", type=Path, metavar="FOLDER", help="your own copy of it")
    dataset.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the sessions")
    dataset.add_argument("--priors", type=Path, metavar="DIR", help="poses by another program instead of the videos")
    dataset.add_argument("--offsets", type=Path, metavar="FILE", help="JSON: seconds by which each video is off")
    dataset.add_argument("--parts", nargs="+", default=[], metavar="PART", help="left_arm, right_leg... (default: all)")
    dataset.add_argument("--windows", type=int, metavar="N", help="of each recording at most (default: all)")
    dataset.add_argument("--backpack", action="store_true", help="keep the markers on the backpack (kitchen)")
    dataset.add_argument("--split", choices=("train", "val"), default="val", help="of moyo (default: %(default)s)")


def dataset_request(options: argparse.Namespace) -> DatasetRequest:
    """What was asked."""
    return DatasetRequest(
        options.dataset,
        options.folder,
        options.out,
        parts=tuple(options.parts),
        windows=options.windows,
        priors=options.priors,
        offsets=options.offsets,
        options=Options(backpack=options.backpack, split=options.split),
    )
