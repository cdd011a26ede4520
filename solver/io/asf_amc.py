"""Acclaim motion in: a skeleton (ASF) and its motion (AMC)."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import UpAxis, lab_rotation
from markerscope.solver.io.motion import SkeletonMotion, euler_matrix
from markerscope.solver.io.text import decode, read_bytes, split_lines

_INCH = 0.0254
_DOF = {"tx", "ty", "tz", "rx", "ry", "rz", "l"}


@dataclass
class _Bone:
    """One bone: its direction and length at rest, its own axes, and the values that a frame gives for it."""

    name: str = ""
    direction: np.ndarray = field(default_factory=lambda: np.zeros(3))
    length: float = 0.0
    axis: np.ndarray = field(default_factory=lambda: np.zeros(3))
    axis_order: str = "xyz"
    dof: list[str] = field(default_factory=list)


@dataclass
class _Skeleton:
    """An ASF file: bones in the order of the tree, the root first; lengths in file units, angles in rad."""

    bones: list[_Bone]
    parents: list[int]
    position: np.ndarray
    metres_per_unit: float


def read_asf_amc(asf: str | Path, amc: str | Path, *, rate: float = 120.0, up: UpAxis = "y") -> SkeletonMotion:
    """Read an Acclaim skeleton and motion.

    A joint stands for the bone that begins there; ``ends`` is where the bone ends.

    Parameters
    ----------
    asf, amc : the two files
    rate : Hz, which the files do not say
    up : vertical axis of the files, by custom y

    Raises
    ------
    InputError : a file cannot be read, or the motion is of another skeleton
    """
    try:
        skeleton = _skeleton(_lines(asf))
    except (ValueError, IndexError, KeyError, ArithmeticError) as error:
        raise InputError("is not an ASF skeleton, or is damaged or cut off", asf, "copy it again") from error
    try:
        frames = _frames(_lines(amc), skeleton)
    except (ValueError, IndexError, KeyError) as error:
        what = "is not an AMC motion of that skeleton, or is damaged or cut off"
        raise InputError(
            what, amc, f"copy it again, or give the skeleton that belongs to it instead of {asf}"
        ) from error
    scale = skeleton.metres_per_unit
    count = len(frames)
    rotations = np.empty((count, len(skeleton.bones), 3, 3))
    offsets = np.zeros((len(skeleton.bones), 3))
    column = 0
    for j, bone in enumerate(skeleton.bones):
        values = frames[:, column : column + len(bone.dof)]
        column += len(bone.dof)
        turns = [i for i, dof in enumerate(bone.dof) if dof[0] == "r"]
        # Listed first is turned first, so that it stands rightmost in the product.
        motion = euler_matrix([bone.dof[i][1] for i in turns[::-1]], values[:, turns[::-1]])
        axes = euler_matrix(bone.axis_order[::-1], bone.axis[["xyz".index(a) for a in bone.axis_order[::-1]]])
        rotations[:, j] = axes @ motion @ axes.T
        parent = skeleton.parents[j]
        if parent >= 0:
            offsets[j] = skeleton.bones[parent].direction * skeleton.bones[parent].length * scale
        else:
            moves = {dof[1]: values[:, i] for i, dof in enumerate(bone.dof) if dof[0] == "t"}
            place = np.stack([moves.get(axis, np.zeros(count)) for axis in "xyz"], axis=1) + skeleton.position
    ends = np.array([bone.direction * bone.length for bone in skeleton.bones]) * scale
    translations = np.broadcast_to(offsets, (count, *offsets.shape)).copy()
    R_lab_internal = lab_rotation(up)
    translations[:, 0] = place * scale @ R_lab_internal
    rotations[:, 0] = R_lab_internal.T @ rotations[:, 0]
    names = tuple(bone.name for bone in skeleton.bones)
    return SkeletonMotion(names, np.array(skeleton.parents), offsets, ends, rotations, translations, rate, str(amc))


def _lines(path: str | Path) -> list[list[str]]:
    """Words of each line that says something."""
    lines = (line.split() for line in split_lines(decode(read_bytes(path), path)))
    return [words for words in lines if words and not words[0].startswith("#")]


def _skeleton(lines: list[list[str]]) -> _Skeleton:
    """Parse an ASF. Raises ValueError, IndexError or KeyError where it is not one."""
    sections: dict[str, list[list[str]]] = {}
    section: list[list[str]] = []
    for words in lines:
        if words[0].startswith(":"):
            section = sections.setdefault(words[0].lower(), [])
        else:
            section.append(words)
    units = {words[0].lower(): words[1] for words in sections[":units"]}
    to_rad = np.pi / 180 if units.get("angle", "deg").startswith("deg") else 1.0
    header = {words[0].lower(): words[1:] for words in sections[":root"]}
    root = _Bone("root", axis=np.array(header["orientation"][:3], dtype=float) * to_rad)
    root.axis_order = header["axis"][0].lower()
    root.dof = [word.lower() for word in header["order"]]
    bones: dict[str, _Bone] = {"root": root}
    bone = _Bone()
    for words in sections[":bonedata"]:
        key = words[0].lower()
        if key == "begin":
            bone = _Bone()
        elif key == "name":
            bone.name = words[1]
        elif key == "direction":
            bone.direction = np.array(words[1:4], dtype=float)
        elif key == "length":
            bone.length = float(words[1])
        elif key == "axis":
            bone.axis = np.array(words[1:4], dtype=float) * to_rad
            bone.axis_order = words[4].lower() if len(words) > 4 else "xyz"
        elif key == "dof":
            bone.dof = [word.lower() for word in words[1:]]
        elif key == "end":
            bones[bone.name] = bone
    if any(sorted(bone.axis_order) != ["x", "y", "z"] for bone in bones.values()):
        raise ValueError("axis order")
    if any(not _DOF.issuperset(bone.dof) for bone in bones.values()):
        raise ValueError("degrees of freedom")
    names, parents = _tree(sections[":hierarchy"])
    scale = _INCH / float(units.get("length", 1))
    position = np.array(header["position"][:3], dtype=float)
    vectors = [position, *(v for bone in bones.values() for v in (bone.direction, bone.axis))]
    if any(v.shape != (3,) for v in vectors):
        raise ValueError("not three numbers")
    if not np.isfinite([scale, *np.concatenate(vectors), *(bone.length for bone in bones.values())]).all():
        raise ValueError("not a number")
    return _Skeleton([bones[name] for name in names], parents, position, scale)


def _tree(lines: list[list[str]]) -> tuple[list[str], list[int]]:
    """Bone names and parents, parents first."""
    names, parents = ["root"], [-1]
    for words in lines:
        if words[0].lower() in ("begin", "end"):
            continue
        parent = names.index(words[0])
        for name in words[1:]:
            if name in names:
                raise ValueError(name)
            names.append(name)
            parents.append(parent)
    return names, parents


def _frames(lines: list[list[str]], skeleton: _Skeleton) -> np.ndarray:
    """(T, values) of an AMC in the order of the skeleton's bones; angles in rad."""
    to_rad = 1.0 if any(words[0].lower() == ":radians" for words in lines) else np.pi / 180
    starts = [i for i, words in enumerate(lines) if len(words) == 1 and words[0].isdecimal()]
    if not starts:
        raise ValueError("no frames")
    moving = [bone for bone in skeleton.bones if bone.dof]
    table = []
    for start, stop in zip(starts, [*starts[1:], len(lines)]):
        found = {words[0]: words[1:] for words in lines[start + 1 : stop]}
        row: list[float] = []
        for bone in moving:
            values = found[bone.name]
            if len(values) != len(bone.dof):
                raise ValueError(bone.name)
            row += [float(v) * (to_rad if dof[0] == "r" else 1.0) for v, dof in zip(values, bone.dof)]
        table.append(row)
    frames = np.array(table)
    if not np.isfinite(frames).all():
        raise ValueError("not a number")
    return frames
