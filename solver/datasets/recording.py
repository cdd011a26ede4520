"""What a dataset's folder holds, and how it is to be cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.datasets.request import Options

RATE = 30.0
"""Hz, what Milef et al. (2024) bring every dataset to."""


@dataclass(frozen=True)
class Film:
    """A video, or a ZIP file of its frames.

    Attributes
    ----------
    path : of either
    camera : part of the names of the frames that are wanted, blank for a video
    rate : Hz that the frames were really taken at, None as the video says
    shrink : every so many pixels of a frame become one
    """

    path: Path
    camera: str = ""
    rate: float | None = None
    shrink: int = 1


@dataclass(frozen=True)
class Recording:
    """One trial of a dataset.

    Attributes
    ----------
    name : also of its sessions
    markers : marker file
    subject : whose markers of that file, where several people's are in it
    film : of the camera that the paper used, None where it is not there
    reference : motion by the dataset's makers, None where there is none
    synchronised : whether markers and video were started together
    """

    name: str
    markers: Path
    subject: str | None = None
    film: Film | None = None
    reference: Path | None = None
    synchronised: bool = True


@dataclass(frozen=True)
class Dataset:
    """How a dataset is read and cut.

    Attributes
    ----------
    title : its name in messages
    window_s, padding_s : s, length of each window; what is left out at either end of a recording
    find : recordings below a folder
    label : the marker that a file's label means, None for what is left out; given the session's options
    parts : labels of the markers of each part of the body
    """

    title: str
    window_s: float
    padding_s: float
    find: Callable[[Path, Options], tuple[Recording, ...]]
    label: Callable[[str, Options], str | None]
    parts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)


def subfolders(folder: Path) -> list[Path]:
    """The folders in a folder, by name; hidden ones left out."""
    return sorted(path for path in _listed(folder) if path.is_dir() and not path.name.startswith("."))


def files_in(folder: Path, *suffixes: str) -> list[Path]:
    """The files with such suffixes in a folder, by name; none where there is no such folder."""
    if not folder.is_dir():
        return []
    return sorted(
        path
        for path in _listed(folder)
        if path.is_file() and path.suffix.lower() in suffixes and not path.name.startswith(".")
    )


def _listed(folder: Path) -> list[Path]:
    try:
        return list(folder.iterdir())
    except OSError as error:
        raise InputError(f"cannot be looked into ({error.strerror})", folder, "name the dataset's folder") from error


def not_as_expected(title: str, folder: Path, wanted: str) -> InputError:
    """The one sentence for a folder that holds no recordings of the dataset."""
    return InputError(f"holds no recordings of {title}", folder, f"name the folder that holds {wanted}")


def side_by_side(left: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    """The same markers of both sides; labels begin with L or R."""
    return {"left": left, "right": tuple(f"R{label[1:]}" for label in left)}
