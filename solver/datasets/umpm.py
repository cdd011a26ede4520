"""UMPM (van der Aa et al. 2011): single-person recordings, 100 Hz markers and 50 Hz videos of four cameras."""

from __future__ import annotations

from pathlib import Path

from markerscope.solver.datasets.recording import (
    Dataset,
    Film,
    Recording,
    files_in,
    not_as_expected,
    side_by_side,
    subfolders,
)
from markerscope.solver.datasets.request import Options

CAMERA = "l"
"""The left one of front, side, right and left (table 6 of Milef et al. 2024)."""
_DERIVED = ("_ik", "_vm")
"""Ends of the names of files that hold fitted or computed points, not markers."""
_SLIPS = {"LKNSSBK": "LKNEEBK"}


def find(folder: Path, options: Options) -> tuple[Recording, ...]:
    """Recordings of one person: ``p1_*/Groundtruth/NAME.c3d`` with ``p1_*/Video/NAME_l.avi``."""
    found = []
    for trial in [folder, *subfolders(folder)]:
        for path in files_in(trial / "Groundtruth", ".c3d"):
            if path.stem.startswith("p1_") and not path.stem.endswith(_DERIVED):
                films = [film for film in files_in(trial / "Video", ".avi") if film.stem == f"{path.stem}_{CAMERA}"]
                found.append(Recording(path.stem, path, film=Film(films[0]) if films else None))
    if not found:
        raise not_as_expected("UMPM", folder, "folders such as p1_grab_3, each with Groundtruth and Video in it")
    return tuple(found)


def label(raw: str, options: Options) -> str | None:
    """The marker's name in capitals; what Vicon could not name is left out."""
    name = raw.upper()
    return None if name.startswith("*") or not name else _SLIPS.get(name, name)


_ARM = side_by_side(("LWREXT", "LWRTOP", "LWRLOW", "LELBTOP", "LELBEXT", "LELBLOW", "LSHLD"))
_LEG = side_by_side(("LTOPLEG", "LKNEEFR", "LKNEEBK", "LKNEEIS", "LANKFR", "LANKBK", "LANKIS"))

UMPM = Dataset(
    title="UMPM",
    window_s=15.0,
    padding_s=5.0,
    find=find,
    label=label,
    parts={f"{side}_{part}": labels[side] for part, labels in (("arm", _ARM), ("leg", _LEG)) for side in labels},
)
