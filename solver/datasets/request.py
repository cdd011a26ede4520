"""What a user asks to be made of a dataset."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal

DatasetName = Literal["umpm", "kitchen", "moyo"]


@dataclass(frozen=True)
class Options:
    """What the user chooses.

    Attributes
    ----------
    backpack : keep the markers on the backpack (Kitchen)
    split : train or val (MOYO)
    """

    backpack: bool = False
    split: str = "val"


@dataclass(frozen=True)
class DatasetRequest:
    """What is to be made of which dataset.

    Attributes
    ----------
    dataset, folder : which, and the user's copy of it
    out : folder for the sessions
    parts : parts of the body to make sessions of; none: the whole body
    windows : of each recording at most
    priors : folder of poses by another program, named after the recordings; used instead of the videos
    offsets : JSON file, recording -> s, marker time less video time, where they were not started together
    options : what the dataset leaves to the user
    """

    dataset: DatasetName
    folder: Path
    out: Path
    parts: tuple[str, ...] = ()
    windows: int | None = None
    priors: Path | None = None
    offsets: Path | None = None
    options: Options = field(default_factory=Options)
