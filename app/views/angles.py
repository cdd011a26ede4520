"""Joint angles as curves, left beside right, joint by joint."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.app.views.colours import RGB
from markerscope.solver.angles.angles import conventions, evidence
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.skeleton import JOINTS
from markerscope.widgets import palette
from markerscope.widgets.plots.angle_data import AngleCurve, AnglePlot

Side = Literal["left", "right", ""]
_LONG = {
    "flex": "flexion",
    "add": "adduction",
    "rot": "rotation",
    "dev": "deviation",
    "pro": "pronation",
    "sup": "supination",
}
_JOINTS = {
    "pelvis": "pelvis", "spine1": "trunk", "spine2": "trunk", "spine3": "trunk", "hip": "hip", "knee": "knee",
    "ankle": "ankle", "foot": "ankle", "collar": "shoulder", "shoulder": "shoulder", "elbow": "elbow",
    "wrist": "wrist", "hand": "wrist",
}  # fmt: skip
"""The joint of the conventions that each of the body's joints belongs to."""
_COLOURS: dict[Side, RGB] = {"left": palette.LEFT, "right": palette.RIGHT, "": (90, 90, 95)}


@dataclass(frozen=True, eq=False)
class AnglesPicture:
    """All angles of one convention.

    Attributes
    ----------
    time : (T,) s, marker clock
    plots : joint by joint
    convention : its title
    zero_pose : what the angles are counted from
    """

    time: np.ndarray
    plots: tuple[AnglePlot, ...]
    convention: str
    zero_pose: str

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints in their order."""
        return tuple(dict.fromkeys(plot.joint for plot in self.plots))

    def values_at(self, time: float) -> dict[str, float]:
        """Degrees by column name in the frame nearest to a time; NaN where the angle means nothing."""
        frame = int(np.abs(self.time - time).argmin())
        return {curve.name: float(curve.degrees[frame]) for plot in self.plots for curve in plot.curves}


def angles_picture(
    angles: JointAngles,
    marker_joint: np.ndarray | None = None,
    reference: JointAngles | None = None,
    errors: AngleErrors | None = None,
) -> AnglesPicture:
    """The curves of a result.

    Parameters
    ----------
    marker_joint : (M,) bone of each marker, -1 for none, to say what each angle rests on
    errors : standard errors of these angles, drawn as bands where they are of the same convention and frames
    reference : another result in the same convention to compare with; of another, nothing is compared
    """
    column = {name: i for i, name in enumerate(angles.names)}
    grounds = {} if marker_joint is None else evidence(angles.convention, marker_joint)
    other = reference if reference is not None and reference.convention == angles.convention else None
    fits = errors is not None and errors.names == angles.names and errors.shape.shape == angles.degrees.shape
    known = errors if fits else None
    plots = []
    for joint, row in conventions()[angles.convention]["joints"].items():
        for pattern in row["columns"]:
            names = _sides(pattern)
            curves = tuple(
                _curve(angles, column[name], side, grounds.get(name, ""), other, known)
                for side, name in names.items()
                if name in column
            )
            if curves:
                plots.append(AnglePlot(joint, title_of(pattern), curves))
    return AnglesPicture(angles.time, tuple(plots), angles.title, angles.zero_pose)


def joint_of(bone: int | None) -> str | None:
    """The joint, as the conventions call it, that a bone turns about; None for a bone whose joint they leave out."""
    if bone is None or not 0 <= bone < len(JOINTS):
        return None
    name = JOINTS[bone].removeprefix("left_").removeprefix("right_")
    return _JOINTS.get(name)


def bones_of(joint: str) -> list[int]:
    """The bones, of both sides, that turn about a joint."""
    return [bone for bone in range(len(JOINTS)) if joint_of(bone) == joint]


def title_of(pattern: str) -> str:
    """What a column is of, in words: "hip_flexion_{s}" is "Hip flexion", "{S}HipAnglesX" is "Hip angles X"."""
    words = re.sub(r"_?\{[sS]\}_?", "", pattern)
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", words)
    parts = [part if len(part) == 1 else _LONG.get(part, part.lower()) for part in words.split("_") if part]
    return " ".join([parts[0].capitalize(), *parts[1:]]) if parts else ""


def _sides(pattern: str) -> dict[Side, str]:
    if not pattern:
        return {}
    if "{" not in pattern:
        return {"": pattern}
    return {"left": pattern.format(s="l", S="L"), "right": pattern.format(s="r", S="R")}


def _curve(
    angles: JointAngles,
    i: int,
    side: Side,
    rests_on: str,
    other: JointAngles | None,
    errors: AngleErrors | None,
) -> AngleCurve:
    name = angles.names[i]
    compared = None
    if other is not None and name in other.names:
        k = other.names.index(name)
        known = ~other.singular[:, k]
        if known.any():
            # Interpolated between its frames, and unknown where it has none.
            compared = np.interp(angles.time, other.time[known], other.degrees[known, k], left=np.nan, right=np.nan)
    return AngleCurve(
        name=name,
        side=side,
        degrees=np.where(angles.singular[:, i], np.nan, angles.degrees[:, i]),
        reference=compared,
        positive=angles.positive[i],
        rests_on=rests_on,
        colour=_COLOURS[side],
        error=None if errors is None else errors.total[:, i].astype(float),
    )
