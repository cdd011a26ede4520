"""What every importer hands over, and how it becomes a ``PosePrior``."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.prior_fill import fill_lost
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.io.timeline import in_seconds

_MOST_FRAMES = 2_000_000
_DEFAULT_RATE = 30.0
_LARGEST_BETA = 10.0
"""Standard deviations: nobody is shaped so."""
_BODIES = (22, 24, 52, 55)
"""Joints of a bare body, of SMPL, SMPL-H and SMPL-X, the root among them."""
_HANDS_FROM = 22
"""From this joint on SMPL has whole hands, but SMPL-H and SMPL-X have the jaw, the eyes and the fingers."""


@dataclass(frozen=True)
class Track:
    """One person as a file has them, frames that the file leaves out still missing.

    Attributes
    ----------
    rotations : (N, 24, 3, 3) root and parent-relative joint rotations
    frames : (N,) index of the video frame of each, ascending
    tracked : (N,) True where the person was observed
    rate : Hz, where the file says it
    time : (N,) s, where the file says it
    notes : what was assumed, one sentence each
    betas : shape coefficients as the file has them, (S,) or (N, S), None where it has none
    kind : of the body that these belong to, see ``PosePrior``
    """

    rotations: np.ndarray
    frames: np.ndarray
    tracked: np.ndarray
    rate: float | None = None
    time: np.ndarray | None = None
    notes: tuple[str, ...] = field(default=())
    betas: Any = None
    kind: str = ""


def numbers(value: Any, name: str, where: str) -> np.ndarray:
    """``value`` as a real float array, or the sentence that says which field is none."""
    if not isinstance(value, np.ndarray | int | float | np.number) or np.asarray(value).dtype.kind not in "buif":
        raise InputError(f"its field '{name}' is not an array of numbers", where, "export the reconstruction again")
    return np.asarray(value).astype(float)


def rotations_from_vectors(vectors: np.ndarray, name: str, where: str) -> np.ndarray:
    """(N, 24, 3, 3) from (N, 66 | 72 | 156 | 165) or (N, J, 3) rotation vectors in rad, joints beyond 22 as identity.

    Only exactly 24 joints are SMPL's, whose last two are the hands; longer lists go on with the face or the fingers.
    """
    if vectors.ndim == 3 and vectors.shape[2] == 3:
        vectors = vectors.reshape(len(vectors), -1)
    joints = vectors.shape[1] // 3 if vectors.ndim == 2 and vectors.shape[1] % 3 == 0 else 0
    if joints not in _BODIES:
        shape = " x ".join(map(str, vectors.shape))
        raise InputError(
            f"its field '{name}' has shape {shape}, not frames x 72 (SMPL), 156 (SMPL-H) or 165 (SMPL-X)",
            where,
            "export rotation vectors of all body joints",
        )
    used = len(JOINTS) if joints == len(JOINTS) else _HANDS_FROM
    rotations = np.tile(np.eye(3), (len(vectors), len(JOINTS), 1, 1))
    rotations[:, :used] = exp_so3(vectors[:, : 3 * used].reshape(len(vectors), used, 3))
    return rotations


def rotations_from_matrices(matrices: np.ndarray, name: str, where: str) -> np.ndarray:
    """(N, 24, 3, 3) proper rotations nearest to ``matrices``; frames that hold something else become NaN."""
    if matrices.shape[1:] != (len(JOINTS), 3, 3):
        shape = " x ".join(map(str, matrices.shape))
        raise InputError(
            f"its field '{name}' has shape {shape}, not frames x 24 x 3 x 3", where, "export the reconstruction again"
        )
    finite = np.isfinite(matrices).all(axis=(1, 2, 3))
    u, _, vt = np.linalg.svd(np.where(finite[:, None, None, None], matrices, np.eye(3)))
    nearest = u @ vt
    good = finite & (np.abs(nearest - matrices).max(axis=(1, 2, 3)) < 0.05) & (np.linalg.det(nearest) > 0).all(axis=1)
    return np.where(good[:, None, None, None], nearest, np.nan)


def shape_of(track: Track, most: int = 10) -> tuple[np.ndarray | None, tuple[str, ...]]:
    """(S,) the person's shape, S at most ``most``: the median over the tracked frames; and what is to be said of it."""
    if track.betas is None:
        return None, ()
    found = np.asarray(track.betas)
    if found.dtype.kind not in "fiu" or found.ndim not in (1, 2, 3) or not found.size:
        return None, ("Its shape coefficients are no numbers and are left out.",)
    rows = np.atleast_2d(found.reshape(-1, found.shape[-1]).astype(float))
    if len(rows) == len(track.tracked):
        rows = rows[track.tracked]
    rows = rows[np.isfinite(rows).all(axis=1)]
    if not len(rows) or rows.shape[1] > 400 or np.abs(np.median(rows, axis=0)).max() > _LARGEST_BETA:
        return None, ("Its shape coefficients are not of a person and are left out.",)
    if not rows.any():  # what a file holds that says no shape
        return None, ()
    name = {"smpl": "SMPL", "smplh": "SMPL-H", "smplx": "SMPL-X"}[track.kind]
    note = (
        f"Its shape coefficients are those of an {name} body: they are used with --body and a body of that kind alone."
    )
    return np.median(rows, axis=0)[:most], (note,)


def mark_invalid(track: Track) -> Track:
    """Frames whose numbers are no rotations count as lost, and are said to."""
    valid = np.isfinite(track.rotations).all(axis=(1, 2, 3))
    bad = int((track.tracked & ~valid).sum())
    if not bad:
        return replace(track, tracked=track.tracked & valid)
    note = f"{bad} of {len(valid)} frames hold no valid rotations and are taken as lost."
    return replace(track, tracked=track.tracked & valid, notes=(*track.notes, note))


def complete(track: Track, fps: float | None, where: str) -> PosePrior:
    """The prior over every frame up to the last: missing frames added as lost, lost ones filled, clock set."""
    track = mark_invalid(track)
    if not track.tracked.any():
        raise InputError(
            "it has no frame in which the person was tracked", where, "use a video that shows the whole person"
        )
    last = int(track.frames[-1])
    if track.frames[0] < 0 or (np.diff(track.frames) <= 0).any() or last >= _MOST_FRAMES:
        raise InputError("its frame numbers are not ascending counts", where, "export the reconstruction again")
    rate, rate_note = _rate(track.rate, fps, where)
    rotations = np.full((last + 1, len(JOINTS), 3, 3), np.nan)
    tracked = np.zeros(last + 1, dtype=bool)
    rotations[track.frames], tracked[track.frames] = track.rotations, track.tracked
    time = np.arange(last + 1) / rate
    if track.time is not None:
        time, rate_note = _clock(track.time, last + 1, track.rate, where)
    lost = int((~tracked).sum())
    lost_note = (f"{lost} of {last + 1} frames were lost by the video and are filled in.",) if lost else ()
    betas, shape_note = shape_of(track)
    return PosePrior(
        betas=betas,
        kind="" if betas is None else track.kind,
        rotations=fill_lost(rotations, tracked, time),
        tracked=tracked,
        time=time,
        source=where,
        notes=(*track.notes, *lost_note, *rate_note, *shape_note),
    )


def _clock(time: np.ndarray, count: int, rate: float | None, where: str) -> tuple[np.ndarray, tuple[str, ...]]:
    """The file's own times in s, held against its rate, and what they disagree on."""
    if time.shape != (count,) or not np.isfinite(time).all() or (np.diff(time) <= 0).any():
        raise InputError("its field 'time' is not one ascending number per frame", where, "remove it or correct it")
    if count < 3:
        return time, ()
    time, notes = in_seconds(time, rate)
    measured = float((count - 1) / (time[-1] - time[0]))
    if rate is not None and abs(measured / rate - 1) > 0.02:
        notes += (f"The file says {rate:g} Hz but its times {measured:.4g} Hz; its times were used.",)
    return time, notes


def _rate(own: float | None, given: float | None, where: str) -> tuple[float, tuple[str, ...]]:
    for rate in (own, given):
        if rate is not None and not (math.isfinite(rate) and 0 < rate < 10_000):
            raise InputError(f"a frame rate of {rate:g} Hz is not possible", where, "give the video's frame rate")
    if own is not None:
        if given is not None and abs(own - given) > 0.01 * own:
            return own, (f"The file's own frame rate of {own:g} Hz is used, not the {given:g} Hz given.",)
        return own, ()
    if given is not None:
        return given, ()
    return _DEFAULT_RATE, (f"The file does not say its frame rate; {_DEFAULT_RATE:g} Hz is assumed.",)
