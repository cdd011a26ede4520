"""Joint angles of the fitted body, in the convention that the user's other programs speak."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Literal

import numpy as np

from markerscope.resources import resource
from markerscope.solver.angles.cardan import TURNS, about_axes, cardan
from markerscope.solver.body.anatomy import SEGMENT_JOINT, segment_frames
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.markers import lab_rotation
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS

Convention = Literal["opensim", "opensim-xzy", "isb", "isb-xzy", "gait2392", "visual3d", "plugin-gait"]

_PAIRS = {
    "pelvis": ("", "pelvis"),
    "hip": ("pelvis", "thigh"),
    "knee": ("thigh", "shank"),
    "ankle": ("shank", "foot"),
    "trunk": ("pelvis", "thorax"),
    "shoulder": ("thorax", "upper_arm"),
    "elbow": ("upper_arm", "forearm"),
    "wrist": ("forearm", "hand"),
}
"""Proximal and distal segment of each joint; the pelvis is read in the lab."""
_MIDLINE = ("", "pelvis", "thorax")
_MIRROR = np.array([1.0, 1, -1])
_CARRIERS = {
    "pelvis": ("pelvis",),
    # The shoulder girdle and the lower ribs ride on the thorax nearly rigidly.
    "thorax": ("spine3", "spine2", "left_collar", "right_collar"),
    **{
        f"{side}_{segment}": tuple(f"{side}_{joint}" for joint in joints)
        for side in ("left", "right")
        for segment, joints in {
            "thigh": ("hip",),
            "shank": ("knee",),
            "foot": ("ankle", "foot"),
            "upper_arm": ("shoulder",),
            "forearm": ("elbow",),
            "hand": ("wrist", "hand"),
        }.items()
    },
}
"""The bones on which a marker shows how a segment moves."""


@dataclass(frozen=True)
class AngleSettings:
    """How angles are read off.

    Attributes
    ----------
    convention : names, sequences and signs
    """

    convention: Convention = "opensim"


@cache
def conventions() -> dict[str, Any]:
    """Every convention, as ``resources/angle_conventions.toml`` has it, with what it takes over from another."""
    told = tomllib.loads(resource("angle_conventions.toml").read_text(encoding="utf-8"))
    return {name: _completed(row, told) for name, row in told.items()}


def _completed(row: Mapping[str, Any], told: Mapping[str, Any]) -> dict[str, Any]:
    """A convention with what it does not say itself as the one has it that it is ``like``."""
    if "like" not in row:
        return dict(row)
    other = told[row["like"]]
    kept = {name: value for name, value in other.items() if name != "second"}
    return {**kept, **row, "joints": {**other["joints"], **row["joints"]}}


def joint_angles(
    time: np.ndarray,
    rotations: np.ndarray,
    landmarks: Mapping[str, np.ndarray],
    joints: np.ndarray,
    settings: AngleSettings,
) -> JointAngles:
    """Angles of a posed body.

    Parameters
    ----------
    time : (T,) s
    rotations : (T, 24, 3, 3) root in the internal lab frame, others relative to the parent
    landmarks, joints : of the shaped body at rest, m
    settings : which convention
    """
    convention = conventions()[settings.convention]
    frames = segment_frames(
        landmarks,
        joints,
        **{name: convention[name] for name in ("pelvis", "thorax", "upper_arm", "forearm")},
    )
    turn = world_rotations(rotations)
    segments = {name: turn[:, INDEX[SEGMENT_JOINT[name]]] @ frame for name, frame in frames.items()}
    return read_angles(time, segments, settings)


def read_angles(time: np.ndarray, segments: Mapping[str, np.ndarray], settings: AngleSettings) -> JointAngles:
    """Angles between anatomical segment frames, wherever these come from.

    Parameters
    ----------
    time : (T,) s
    segments : (T, 3, 3) frame of each segment in the internal lab, named as in ``SEGMENT_JOINT``; columns X anterior,
        Y proximal, Z to the right
    settings : which convention
    """
    convention = conventions()[settings.convention]
    lab = lab_axes(segments["pelvis"], convention["lab"] == "quarter turns")
    columns = list(columns_of(settings.convention))
    values, flags = np.zeros((2, len(time), len(columns)))
    for i, column in enumerate(columns):
        near = segments[column.near] if column.near else lab
        relative = np.swapaxes(near, -1, -2) @ segments[column.far]
        if column.mirrored:
            relative = _MIRROR[:, None] * relative * _MIRROR
        angles, singular = (
            cardan(relative, column.sequence, column.ranges)
            if column.axes is None
            else about_axes(relative, column.axes)
        )
        values[:, i], flags[:, i] = column.sign * angles[:, column.place], singular[:, column.place]
    return JointAngles(
        time=time,
        names=tuple(column.name for column in columns),
        degrees=values,
        singular=flags.astype(bool),
        convention=settings.convention,
        title=convention["title"],
        sequence=tuple(column.sequence for column in columns),
        positive=tuple(column.positive for column in columns),
        zero_pose=convention["zero_pose"],
        hint=_other_order(flags.astype(bool), columns, segments, convention),
    )


def _other_order(
    flags: np.ndarray, columns: list[Column], segments: Mapping[str, np.ndarray], convention: Mapping[str, Any]
) -> str:
    """Which convention to take where an arm passes through the singularity of this one's sequence; "" for none.

    Parameters
    ----------
    flags : (T, A) True where an angle cannot be told
    columns : the A angles
    """
    arms = [i for i, column in enumerate(columns) if column.far.endswith("upper_arm")]
    lost = int(flags[:, arms].any(axis=1).sum()) if arms else 0
    if not lost or "second" not in convention:
        return ""
    second: Convention = convention["second"]
    other = read_angles(np.zeros(len(flags)), segments, AngleSettings(second))
    theirs = [i for i, column in enumerate(columns_of(second)) if column.far.endswith("upper_arm")]
    left = int(other.singular[:, theirs].any(axis=1).sum())
    if left >= lost:
        return ""
    sequence = {columns[i].sequence for i in arms}.pop()
    return (
        f"The shoulder's sequence {sequence} is singular in {lost} of {len(flags)} frames, where its first and last "
        f"angle are left empty; the convention {second} reads the shoulder as {other.sequence[theirs[0]]} and leaves "
        f"{left if left else 'none'} empty."
    )


def relative_to(angles: JointAngles, neutral: JointAngles, where: str, same_heading: bool) -> JointAngles:
    """Angles less those of a neutral pose.

    An angle that the sequence cannot tell in the neutral pose keeps the convention's zero, and so does the pelvis' turn
    about the vertical where the neutral pose may face anywhere.

    Parameters
    ----------
    neutral : of one frame, in the same convention
    where : what the neutral pose was read off, in words
    same_heading : whether the neutral pose's heading in the lab is one of the movement's
    """
    offset = np.where(neutral.singular[0], 0.0, neutral.degrees[0])
    if not same_heading:
        offset[[not column.near and column.axis == "Y" for column in columns_of(angles.convention)]] = 0.0
    said = f"The pose of {where}. Beneath it, the convention's own zero: {angles.zero_pose}"
    return replace(
        angles,
        degrees=angles.degrees - offset,
        zero_pose=said,
        neutral=offset,
        zero="neutral",
        neutral_pose=where,
        recorded_zero_pose=angles.zero_pose,
    )


def evidence(convention: str, marker_joint: np.ndarray) -> dict[str, str]:
    """What each angle of a convention rests on, by column name.

    "markers": both segments carry some (the pelvis in the lab: it does); "one segment": one of the two does; "video
    only": neither, so that the angle is the video's guess, bent by the markers on other segments.

    Parameters
    ----------
    marker_joint : (M,) index of the joint whose bone each marker sits on, -1 for none
    """
    marked = {JOINTS[j] for j in np.unique(marker_joint) if j >= 0}
    words = {0: "video only", 1: "one segment", 2: "markers"}
    found = {}
    for column in columns_of(convention):
        shown = [bool(marked & set(_CARRIERS[name])) for name in (column.near or column.far, column.far)]
        found[column.name] = words[sum(shown)]
    return found


@dataclass(frozen=True)
class Column:
    """One angle of a convention: rotation ``place`` of the sequence between two segments, or about given axes."""

    name: str
    near: str
    far: str
    mirrored: bool
    sequence: str
    axes: np.ndarray | None
    place: int
    sign: int
    positive: str
    ranges: np.ndarray

    @property
    def axis(self) -> str:
        """The axis that the angle turns about, "" where it has one of its own."""
        return self.sequence[self.place] if self.axes is None else ""


def columns_of(convention: str) -> Iterator[Column]:
    """Every angle of a convention, in the order of the files."""
    about = conventions()[convention]
    for joint, row in about["joints"].items():
        axes = np.array(row["axes"]) if "axes" in row else None
        two_sided = any("{" in column for column in row["columns"])
        for side in ("right", "left") if two_sided else ("",):
            near, far = (part if part in _MIDLINE else f"{side}_{part}" for part in _PAIRS[joint])
            for place, column in enumerate(row["columns"]):
                if column:
                    yield Column(
                        name=column.format(s=side[:1], S=side[:1].upper()),
                        near=near,
                        far=far,
                        mirrored=side == "left" and about["mirror"],
                        sequence=row["sequence"] if axes is None else f"about {np.round(axes, 3).tolist()}",
                        axes=axes,
                        place=place,
                        sign=row["signs"][place],
                        positive=row["positive"][place],
                        ranges=_ranges(row, side == "left" and not about["mirror"])
                        if axes is None
                        else np.zeros((0, 2)),
                    )


def _ranges(row: Mapping[str, Any], flipped: bool) -> np.ndarray:
    """(3, 2) degrees, what each turn of a joint's sequence can be, before its sign.

    Parameters
    ----------
    row : of the joint: ``range`` is as its columns are read on the right, an empty one counts turns
    flipped : for a left side that is not mirrored before it is read
    """
    ranges = np.array([sorted(sign * end for end in ends) or TURNS for sign, ends in zip(row["signs"], row["range"])])
    if flipped:  # turns about X and Y change their sense in the mirror, turns about Z do not
        for k, axis in enumerate(row["sequence"]):
            if axis != "Z":
                ranges[k] = -ranges[k, ::-1]
    return ranges


def lab_axes(pelvis: np.ndarray, quarter_turns: bool) -> np.ndarray:
    """(3, 3) the lab's axes in the internal frame: X along the internal x, Y up, Z to the right of X.

    Parameters
    ----------
    pelvis : (T, 3, 3) the pelvis' frame in the internal lab
    quarter_turns : turn X to whichever of the four horizontal directions the pelvis faces most
    """
    lab = lab_rotation("y").T
    if not quarter_turns:
        return lab
    ahead = pelvis[:, :, 0].mean(axis=0)
    quarters = np.round(np.arctan2(ahead[1], ahead[0]) / (np.pi / 2))
    return exp_so3(np.array([0, 0, quarters * np.pi / 2])) @ lab


def world_rotations(rotations: np.ndarray) -> np.ndarray:
    """(T, 24, 3, 3) rotation of every joint in the lab, from parent-relative ones."""
    turn = rotations.copy()
    for j in range(1, rotations.shape[1]):
        turn[:, j] = turn[:, PARENTS[j]] @ rotations[:, j]
    return turn
