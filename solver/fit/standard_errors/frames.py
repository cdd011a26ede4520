"""How the segments' anatomical frames turn with body shape, joint centres, landmarks and definitions."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from markerscope.resources import resource
from markerscope.solver.angles.angles import AngleSettings, conventions
from markerscope.solver.body.anatomy import segment_frames
from markerscope.solver.body.model import Body

CENTRE_M = 0.006
"""Spread of each coordinate of a joint centre that no shape coefficient reaches. Centres by regression lie 5 to 8 mm
off each way at the hip (Harrington et al. 2007)."""
LANDMARK_M = 0.005
"""The same of a bony landmark of the fitted body."""
_STEP = 1e-20


@dataclass(frozen=True, eq=False)
class SegmentFrames:
    """Anatomical frames of a body at rest, and how they turn.

    Attributes
    ----------
    frames : (3, 3) by segment
    by_shape : (3, S) rad per unit of each shape coefficient, in the rest body's axes, by segment
    by_anatomy : (3, Q) rad per standard deviation of Q coordinates of joint centres and landmarks
    by_definition : (3, 3 N) rad per standard deviation of what a published definition could be instead, of each of the
        N segments by itself
    """

    frames: Mapping[str, np.ndarray]
    by_shape: Mapping[str, np.ndarray]
    by_anatomy: Mapping[str, np.ndarray]
    by_definition: Mapping[str, np.ndarray]


def frames_and_slopes(body: Body, betas: np.ndarray, settings: AngleSettings) -> SegmentFrames:
    """The frames of a shaped body with exact derivatives, by a complex step through their construction.

    Squire and Trapp (1998): a step of 1e-20 along the imaginary axis leaves nothing to cancel.
    """
    told = conventions()[settings.convention]
    how = {name: told[name] for name in ("pelvis", "thorax", "upper_arm", "forearm")}
    rest, dirs, _ = body.landmark_basis()
    points = np.concatenate([body.joints(betas), rest + dirs @ betas])
    count = len(body.joint_template)

    def built(at: np.ndarray) -> dict[str, np.ndarray]:
        return segment_frames(dict(zip(body.landmark_names, at[count:], strict=True)), at[:count], **how)

    frames = built(points)
    slopes = {name: np.zeros((3, points.size)) for name in frames}
    for k in range(points.size):
        step = points.astype(complex)
        step.flat[k] += 1j * _STEP
        for name, moved in built(step).items():
            change = (moved.imag / _STEP) @ frames[name].T
            slopes[name][:, k] = change[2, 1], change[0, 2], change[1, 0]
    by_points = np.concatenate([body.joint_dirs, dirs]).reshape(points.size, -1)
    spread = np.repeat([CENTRE_M, LANDMARK_M], [3 * count, points.size - 3 * count])
    return SegmentFrames(
        frames,
        {name: slope @ by_points for name, slope in slopes.items()},
        {name: slope * spread for name, slope in slopes.items()},
        _by_definition(frames),
    )


def _by_definition(frames: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    found = {name: np.zeros((3, 3 * len(frames))) for name in frames}
    for k, (name, frame) in enumerate(frames.items()):
        found[name][:, 3 * k : 3 * k + 3] = frame * np.radians(definition_spread()[_bare(name)])
    return found


@cache
def definition_spread() -> dict[str, np.ndarray]:
    """Degrees about X, Y, Z of each segment by which published definitions differ, see the table's sources."""
    told = tomllib.loads(resource("definition_spread.toml").read_text(encoding="utf-8"))
    return {name: np.array(row["degrees"], float) for name, row in told.items()}


def _bare(segment: str) -> str:
    return segment.removeprefix("left_").removeprefix("right_")
