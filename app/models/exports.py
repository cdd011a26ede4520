"""Results into files of other programs: all or none of what was chosen, with every setting written beside them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.app.models.fields import title
from markerscope.app.models.stages import StageBoard
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import make_folder, write_bytes_atomic
from markerscope.solver.io.together import together
from markerscope.solver.pipeline.methods import spelt_out
from markerscope.solver.pipeline.source import contents
from markerscope.solver.pipeline.stage import Event, GraphRun

if TYPE_CHECKING:
    from markerscope.solver.report.report_data import Picture


@dataclass(frozen=True)
class Format:
    """Something that can be written.

    Attributes
    ----------
    name : in the program
    title : as the user reads it
    files : names of what is written
    help : for which program, in which units and axes
    """

    name: str
    title: str
    files: tuple[str, ...]
    help: str


_WORDS = {
    "angles": ("Joint angles, a column each (CSV)", "Degrees; convention, signs and all settings in angles.json"),
    "angles_long": ("Joint angles, a row per value (CSV)", "For statistics programs; degrees, settings in angles.json"),
    "mot": ("Joint angles for OpenSim (MOT)", "Degrees, in the convention chosen"),
    "c3d": ("Labelled markers (C3D)", "Millimetres, the axes of your file; filled points have residual 0"),
    "trc": ("Labelled markers (TRC)", "Metres, y up as OpenSim expects; filled points are listed beside it"),
    "bvh": ("Skeleton motion (BVH)", "Centimetres, y up, rotations Z X Y"),
    "motion": ("Body parameters (SMPL layout, NPZ)", "AMASS layout; metres, radians, z up"),
    "camera": ("Camera, for other trials (JSON)", "Place, direction and focal length as fitted"),
    "report": ("Report (HTML)", "Pictures, figures and settings for a methods section, in one file"),
}
PICTURES = Format(
    "pictures", "Pictures of the views (PNG)", ("views",), "As they are shown now, in a folder of their own"
)


def formats() -> tuple[Format, ...]:
    """All that can be written into a folder."""
    from markerscope.solver.report.outputs import FORMATS

    return (*(Format(name, *_WORDS[name][:1], files, _WORDS[name][1]) for name, files in FORMATS.items()), PICTURES)


def why_not(board: StageBoard) -> str:
    """Why nothing can be exported now; empty if it can. Results that are stale are never written."""
    missing = [title(name) for name in board.names if name not in board.current]
    return f"not there under these settings: {', '.join(missing)}; run all stages first" if missing else ""


def export(
    board: StageBoard, folder: Path, chosen: Collection[str], pictures: Sequence[Picture] = ()
) -> tuple[Path, ...]:
    """Write the chosen formats into a folder and say which files these are.

    Parameters
    ----------
    pictures : views of the session, for the report and the format "pictures"

    Raises
    ------
    InputError : a result is not there under the settings in force, or the file system refuses; nothing is written
    """
    from markerscope.solver.report.outputs import FORMATS, write_formats

    known = [*FORMATS, PICTURES.name]
    if unknown := set(chosen) - set(known):
        raise InputError(f"there is no format {sorted(unknown)[0]}", "export", f"use {', '.join(known)}")
    if not chosen:
        raise InputError("nothing was chosen", "export", "choose at least one format")
    graph = graph_run(board)
    session = spelt_out(board.document.session, contents(board.sources))
    files = [name for name in chosen if name != PICTURES.name]
    with together(folder) as place:
        written = write_formats(place, session, graph, files, pictures) if files else ()
        if PICTURES.name in chosen:
            written = (*written, *write_pictures(place / PICTURES.files[0], pictures))
        names = [path.relative_to(place) for path in written]
    return tuple(folder / name for name in names)


def export_angles(board: StageBoard, path: Path) -> tuple[Path, ...]:
    """Write the joint angles under a name of the user's, and beside them, under the same name, what they mean.

    Raises
    ------
    InputError : as in ``export``; nothing is written
    """
    path = path if path.suffix else path.with_suffix(".csv")
    if path.suffix.lower() != ".csv":
        raise InputError("is no name for a table", path, "choose one that ends in .csv")
    with together(path.parent) as place:
        written = export(board, place, ["angles"])
        named = {file: file.with_name(path.stem + file.name.removeprefix("angles")) for file in written}
        for file, target in named.items():
            file.rename(target)
    return tuple(path.with_name(target.name) for target in named.values())


def graph_run(board: StageBoard) -> GraphRun:
    """The results in force as a finished run.

    Raises
    ------
    InputError : one of them is not there
    """
    if reason := why_not(board):
        raise InputError(reason.split("; ", maxsplit=1)[0], "the results", "run all stages first")
    events = {}
    for name in board.names:
        entry = board.results.entry(name, board.keys[name])
        assert entry is not None
        seconds, headline = float(entry.about.get("seconds", 0.0)), str(entry.about.get("headline", ""))
        # Counted as computed, so that a report tells how long each took.
        events[name] = Event(name, "cached", entry.key, seconds, headline, computed=True)
    return GraphRun(board.keys, events, board.current.__getitem__)


def write_pictures(folder: Path, pictures: Sequence[Picture]) -> tuple[Path, ...]:
    """Write views as PNG files named after what they show.

    Raises
    ------
    InputError : the file system refuses
    """
    make_folder(folder)
    written = []
    for i, picture in enumerate(pictures, start=1):
        words = "".join(c if c.isalnum() else "_" for c in picture.caption.lower()).strip("_")[:60]
        path = folder / f"{i:02d}_{words or 'view'}.png"
        write_bytes_atomic(path, picture.png)
        written.append(path)
    return tuple(written)


def write_video(path: Path, frames: Iterable[np.ndarray], rate: float) -> int:
    """Write pictures (H, W, 3) uint8 RGB as MP4, asked for one by one; returns how many there were.

    Raises
    ------
    InputError : there are none, or the file system refuses; nothing is left behind
    """
    from markerscope.solver.io.movie import write_movie

    return write_movie(path, frames, rate)
