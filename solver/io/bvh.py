"""BVH in: any order of channels, positions of any joint."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import UpAxis, lab_rotation
from markerscope.solver.io.motion import SkeletonMotion, euler_matrix
from markerscope.solver.io.text import decode, read_bytes

_MOST_JOINTS = 2000


@dataclass
class _Tree:
    """A hierarchy while it is read; offsets in file units."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[list[float]] = field(default_factory=list)
    ends: list[list[float]] = field(default_factory=list)
    channels: list[list[str]] = field(default_factory=list)


def read_bvh(path: str | Path, *, metres_per_unit: float = 0.01, up: UpAxis = "y") -> SkeletonMotion:
    """Read a BVH file.

    Parameters
    ----------
    path : the file
    metres_per_unit : length of its unit, by custom a centimetre
    up : its vertical axis, by custom y

    Raises
    ------
    InputError : the file cannot be read
    """
    hierarchy, motion, rest = decode(read_bytes(path), path).partition("MOTION")
    try:
        tree = _hierarchy(hierarchy.split())
        words = rest.split()
        if not motion or [w.lower() for w in (words[0], *words[2:4])] != ["frames:", "frame", "time:"]:
            raise ValueError
        count, step = int(words[1]), float(words[4])
        values = np.array(words[5:], dtype=float)
    except (ValueError, IndexError, OverflowError) as error:
        raise InputError("is not a BVH file, or is damaged or cut off", path, "export it again") from error
    width = sum(map(len, tree.channels))
    if not tree.names or not width or not 0 < step < 1e6 or count < 1 or not np.isfinite(values).all():
        raise InputError("is a BVH without motion", path, "export it again")
    if len(values) < count * width:
        raise InputError(f"is cut off after frame {len(values) // width} of {count}", path, "copy or export it again")
    # The frame time is rounded: 0.033333 s means 30 Hz.
    rate = float(np.round(1 / step)) if abs(step * np.round(1 / step) - 1) < 1e-4 else 1 / step
    return _motion(tree, values[: count * width].reshape(count, width), rate, metres_per_unit, up, str(path))


def _hierarchy(words: list[str]) -> _Tree:
    """Parse the part before MOTION. Raises ValueError or IndexError where it is not one."""
    if words[0].upper() != "HIERARCHY":
        raise ValueError
    tree = _Tree()
    stack: list[int] = []  # open joints; an end site stands as -1
    at = 1
    while at < len(words):
        word = words[at].upper()
        if word in ("ROOT", "JOINT"):
            stop = words.index("{", at)
            if (word == "ROOT") != (not tree.names) or len(tree.names) >= _MOST_JOINTS:
                raise ValueError
            tree.names.append(" ".join(words[at + 1 : stop]))
            tree.parents.append(stack[-1] if stack else -1)
            tree.offsets.append([0.0, 0.0, 0.0])
            tree.ends.append([0.0, 0.0, 0.0])
            tree.channels.append([])
            stack.append(len(tree.names) - 1)
            at = stop + 1
        elif word == "END":
            at = words.index("{", at) + 1
            stack.append(-1)
        elif word == "OFFSET":
            offset = [float(w) for w in words[at + 1 : at + 4]]
            (tree.ends if stack[-1] < 0 else tree.offsets)[stack[-1] if stack[-1] >= 0 else stack[-2]] = offset
            at += 4
        elif word == "CHANNELS":
            count = int(words[at + 1])
            channels = [w.lower() for w in words[at + 2 : at + 2 + count]]
            if any(c[1:] not in ("position", "rotation") or c[0] not in "xyz" for c in channels):
                raise ValueError
            tree.channels[stack[-1]] = channels
            at += 2 + count
        elif word == "}":
            stack.pop()
            at += 1
        else:
            raise ValueError(word)
    if stack:
        raise ValueError
    return tree


def _motion(tree: _Tree, values: np.ndarray, rate: float, scale: float, up: UpAxis, source: str) -> SkeletonMotion:
    frames, joints = len(values), len(tree.names)
    offsets = np.array(tree.offsets) * scale
    rotations = np.empty((frames, joints, 3, 3))
    translations = np.broadcast_to(offsets, (frames, joints, 3)).copy()
    column = 0
    for j, channels in enumerate(tree.channels):
        block = values[:, column : column + len(channels)]
        column += len(channels)
        turns = [i for i, channel in enumerate(channels) if channel.endswith("rotation")]
        rotations[:, j] = euler_matrix([channels[i][0] for i in turns], np.radians(block[:, turns]))
        for i, channel in enumerate(channels):
            if channel.endswith("position"):  # a position replaces the offset
                translations[:, j, "xyz".index(channel[0])] = block[:, i] * scale
    R_lab_internal = lab_rotation(up)
    rotations[:, 0] = R_lab_internal.T @ rotations[:, 0]
    translations[:, 0] = translations[:, 0] @ R_lab_internal
    ends = np.array(tree.ends) * scale
    return SkeletonMotion(
        tuple(tree.names), np.array(tree.parents), offsets, ends, rotations, translations, rate, source
    )
