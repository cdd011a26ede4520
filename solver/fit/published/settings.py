"""Settings of the published method, with the paper's values as defaults."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PAPER_ITERATIONS = 10_000
"""What section 3.6 allows every optimisation."""
STEEPNESS = 1.0
"""Of the confidence over the margin; not calibrated, since the method itself gives none."""

Mesh = Literal["coarse", "full"]
"""Vertices that a marker's nearest one is sought among. The paper's body has 6,890."""


@dataclass(frozen=True)
class PaperLocalizeSettings:
    """Marker-part matching (section 3.4).

    Attributes
    ----------
    rate : Hz that the markers are sampled down to (section 4.1.2)
    shared : a chain is left out if it shares more than this part of its bones with one kept before (section 3.4.2)
    whole_body : part of the body's bounding box that the markers' must exceed for the whole body to be taken instead
        of a chain (from the authors' program)
    search_always : score the chains even where the whole body is taken and they decide nothing
    iterations : at most so many of L-BFGS a chain; the paper allows 10,000
    lr : first step of each line search (section 3.6)
    markers, shape : weights of the one-way Chamfer distance and of the shape (section 3.6, lambda of step 2)
    betas : shape coefficients that are free; the paper's body has 10
    mesh : vertices the nearest one is sought among: the body's coarse mesh, or all of them at ten times the cost
    """

    rate: float = 30.0
    shared: float = 0.9
    whole_body: float = 0.4
    search_always: bool = False
    iterations: int = 100
    lr: float = 1.0
    markers: float = 10.0
    shape: float = 0.1
    betas: int = 10
    mesh: Mesh = "coarse"

    def __post_init__(self) -> None:
        """Refuse what no data can make sense of."""
        _check(iterations=self.iterations, rate=self.rate, betas=self.betas)


@dataclass(frozen=True)
class PaperSolveSettings:
    """Mocap solving (section 3.5), stages 1 to 5.

    Attributes
    ----------
    yaws : evenly spread starts of the root's rotation (stage 1)
    iterations : at most so many of L-BFGS in each stage; the paper allows 10,000, and the tolerances mostly end the
        stages within a few hundred
    pose_lr, marker_lr : first step of each line search in stage 2, and in stages 4 and 5 (section 3.6)
    pose_chamfer, pose_shape, pose_pose : weights of stage 2 (section 3.6)
    marker_marker, marker_shape, marker_pose : weights of stages 4 and 5 (section 3.6)
    offset : m, from a marker to its vertex (equation 8)
    betas : shape coefficients that are free; the paper's body has 10
    mesh : vertices the nearest one is sought among in stage 2; stage 3 always looks at all
    """

    yaws: int = 4
    iterations: int = 400
    pose_lr: float = 0.1
    marker_lr: float = 1.0
    pose_chamfer: float = 10.0
    pose_shape: float = 1.0
    pose_pose: float = 1.0
    marker_marker: float = 1.0
    marker_shape: float = 1.0
    marker_pose: float = 0.1
    offset: float = 0.0095
    betas: int = 10
    mesh: Mesh = "coarse"

    def __post_init__(self) -> None:
        """Refuse what no data can make sense of."""
        _check(yaws=self.yaws, iterations=self.iterations, betas=self.betas)


@dataclass(frozen=True)
class PaperFitSettings:
    """Which answer goes on to every frame.

    Attributes
    ----------
    candidate : row of the orientation's candidates to use, pinned by hand: one of the yaws; None takes the first
    """

    candidate: int | None = None


def _check(**values: float) -> None:
    for name, value in values.items():
        if not value > 0:
            raise ValueError(f"{name} is {value:g} and has to be above 0")
