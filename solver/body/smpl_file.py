"""A user's own ``SMPL_*.npz`` or ``.pkl`` as plain arrays."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.safe_pickle import Sparse, load_untrusted

SHAPES = 10
"""Shape coefficients that are used; some files carry 300."""

_OTHER_BODIES = {
    52: "an SMPL-H body (52 joints, with fingers)",
    55: "an SMPL-X body (55 joints, with fingers and face)",
}
_OTHER_BODIES |= {16: "a MANO hand", 5: "a FLAME head"}
_REMEDY = "use the SMPL body of 24 joints, for instance SMPL_NEUTRAL.npz or basicmodel_neutral_lbs_10_207_0_v1.1.0.pkl"


def read_smpl_file(path: str | Path) -> dict[str, np.ndarray]:
    """Arrays of an SMPL body, checked against each other; nothing in the file is executed.

    Parameters
    ----------
    path : an ``.npz``, or a ``.pkl`` with numpy, chumpy and scipy arrays, of Python 2 or 3

    Returns
    -------
    dict with ``v_template`` (V, 3) m, y up; ``shapedirs`` (V, 3, S) m per unit, S at most 10; ``J_regressor`` (24, V);
    ``weights`` (V, 24), rows summing to 1; ``f`` (F, 3) vertex indices; ``parents`` (24,), the root's -1; and
    ``posedirs`` (V, 3, 207) m, where the file has them

    Raises
    ------
    InputError
        Where the file cannot be read, lacks an array, is inconsistent, or is another body than SMPL.
    """
    data = load_untrusted(path)
    if not isinstance(data, dict):
        raise InputError("it is not a body model", path, _REMEDY)
    weights = _numbers(data, "weights", path)
    if weights.ndim == 2 and weights.shape[1] != len(JOINTS):
        count = weights.shape[1]
        raise InputError(
            f"it is {_OTHER_BODIES.get(count, f'a body of {count} joints')}, not an SMPL body", path, _REMEDY
        )
    body = {
        "v_template": _numbers(data, "v_template", path),
        "shapedirs": _numbers(data, "shapedirs", path),
        "J_regressor": _numbers(data, "J_regressor", path),
        "weights": weights,
        "f": _indices(data, "f", path),
        "parents": _parents(data, path),
    }
    if "posedirs" in data:
        body["posedirs"] = _numbers(data, "posedirs", path)
    _check_shapes(body, path)
    _check_values(body, path)
    body["shapedirs"] = body["shapedirs"][:, :, :SHAPES].copy()
    body["weights"] = weights / weights.sum(axis=1, keepdims=True)
    return body


def _numbers(data: dict[Any, Any], name: str, path: str | Path) -> np.ndarray:
    if name not in data:
        raise InputError(f"it lacks the array '{name}' of a body model", path, _REMEDY)
    value = data[name].toarray() if isinstance(data[name], Sparse) else data[name]
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "fiu":
        raise InputError(f"its '{name}' is not an array of numbers", path, _REMEDY)
    value = value.astype(float)
    if not np.isfinite(value).all():
        raise InputError(f"its '{name}' holds values that are not finite", path, "get the file again")
    return value


def _indices(data: dict[Any, Any], name: str, path: str | Path) -> np.ndarray:
    return _numbers(data, name, path).astype(np.int64)


def _parents(data: dict[Any, Any], path: str | Path) -> np.ndarray:
    table = _indices(data, "kintree_table", path)
    if table.shape != (2, len(JOINTS)):
        count = table.shape[-1] if table.ndim else 0
        raise InputError(f"its bone tree has {count} joints, not 24", path, _REMEDY)
    parents = table[0].copy()
    parents[0] = -1  # written as 2**32 - 1
    if not np.array_equal(parents, PARENTS):
        raise InputError("its bones are not connected as in SMPL", path, _REMEDY)
    return parents


def _check_shapes(body: dict[str, np.ndarray], path: str | Path) -> None:
    vertices = len(body["weights"])
    expected: dict[str, tuple[int | None, ...]] = {
        "v_template": (vertices, 3),
        "shapedirs": (vertices, 3, None),
        "J_regressor": (len(JOINTS), vertices),
        "weights": (vertices, len(JOINTS)),
        "f": (None, 3),
        "posedirs": (vertices, 3, 9 * (len(JOINTS) - 1)),
    }
    for name, shape in expected.items():
        if name not in body:
            continue
        found = body[name].shape
        fits = len(found) == len(shape) and all(n in (None, m) for n, m in zip(shape, found)) and 0 not in found
        if not fits:
            wanted = " x ".join("any" if n is None else str(n) for n in shape)
            raise InputError(f"its '{name}' has shape {' x '.join(map(str, found))}, not {wanted}", path, _REMEDY)


def _check_values(body: dict[str, np.ndarray], path: str | Path) -> None:
    vertices, faces, weights = body["v_template"], body["f"], body["weights"]
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise InputError("its faces name vertices that it does not have", path, "get the file again")
    if weights.min() < -1e-6 or np.abs(weights.sum(axis=1) - 1).max() > 0.01:
        raise InputError("its skinning weights do not add up to 1", path, "get the file again")
    if np.abs(body["J_regressor"].sum(axis=1) - 1).max() > 0.01:
        raise InputError("its joint regressor's rows do not add up to 1", path, "get the file again")
    height = float(np.ptp(vertices[:, 1]))
    if not 1.0 < height < 2.5:
        raise InputError(
            f"its rest body is {height:.2f} high along y, not a person in metres", path, "convert it to metres, y up"
        )
