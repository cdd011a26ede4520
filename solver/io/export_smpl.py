"""Body parameters out as npz in the layout of AMASS."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import atomic_path


def write_smpl_npz(
    path: str | Path,
    poses: np.ndarray,
    trans: np.ndarray,
    betas: np.ndarray,
    rate: float,
    extra: Mapping[str, Any] | None = None,
) -> None:
    """Write body parameters in the layout of AMASS.

    Parameters
    ----------
    path : file to write, whole or not at all
    poses : (T, 72) rad, axis-angle of the 24 joints, the root's in the internal frame (z up)
    trans : (T, 3) m, internal frame
    betas : (S,) shape
    rate : Hz
    extra : further arrays by name

    Raises
    ------
    InputError : the file cannot be written
    """
    arrays: dict[str, Any] = {
        "poses": np.asarray(poses, dtype=float),
        "trans": np.asarray(trans, dtype=float),
        "betas": np.asarray(betas, dtype=float),
        "gender": np.array("neutral"),
        "mocap_frame_rate": np.array(float(rate)),
        **{key: np.asarray(value) for key, value in (extra or {}).items()},
    }
    pickled = [key for key, value in arrays.items() if value.dtype.hasobject]
    if pickled:
        raise InputError(f"{pickled[0]} is no array of numbers or text", path, "write plain arrays only")
    with atomic_path(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
