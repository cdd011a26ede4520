"""A skeleton and its motion out as BVH."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from markerscope.solver.core.markers import lab_rotation
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.labels import unique
from markerscope.solver.io.number_text import number_lines

_CHANNELS = "Zrotation Xrotation Yrotation"
_END_SITE_CM = 5.0


def write_bvh(
    path: str | Path,
    joint_names: Sequence[str],
    parents: Sequence[int] | np.ndarray,
    offsets: np.ndarray,
    rotations: np.ndarray,
    root_translation: np.ndarray,
    rate: float,
) -> None:
    """Write a skeleton and its motion as BVH: y up, centimetres, rotations Z X Y.

    Parameters
    ----------
    path : file to write, whole or not at all
    joint_names : J names; made unique, blanks become underscores
    parents : (J,) index of each joint's parent, smaller than its own; the first joint is the root, -1
    offsets : (J, 3) m, rest position of each joint in its parent's frame, in the rest body's axes (y up); the
        root's is not used, its place is in ``root_translation``
    rotations : (T, J, 3, 3), the root's turns the rest body into the internal frame (z up), the others are relative
        to their parents
    root_translation : (T, 3) m, where the root joint is, internal frame
    rate : Hz

    Raises
    ------
    InputError : the file cannot be written
    """
    names = unique(joint_names, clean=lambda name: re.sub(r"[\s{}\x00-\x1f\x7f]+", "_", name.strip()))
    order = list(_depth_first(list(map(int, parents))))
    R_file_internal = lab_rotation("y")
    local = np.array(rotations, dtype=float)
    local[:, 0] = R_file_internal @ local[:, 0]
    angles = np.degrees(_euler_zxy(local))[:, order].reshape(len(local), -1)
    place = np.asarray(root_translation, dtype=float) @ R_file_internal.T * 100
    head = ["HIERARCHY", *_hierarchy(names, list(map(int, parents)), np.asarray(offsets, dtype=float) * 100)]
    head += ["MOTION", f"Frames: {len(local)}", f"Frame Time: {1 / rate:.9f}"]
    rows = number_lines(np.hstack([place, angles]), "%.6f", " ")
    write_text_atomic(path, "\n".join(head + rows) + "\n")


def _depth_first(parents: Sequence[int], joint: int = 0) -> list[int]:
    """Joints in the order in which a BVH lists them."""
    return [joint, *(j for k, p in enumerate(parents) if p == joint for j in _depth_first(parents, k))]


def _hierarchy(
    names: Sequence[str], parents: Sequence[int], offsets: np.ndarray, joint: int = 0, depth: int = 0
) -> list[str]:
    """Lines of the joint and all below it; offsets in cm."""
    pad, inner = "  " * depth, "  " * (depth + 1)
    offset = np.zeros(3) if depth == 0 else offsets[joint]
    lines = [
        f"{pad}{'JOINT' if depth else 'ROOT'} {names[joint]}",
        f"{pad}{{",
        f"{inner}OFFSET {_three(offset)}",
        f"{inner}CHANNELS {'3' if depth else '6 Xposition Yposition Zposition'} {_CHANNELS}",
    ]
    children = [k for k, p in enumerate(parents) if p == joint]
    for child in children:
        lines += _hierarchy(names, parents, offsets, child, depth + 1)
    if not children:
        length = float(np.linalg.norm(offset))
        end = offset / length * _END_SITE_CM if length > 0 else np.array([0, _END_SITE_CM, 0])
        lines += [f"{inner}End Site", f"{inner}{{", f"{inner}  OFFSET {_three(end)}", f"{inner}}}"]
    return [*lines, f"{pad}}}"]


def _three(vector: np.ndarray) -> str:
    return " ".join(f"{value:.6f}" for value in vector)


def _euler_zxy(rotations: np.ndarray) -> np.ndarray:
    """Angles (..., 3) rad of ``R = Rz Rx Ry``, in that order; continuous where the middle one is below 90 degrees."""
    x = np.arcsin(np.clip(rotations[..., 2, 1], -1, 1))
    z = np.arctan2(-rotations[..., 0, 1], rotations[..., 1, 1])
    y = np.arctan2(-rotations[..., 2, 0], rotations[..., 2, 2])
    # At 90 degrees only the sum or difference of the others is defined: all of it goes to z.
    locked = np.abs(rotations[..., 2, 1]) > 1 - 1e-12
    z = np.where(locked, np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0]), z)
    return np.stack([z, x, np.where(locked, 0.0, y)], axis=-1)
