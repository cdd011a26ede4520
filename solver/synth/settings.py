"""What a synthetic session is to be like."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal, get_args

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import PARTS

Layout = Literal[
    "uniform",
    "full_body",
    "plug_in_gait",
    "ior",
    "cast",
    "left_arm",
    "left_leg",
    "left_shoulder",
    "right_arm",
    "right_leg",
    "right_shoulder",
]
Shape = Literal["inside", "outside"]


@dataclass(frozen=True)
class SynthSettings:
    """One kind of session. A tuple of these and a seed is a session, number for number.

    Attributes
    ----------
    frames : how many, of markers and video alike
    rate : Hz, of both
    still : the motion about its mean pose, and with it the sliding of skin, scaled by this; None leaves it as it is
    markers : how many, where they are spread at random
    part : which part of the body alone carries markers, one of ``skeleton.PARTS``; None is the whole body
    layout : ``uniform`` spreads them at random, equally over the skin's area; any other name is a set of places as
        laboratories use them, whatever ``markers`` says
    nested : fewer markers are a subset of more; else every number of markers has places of its own
    misplaced_mm : mm along the skin from its place to where each marker of a named layout sits, in any direction
    apart_mm : mm, least distance of two markers that are spread at random
    shape : whether the program's own shape coefficients and bone lengths can reach the body (``inside``) or not
    spread : standard deviation of each shape coefficient
    bones : standard deviation of bone lengths about what the shape says, as a fraction
    bumps : m, height of swellings and hollows of the skin (``outside`` only)
    centres_mm : mm, spread of joint centres about their usual place under the skin (``outside`` only)
    slide : times the usual sliding of skin over bone, some 2 to 6 mm
    jitter_mm : mm, white noise a coordinate
    offset_mm, offset_spread_mm : mm, mean and spread of the height of markers above the skin
    lost : fraction of the samples that is missing, in gaps whose lengths have a heavy tail
    longest_gap : s, of these
    hidden_chance : chance for each marker in each frame to be hidden for the next 10 frames
    gap_statistics : npz file of real gaps, see ``markerscope.solver.cleaning.gap_statistics``
    gap_times : times the frequency of gaps in that file
    ghosts : columns that are no marker: reflections that stand, wander or flicker near the body
    swaps : how often two near markers exchange their columns
    video_noise : times the usual error of the video's poses
    video_bias_deg, video_wander_deg : degrees about each axis, constant and slow part of a joint's usual error
    video_tilt_deg : degrees, spread of the camera's pitch and roll
    video_lost : fraction of the video's frames, in spans, in which the person was not tracked
    video_flips : spans in which the video takes left for right
    video_wrong_shape : the video comes with a shape that is anybody's
    desync_frames : marker frames by which the video's clock is late, which nobody knows
    """

    frames: int = 450
    rate: float = 30.0
    still: float | None = None
    markers: int = 40
    part: str | None = None
    layout: Layout = "uniform"
    nested: bool = True
    misplaced_mm: float = 0.0
    apart_mm: float = 30.0
    shape: Shape = "outside"
    spread: float = 0.8
    bones: float = 0.03
    bumps: float = 0.010
    centres_mm: float = 0.0
    slide: float = 1.0
    jitter_mm: float = 0.4
    offset_mm: float = 9.5
    offset_spread_mm: float = 1.5
    lost: float = 0.0
    longest_gap: float = 2.0
    hidden_chance: float = 0.0
    gap_statistics: Path | None = None
    gap_times: float = 1.0
    ghosts: int = 0
    swaps: int = 0
    video_noise: float = 1.0
    video_bias_deg: float = 4.5
    video_wander_deg: float = 3.4
    video_tilt_deg: float = 5.0
    video_lost: float = 0.0
    video_flips: int = 0
    video_wrong_shape: bool = False
    desync_frames: int = 0

    def __post_init__(self) -> None:
        """Refuse what no session can be."""
        for name, choices in (("part", (None, *PARTS)), ("layout", get_args(Layout)), ("shape", get_args(Shape))):
            if getattr(self, name) not in choices:
                known = ", ".join(str(choice) for choice in choices if choice is not None)
                raise InputError(f'"{getattr(self, name)}" is not known', option(name), f"choose one of {known}")
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, bool) or not isinstance(value, int | float):
                continue
            least, most = _RANGE.get(field.name, (0, _MOST))
            if not (math.isfinite(value) and least <= value <= most):
                limits = f"at least {least:g}" if most == _MOST else f"from {least:g} to {most:g}"
                raise InputError(f"{value:g} is not possible", option(field.name), f"give a number {limits}")
        if self.part is not None and self.layout not in (*_WHOLE, self.part):
            raise InputError(
                f'the layout "{self.layout}" is not on the {self.part.replace("_", " ")}',
                option("part"),
                "leave one of the two out",
            )


_WHOLE = ("uniform", "full_body", "plug_in_gait", "ior", "cast")
"""Layouts that are on no one part of the body."""
_MOST = 1e6
_RANGE: dict[str, tuple[float, float]] = {
    "frames": (2, _MOST),
    "rate": (1, 10_000),
    "markers": (3, 1000),
    "misplaced_mm": (0, 100),
    "apart_mm": (0, 200),
    "spread": (0, 5),
    "bones": (0, 0.2),
    "bumps": (0, 0.05),
    "centres_mm": (0, 30),
    "jitter_mm": (0, 1000),
    "offset_mm": (0, 100),
    "offset_spread_mm": (0, 50),
    "lost": (0, 0.9),
    "longest_gap": (0.01, 1000),
    "hidden_chance": (0, 1),
    "ghosts": (0, 1000),
    "swaps": (0, 10_000),
    "video_noise": (0, 30),
    "video_bias_deg": (0, 180),
    "video_wander_deg": (0, 180),
    "video_tilt_deg": (0, 90),
    "video_lost": (0, 0.9),
    "video_flips": (0, 1000),
    "desync_frames": (-100_000, 100_000),
}
"""Least and most value of a setting; the others run from 0."""


def option(name: str) -> str:
    """The command line's word for a setting."""
    return f"--{name.replace('_', '-')}"
