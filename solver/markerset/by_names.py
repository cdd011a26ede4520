"""The body fitted to a trial whose markers carry names that shipped marker sets know."""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.kinematics import Pose
from markerscope.solver.fit.labelled.start import rigid_starts
from markerscope.solver.markerset.held import follow, interpolated, reshape, where
from markerscope.solver.markerset.marker_set import MarkerSet
from markerscope.solver.markerset.shipped import shipped, shipped_names

_ENOUGH = 8
_KEYFRAMES, _HZ = 20, 25.0
_CONTRADICTS_M = 0.09


@dataclass(frozen=True, eq=False)
class ByNames:
    """A labelled trial on the body.

    Attributes
    ----------
    pose : of all T frames
    known : the shipped set whose names were used
    used : how many of them
    notes : names that contradict the body, one sentence each
    """

    pose: Pose
    known: str
    used: int
    notes: tuple[str, ...]


def pose_by_names(body: Body, markers: Markers, progress: Progress = silent) -> ByNames:
    """The body on the markers whose names a shipped set has; those that ride elsewhere than it says are told.

    Raises
    ------
    InputError : no shipped set knows enough of the names
    """
    marker_set, columns = _best(markers)
    if len(columns) < _ENOUGH:
        raise InputError(
            f"no shipped marker set knows more than {len(columns)} of its names",
            markers.source or "the markers",
            "give a video or a pose prior of the trial (--video, --prior), or a folder that markerscope solve wrote",
        )
    rate_step = max(1, round(markers.rate / _HZ))
    every = np.unique(np.append(np.arange(0, len(markers.positions), rate_step), len(markers.positions) - 1))
    named = markers.positions[every][:, columns]
    points, betas = marker_set.points(body), marker_set.shape(body)
    seen = np.isfinite(named).all(axis=2).sum(axis=1)
    good = np.flatnonzero(seen >= max(3, 0.8 * seen.max()))
    keys = np.unique(good[np.linspace(0, len(good) - 1, min(_KEYFRAMES, len(good))).round().astype(int)])
    if not len(keys):
        raise InputError("the named markers are not seen together", markers.source, "give another trial")
    starts = rigid_starts(body, points, named, betas)
    tries = []
    for i, start in enumerate(starts):
        part_of(progress, 0.3 * i, 0.3 * (i + 1))(0.0, "placing the named markers")
        # The pose first, shape and places held: a relaxed body has to bend before its limbs' lengths mean anything.
        posed = follow(body, points, named[keys], np.arange(len(keys)), start.at(keys))
        pose, placement = reshape(body, points, marker_set.spreads, named[keys], posed, True)
        off = np.linalg.norm(where(body, placement, pose) - named[keys], axis=2)
        tries.append((float(np.nanmedian(off)), pose, placement))
    _, pose, placement = min(tries, key=lambda one: one[0])
    followed = follow(body, placement, named, keys, pose, part_of(progress, 0.6, 0.95))
    full = interpolated(followed, every.astype(float), np.arange(len(markers.positions), dtype=float))
    off = np.nanmedian(np.linalg.norm(where(body, points, followed) - named, axis=2), axis=0)
    names = np.array(marker_set.names)
    odd = [f"{names[u]} ({1000 * off[u]:.0f} mm)" for u in np.flatnonzero(off > _CONTRADICTS_M)]
    notes = (
        "Far from where the names usually are, as if they were exchanged or mean something else here: "
        f"{', '.join(odd)}.",
    )
    return ByNames(full, marker_set.name, len(columns), notes if odd else ())


def _best(markers: Markers) -> tuple[MarkerSet, np.ndarray]:
    """The shipped set with most of the names, cut down to them, and the columns that they are."""
    plain = {_plain(label): m for m, label in reversed(list(enumerate(markers.labels)))}
    best: tuple[MarkerSet | None, list[int], list[int]] = (None, [], [])
    for name in shipped_names():
        known = shipped(name)
        own = [u for u, label in enumerate(known.names) if _plain(label) in plain]
        if len(own) > len(best[1]):
            best = known, own, [plain[_plain(known.names[u])] for u in own]
    known_set, own, columns = best
    if known_set is None or len(own) < 3:
        raise InputError(
            "no shipped marker set knows its names",
            markers.source or "the markers",
            "give a video or a pose prior of the trial (--video, --prior), or a folder that markerscope solve wrote",
        )
    return known_set.part(np.array(own)), np.array(columns)


def _plain(label: str) -> str:
    """A name as it is compared: capitals and separators do not count."""
    return re.sub(r"[\s._:\-]+", "", label).lower()
