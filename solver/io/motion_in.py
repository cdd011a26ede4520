"""A body motion from a file: a result's ``motion.npz``, an npz in AMASS layout, a MoSh++ or SOMA result."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.io.motion_layouts import as_amass, model_of
from markerscope.solver.io.priors.track import numbers, rotations_from_vectors
from markerscope.solver.safe_pickle import load_untrusted

MOTION = "motion.npz"
_RATES = ("mocap_frame_rate", "mocap_framerate", "fps")
_REMEDY = "use the folder that solve wrote, a stageii.pkl, or an npz with 'poses', 'trans' and 'mocap_frame_rate'"


@dataclass(frozen=True, eq=False)
class MotionFile:
    """A motion in its file's world frame (z up).

    Attributes
    ----------
    rotations : (T, 24, 3, 3) root in the world, others relative to the parent
    trans : (T, 3) m
    betas : (S,) shape
    bone_lengths : (B,) further shape coefficients of a result, empty elsewhere
    rate : Hz
    time : (T,) s, None where the file does not say
    joints : (T, 24, 3) m, None where the file does not say
    source : path of the file
    model : the body model that a program names as its own, blank where it names none
    """

    rotations: np.ndarray
    trans: np.ndarray
    betas: np.ndarray
    bone_lengths: np.ndarray
    rate: float
    time: np.ndarray | None
    joints: np.ndarray | None
    source: str
    model: str = ""


def read_motion(path: str | Path) -> MotionFile:
    """Read a result (its folder or its ``motion.npz``), an npz in AMASS layout, or a ``*_stageii.pkl`` of MoSh++.

    Raises
    ------
    InputError
        Where there is no such file, or it is no motion of a 24-joint body.
    """
    path = Path(path)
    if path.is_dir():
        if not (path / MOTION).is_file():
            raise InputError(f"the folder holds no {MOTION}", path, "name a folder that solve wrote")
        path = path / MOTION
    where = str(path)
    data = load_untrusted(path)
    data = as_amass(data) if isinstance(data, dict) else data
    if not isinstance(data, dict) or not {"poses", "trans"} <= set(data):
        raise InputError("it is not a motion: it lacks 'poses' or 'trans'", where, _REMEDY)
    poses = numbers(data["poses"], "poses", where)
    if poses.ndim < 2 or not len(poses):
        raise InputError("it has no frames", where, _REMEDY)
    rotations = rotations_from_vectors(poses, "poses", where)
    count = len(rotations)
    time = _optional(data, "time", (count,), where)
    if time is not None and not (np.diff(time) > 0).all():
        raise InputError("its times do not ascend", where, _REMEDY)
    trans = _optional(data, "trans", (count, 3), where)
    return MotionFile(
        rotations=rotations,
        trans=np.zeros((count, 3)) if trans is None else trans,
        betas=_shape(data, "betas", where),
        bone_lengths=_shape(data, "bone_lengths", where),
        rate=_rate(data, time, where),
        time=time,
        joints=_optional(data, "joints", (count, len(JOINTS), 3), where),
        source=where,
        model=model_of(data),
    )


def _optional(data: dict[str, Any], name: str, shape: tuple[int, ...], where: str) -> np.ndarray | None:
    if name not in data:
        return None
    value = numbers(data[name], name, where)
    if value.shape != shape:
        found, wanted = (" x ".join(map(str, s)) for s in (value.shape, shape))
        raise InputError(f"its '{name}' has shape {found or 'of one number'}, not {wanted}", where, _REMEDY)
    return value


def _shape(data: dict[str, Any], name: str, where: str) -> np.ndarray:
    """One shape for the whole motion; a reconstruction with a shape per frame gives their mean."""
    if name not in data:
        return np.zeros(0)
    value = numbers(data[name], name, where)
    if value.ndim == 2:
        value = value.mean(axis=0)
    if value.ndim != 1 or not np.isfinite(value).all():
        raise InputError(f"its '{name}' is not a list of numbers", where, _REMEDY)
    return value


def _rate(data: dict[str, Any], time: np.ndarray | None, where: str) -> float:
    for name in _RATES:
        if np.size(data.get(name, ())) == 1:
            rate = float(numbers(data[name], name, where).ravel()[0])
            if np.isfinite(rate) and rate > 0:
                _refuse_contradiction(rate, time, where)
                return rate
            raise InputError(f"a frame rate of {rate:g} Hz is not possible", where, "correct its mocap_frame_rate")
    if time is not None and len(time) > 1:
        return float(1 / np.median(np.diff(time)))
    raise InputError("it does not say its frame rate", where, "add 'mocap_frame_rate' in Hz")


def _refuse_contradiction(rate: float, time: np.ndarray | None, where: str) -> None:
    if time is None or len(time) < 3:
        return
    measured = (len(time) - 1) / float(time[-1] - time[0])
    if abs(measured / rate - 1) > 0.02:
        what = f"it says {rate:g} Hz but its times give {measured:.4g} Hz"
        raise InputError(what, where, "correct its mocap_frame_rate or its time")
