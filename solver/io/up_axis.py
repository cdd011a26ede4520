"""Which axis of a marker file is vertical, when nobody says."""

from __future__ import annotations

import warnings

import numpy as np

from markerscope.solver.core.markers import UpAxis, lab_rotation
from markerscope.solver.io.raw import RawMarkers

_AXES: tuple[UpAxis, UpAxis, UpAxis] = ("x", "y", "z")
_RARE_X = 3.0  # next to no lab has x up
_CUSTOM = 1.5  # what the custom of a format weighs
_SURE = 1.5  # a lead this large was wrong for no whole body among the recordings it was tried on
_DECLARED_WRONG = 4.0


def settle_up(metres: np.ndarray, raw: RawMarkers, wanted: UpAxis | None) -> tuple[np.ndarray, tuple[str, ...]]:
    """``R_lab_internal`` (3, 3) of a file, and what to tell the user about it.

    Parameters
    ----------
    metres : (T, M, 3) m, file axes, NaN = lost
    raw : what the file declares
    wanted : axis the user names, if any; wins
    """
    scores = vertical_scores(metres)
    said = wanted or raw.up
    if said is not None:
        notes = []
        if wanted is not None and raw.up not in (None, wanted):
            notes.append(f"The file says {raw.up} is up; {wanted} was taken as asked.")
        if scores is not None and scores.max() - scores[_AXES.index(said)] >= _DECLARED_WRONG:
            other = _AXES[int(scores.argmax())]
            by = "You say" if wanted is not None else "The file says"
            notes.append(f"{by} {said} is up, but the markers look as if {other} were; check it.")
        return lab_rotation(said), tuple(notes)
    if scores is None:
        up = raw.usual_up or "z"
        return lab_rotation(up), (f"The file does not say which axis is up; {up} was taken by custom.",)
    scores = scores + np.array([_CUSTOM * (axis == raw.usual_up) for axis in _AXES])
    first, second = np.argsort(-scores)[:2]
    up = _AXES[int(first)]
    doubt = f" (uncertain: it may be {_AXES[int(second)]})" if scores[first] - scores[second] < _SURE else ""
    return lab_rotation(up), (f"The file does not say which axis is up; {up} was taken from the markers{doubt}.",)


def vertical_scores(metres: np.ndarray) -> np.ndarray | None:
    """(3,) how much each axis looks vertical (a log-likelihood of sorts), None without data.

    People stand along the vertical and keep doing so while they turn, stay above a floor near zero which some
    marker rarely leaves, are less than 2.4 m tall, and travel along the floor.
    """
    frames = metres[:: max(1, len(metres) // 300)]
    seen = np.isfinite(frames).all(axis=2)
    frames, seen = frames[seen.sum(axis=1) >= 2], seen[seen.sum(axis=1) >= 2]
    if not len(frames):
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # markers never seen
        centre = np.nanmedian(frames, axis=1)
        spread = np.nanstd(np.nanmean(frames - centre[:, None], axis=0), axis=0)
    low = np.nanpercentile(frames, 2, axis=1)
    points = frames[seen]
    standing = 1.5 * np.log(spread / max(float(spread.max()), 1e-9) + 0.02)
    below_floor = -4.0 * np.minimum(1, (points < -0.1).mean(axis=0) / 0.1)
    too_tall = -3.0 * np.minimum(1, (points > 2.4).mean(axis=0) / 0.1)
    height = 1.5 * np.clip(np.median(points, axis=0), 0, 1.2)
    on_floor = 2.0 * np.exp(-((low.std(axis=0) / 0.05) ** 2) - ((np.median(low, axis=0) - 0.05) / 0.12) ** 2)
    travel = -np.log1p(centre.std(axis=0) / 0.3)
    return standing + below_floor + too_tall + height + on_floor + travel - np.array([_RARE_X, 0, 0])
