"""Other programs in the benchmark: sessions out as files that they read, their results in as a method's answers."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.bench.methods import Given, Solve, Solved, Variant
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.evaluate.posed import Posed, imported_result
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.io.atomic import make_folder
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_smpl import write_smpl_npz

_ENDS = (".npz", "_stageii.pkl", "_stageii.npz", ".pkl", "")
_CODE = ("core", "body", "evaluate/posed.py", "bench/imported.py", "io/motion_in.py", "io/motion_layouts.py")
_LOOKS = 20
"""Frames, evenly spread, by which markers are given to the skin below them."""


def marker_key(markers: Markers) -> str:
    """16 hexadecimal digits that tell a session by its trajectories."""
    return hashlib.sha256(np.ascontiguousarray(markers.positions, dtype=np.float32).tobytes()).hexdigest()[:16]


def write_for_others(folder: Path, given: Given) -> str:
    """Write what a method is given as ``KEY.c3d`` and ``KEY_prior.npz``; returns the key."""
    make_folder(folder)
    key = marker_key(given.markers)
    write_c3d(folder / f"{key}.c3d", given.markers, up="z")
    prior = given.prior
    poses = log_so3(prior.rotations).reshape(len(prior.rotations), -1)
    rate = 1 / float(np.median(np.diff(prior.time)))
    extra = {"tracked": prior.tracked, "time": prior.time}
    write_smpl_npz(folder / f"{key}_prior.npz", poses, np.zeros((len(poses), 3)), np.zeros(10), rate, extra)
    return key


@dataclass(frozen=True)
class ImportSettings:
    """Where results are.

    Attributes
    ----------
    folder : of the results
    digest : of what lies there: more results are other results
    iterations : 1 while everything is imported that a run needs, for which no session is written
    """

    folder: str
    digest: str
    iterations: int | None = None


def outside(name: str) -> Variant:
    """The method ``NAME=FOLDER``: the results in a folder, under a name for the table.

    Raises
    ------
    InputError : there is no such folder, or no name
    """
    title, _, place = name.partition("=")
    folder = Path(place)
    if not title or not folder.is_dir():
        raise InputError(f'"{place}" is no folder', f"--methods {name}", "give NAME=FOLDER, and make the folder")
    seen = [(p.name, p.stat().st_size, p.stat().st_mtime_ns) for p in sorted(folder.iterdir()) if _is_result(p)]
    digest = hashlib.sha256(repr(seen).encode()).hexdigest()[:16]
    settings = {"imported": ImportSettings(str(folder.absolute()), digest)}
    return Variant(name, f"results of another program, from {folder.name}", imported(folder), settings, _CODE)


def _is_result(path: Path) -> bool:
    return path.suffix != ".c3d" and not path.name.endswith("_prior.npz")


def imported(folder: Path, body: Path | None = None) -> Solve:
    """A method whose answers were computed elsewhere. A session without one is written there for the other program.

    Parameters
    ----------
    folder : results, each called after ``marker_key`` of its session: ``KEY.npz``, ``KEY_stageii.pkl``, or a folder
        ``KEY`` with a ``motion.npz`` in it
    body : the SMPL model file that they were made with, where they are not of the embedded body
    """

    def solve(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
        key = marker_key(given.markers)
        path = next((folder / f"{key}{end}" for end in _ENDS if (folder / f"{key}{end}").exists()), None)
        if path is None:
            if getattr(settings.get("imported"), "iterations", None) != 1:
                write_for_others(folder, given)
            raise InputError(
                f"holds no result for the session {key}",
                folder,
                f"run the other program on {key}.c3d, which was written there, and call its result {key}.npz",
            )
        found, notes = imported_result(path, body=body, first_time=float(given.markers.time[0]))
        motion = imported_motion(found, given.markers, notes)
        return Solved(motion, found.body, float("nan"), {})

    return solve


def imported_motion(found: Posed, markers: Markers, notes: tuple[str, ...] = ()) -> FittedMotion:
    """A result on the frames of the markers, each of which is taken to sit on the skin that stays nearest to it.

    Raises
    ------
    InputError : it covers none of the markers' time
    """
    held = np.clip(markers.time, found.time[0], found.time[-1])
    if not (np.abs(held - markers.time) < 0.5 / markers.rate).any():
        raise InputError(
            "the imported result covers none of the markers' time", markers.source or None, "check its clock"
        )
    at = found.at(held)
    count = len(markers.labels)
    looked = np.flatnonzero(markers.present.any(axis=1))
    looked = np.unique(looked[np.linspace(0, len(looked) - 1, min(_LOOKS, len(looked))).round().astype(int)])
    index = np.flatnonzero(found.body.marker_mask)
    mesh, present = at.vertices(looked)[:, index], markers.present[looked]
    vertex = np.full(count, -1)
    for m in np.flatnonzero(present.any(axis=0)):
        seen = present[:, m]
        gap = mesh[seen] - markers.positions[looked[seen], m][:, None]
        vertex[m] = index[np.linalg.norm(gap, axis=2).mean(axis=0).argmin()]
    joint = np.where(vertex >= 0, found.body.weights[vertex].argmax(axis=1), -1)
    nowhere = np.full((len(held), count, 3), np.nan)
    return FittedMotion(
        time=markers.time,
        rotations=at.rotations,
        trans=at.trans,
        betas=found.betas,
        joints=at.joints,
        marker_joint=joint,
        marker_vertex=vertex,
        placed=nowhere,
        residual=nowhere[..., 0],
        camera=CameraResult(np.eye(3), np.zeros(3), 1.0, (0, 0), float("nan")),
        chosen=0,
        confidence=0.0,
        warnings=notes,
    )
