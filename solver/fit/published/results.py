"""What the published method leaves behind, stage by stage: everything that can be inspected, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.published.settings import PaperSolveSettings


@dataclass(frozen=True, eq=False)
class Trace:
    """Some of the iterations of one optimisation: the first, then ever further apart, and the last.

    Attributes
    ----------
    iteration : (n,) which ones
    energy : (n,) weighted sum
    frames : (k,) which of the N frames the poses below are of
    rotation_vectors : (n, k, 24, 3) rad, float32; root in the lab, others relative to the parent
    trans : (n, k, 3) m, float32
    betas : (n, S)
    """

    iteration: np.ndarray
    energy: np.ndarray
    frames: np.ndarray
    rotation_vectors: np.ndarray
    trans: np.ndarray
    betas: np.ndarray


@dataclass(frozen=True, eq=False)
class Descent:
    """How one optimisation ended.

    Attributes
    ----------
    energies : weighted terms at the end
    iterations, evaluations : of L-BFGS, and of the energy
    converged : True if a tolerance ended it, False if the cap on iterations did
    trace : thinned
    """

    energies: dict[str, float]
    iterations: int
    evaluations: int
    converged: bool
    trace: Trace

    @property
    def energy(self) -> float:
        """Weighted sum of the terms."""
        return sum(self.energies.values())


@dataclass(frozen=True, eq=False)
class BodyState:
    """The body in the N frames.

    Attributes
    ----------
    rotations : (N, 24, 3, 3) root in the lab, others relative to the parent
    trans : (N, 3) m
    betas : (S,) free shape coefficients; the body's further ones are zero
    """

    rotations: np.ndarray
    trans: np.ndarray
    betas: np.ndarray


@dataclass(frozen=True, eq=False)
class ChainFit:
    """One candidate chain, laid over the markers (section 3.4.2).

    Attributes
    ----------
    bones : (K,) its bones, ascending
    yaw_deg : the one global yaw it ended at
    trans : (N, 3) m
    betas : (S,)
    chamfer : m^2, two-way Chamfer distance: the winner has the least
    one_way : m^2, from the markers to the chain alone
    descent : E_S (equations 1 and 2) and how it was minimised
    """

    bones: np.ndarray
    yaw_deg: float
    trans: np.ndarray
    betas: np.ndarray
    chamfer: float
    one_way: float
    descent: Descent


@dataclass(frozen=True, eq=False)
class PaperLocalization:
    """Which part of the body carries the markers, and where stage 1 starts from.

    Attributes
    ----------
    markers : (U,) markers in use
    frames : (N,) frames in use, about 30 a second
    groups : K, how many rigid groups the markers form
    chains : how many connected subtrees of K bones there are
    pruned : those of them that were kept, (C, K) bones
    candidates : the kept ones, fitted, in the same order; empty if they were not searched
    chosen : row of the winner; -1 if the whole body was taken
    box : the markers' bounding box as a part of the body's, median over the frames
    yaw_deg, trans, betas : where stage 1 starts: degrees, (N, 3) m, (S,)
    """

    markers: np.ndarray
    frames: np.ndarray
    groups: int
    chains: int
    pruned: np.ndarray
    candidates: tuple[ChainFit, ...]
    chosen: int
    box: float
    yaw_deg: float
    trans: np.ndarray
    betas: np.ndarray

    @property
    def whole_body(self) -> bool:
        """Whether the chains decided nothing."""
        return self.chosen < 0


@dataclass(frozen=True, eq=False)
class FitStage:
    """Stage 2, 4 or 5: the body it ended with, and how."""

    body: BodyState
    descent: Descent


@dataclass(frozen=True, eq=False)
class YawFit:
    """Stages 2 to 4 from one yaw.

    Attributes
    ----------
    start_deg : yaw added to the localization's
    pose : stage 2
    vertex : (U,) of each marker, stage 3
    markers : stage 4
    one_way : m^2, one-way Chamfer distance after stage 4: the best yaw has the least (equation 3)
    """

    start_deg: float
    pose: FitStage
    vertex: np.ndarray
    markers: FitStage
    one_way: float


@dataclass(frozen=True, eq=False)
class PaperSolve:
    """The solved sequence.

    Attributes
    ----------
    yaws : every start, in the order of their angles
    chosen : row of the best
    vertex : (U,) of each marker, the repeated stage 3
    refined : stage 5
    settings : that it was solved with
    """

    yaws: tuple[YawFit, ...]
    chosen: int
    vertex: np.ndarray
    refined: FitStage
    settings: PaperSolveSettings
