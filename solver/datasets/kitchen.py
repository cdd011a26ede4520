"""CMU Kitchen, pilot study (De la Torre et al. 2009): people who cook with a backpack on, markers at 120 Hz."""

from __future__ import annotations

from pathlib import Path

from markerscope.solver.core.errors import InputError
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

CAMERA = "7151062"
BACKPACK = ("LBWT", "NEWLBAC", "NEWRBAC", "RBAC", "RBWT", "T10", "T8")
"""Markers on the outside of the backpack, decimetres from the skin that they are named after."""
VIDEO_RATE = 29.97
"""Hz that the cameras really ran at, whatever their files say (Milef et al. 2024, appendix B.1.1)."""
_COOK = "cook"


def find(folder: Path, options: Options) -> tuple[Recording, ...]:
    """``mocap/SUBJECT/RECIPE.c3d`` with ``videos/SUBJECT/RECIPE*7151062*.avi``; not synchronised."""
    found = []
    for subject in subfolders(folder / "mocap") if (folder / "mocap").is_dir() else []:
        for path in files_in(subject, ".c3d"):
            films = [
                film
                for film in files_in(folder / "videos" / subject.name, ".avi", ".mp4", ".mpg")
                if film.stem.lower().startswith(path.stem.lower()) and CAMERA in film.stem
            ]
            film = Film(films[0], rate=VIDEO_RATE) if films else None
            name = f"{subject.name}_{path.stem}"
            found.append(Recording(name, path, cook_of(path), film, synchronised=False))
    if not found:
        raise not_as_expected("CMU Kitchen", folder, "mocap/SUBJECT/RECIPE.c3d and videos/SUBJECT/RECIPE_7151062.avi")
    return tuple(found)


def cook_of(path: Path) -> str | None:
    """The subject who cooks; objects are listed as subjects, too."""
    from markerscope.solver.io.markers_in import list_subjects

    subjects = list_subjects(path)
    if not subjects:
        return None
    cooks = [name for name in subjects if _COOK in name.lower()]
    if not cooks:
        some = ", ".join(subjects[:6])
        raise InputError(f"names no cook among its subjects ({some})", path, "use the files as they were distributed")
    return cooks[0]


def label(raw: str, options: Options) -> str | None:
    """The marker's name; those of objects are left out, and those on the backpack unless they are asked for."""
    if raw.startswith("*") or ":" in raw or (raw in BACKPACK and not options.backpack):
        return None
    return raw


_ARM = side_by_side(("LWRA", "LWRB", "LFIN", "LTHMB", "LELB", "LFRM", "NEWLSHO", "LUPA"))
_LEG = side_by_side(("LFWT", "LTHI", "LKNE", "LSHN", "LANK", "LHEE", "LTOE", "LMT5", "LMT1", "LRSTBEEF"))

KITCHEN = Dataset(
    title="CMU Kitchen",
    window_s=15.0,
    padding_s=5.0,
    find=find,
    label=label,
    parts={
        "left_arm": _ARM["left"],
        "right_arm": (*_ARM["right"][:-2], "NEWRSHO", "RUPA"),
        "left_leg": _LEG["left"],
        "right_leg": _LEG["right"],
        "left_shoulder": ("LELB", "LFRM", "NEWLSHO", "LUPA", "LSHO"),
        "right_shoulder": ("RELB", "RFRM", "NEWRSHO", "RUPA", "RSHO"),
    },
)
