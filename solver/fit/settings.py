"""What can be set of the default method's three stages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.pull.by_hand import Pair, check_pairs
from markerscope.solver.fit.second.results import LIMBS
from markerscope.solver.fit.state import Weights


def _positive(settings: object, *names: str) -> None:
    """Refuse settings that cannot work."""
    for name in names:
        value = getattr(settings, name)
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{value} is not possible", f"the setting {name}", "give a number above 0")


@dataclass(frozen=True)
class LocalizeSettings:
    """How widely to look for where the markers sit.

    Attributes
    ----------
    yaws : starts of the camera's heading, evenly spread over the circle
    few, many : keyframes of the coarse and of the fine solve
    keep : hypotheses handed on at most; those that are clearly worse than the best are not
    seen_share : share of the frames in which a marker must be seen to be used in the search
    any_orientation : also try lab frames that do not stand upright
    leave_out_still : leave out markers that stand while the others move
    part_of_cloud : which of several clouds of markers is solved, counted from 1, the largest first; None takes the one
        that moves most like the video
    """

    yaws: int = 8
    few: int = 12
    many: int = 40
    keep: int = 160
    seen_share: float = 0.05
    any_orientation: bool = False
    leave_out_still: bool = True
    part_of_cloud: int | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        _positive(self, "yaws", "few", "many", "keep")
        if self.part_of_cloud is not None:
            _positive(self, "part_of_cloud")


@dataclass(frozen=True)
class OrientSettings:
    """How the hypotheses are fitted and compared.

    Attributes
    ----------
    refine : hypotheses refined to the end
    offset_mm, offset_spread_mm : marker centre above the skin; the spread holds what the shapes miss of a real skin
    prior_deg : spread of the video's joint rotations
    bias_deg : spread of what a reconstruction that came without landmarks gets wrong alike in every frame
    focal_guess : focal length as a share of the image's longer side, where no camera is given
    leave_out_far : leave out markers that fit no place on the body, and solve again without them
    """

    refine: int = 4
    offset_mm: float = 9.5
    offset_spread_mm: float = 6.0
    prior_deg: float = 18.0
    bias_deg: float = 15.0
    focal_guess: float = 0.85
    leave_out_far: bool = True

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        _positive(self, "refine", "offset_spread_mm", "prior_deg", "bias_deg", "focal_guess")

    def weights(self) -> Weights:
        """The same as weights of the fit."""
        return Weights(
            offset=self.offset_mm / 1000,
            offset_spread=self.offset_spread_mm / 1000,
            prior_deg=self.prior_deg,
            bias_deg=self.bias_deg,
            focal_guess=self.focal_guess,
        )


@dataclass(frozen=True)
class FitSettings:
    """Which answer goes on to every frame.

    Attributes
    ----------
    candidate : row of the orientation's candidates to use, pinned by hand; None takes the first
    video_share : how much less the video counts than while the markers were being placed: its errors are the same
        frame after frame, so once the markers have their places it only holds what they do not see
    landmark_pull : draw markers to palpable bony landmarks where the layout has ``earned`` it, or ``off``
    pinned : markers by column that sit on a bony landmark, by hand
    refused : pairs that are not to be, by hand; the landmark "" stands for all of them
    second : limbs whose second answer is to be taken, by hand
    """

    candidate: int | None = None
    video_share: float = 0.25
    landmark_pull: Literal["earned", "off"] = "earned"
    pinned: tuple[Pair, ...] = ()
    refused: tuple[Pair, ...] = ()
    second: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        _positive(self, "video_share")
        check_pairs(self.pinned, self.refused)
        for limb in self.second:
            if limb not in LIMBS:
                raise InputError(f'"{limb}" is no limb', "the setting second", f"use some of {', '.join(LIMBS)}")

    def weights(self) -> Weights:
        """The same as weights of the fit."""
        wider = 1 / np.sqrt(self.video_share)
        base = Weights()
        return replace(base, prior_deg=base.prior_deg * wider, root_deg=base.root_deg * wider, image=base.image * wider)
