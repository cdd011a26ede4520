"""What the solve stages leave behind: everything a view can draw, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from markerscope.solver.core.camera import CameraResult
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.pull.results import LandmarkPull
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.second.results import LimbAnswer
from markerscope.solver.fit.state import Surface, Weights, no_bias


def _no_markers() -> np.ndarray:
    return np.zeros(0, dtype=int)


@dataclass(frozen=True)
class Localization:
    """Where the markers may sit, before any pose is changed.

    Attributes
    ----------
    markers : (U,) index of the markers in use; others were left out or seen too rarely
    few, many : keyframes (frame numbers) of the coarse and the fine solve
    vertex : (H, U) vertex of each marker in each hypothesis, cheapest first
    bone : (H, U) bone that vertex follows most
    R_lab_cam : (H, 3, 3) camera to lab
    trans : (H, N, 3) m, shift of the video's body in each of the few keyframes
    cost_mm : (H,) root mean square distance of the markers to their vertices
    start : where each hypothesis was started: a bone, or "whole body"
    yaw_deg : (H,) the yaw it was started from
    still : columns of markers that were left out because they stand while the others move
    cloud : (M,) number of the cloud that each marker belongs to, 0 the largest; -1 for none
    taken : number of the cloud that is solved; the markers of the others were left out
    """

    markers: np.ndarray
    few: np.ndarray
    many: np.ndarray
    vertex: np.ndarray
    bone: np.ndarray
    R_lab_cam: np.ndarray
    trans: np.ndarray
    cost_mm: np.ndarray
    start: tuple[str, ...]
    yaw_deg: np.ndarray
    still: np.ndarray = field(default_factory=_no_markers)
    cloud: np.ndarray = field(default_factory=_no_markers)
    taken: int = 0


@dataclass(frozen=True, eq=False)
class Steps:
    """The body after each step of a descent, in the few keyframes.

    Attributes
    ----------
    rotation_vectors : (n, N, 24, 3) rad, float32; root in the lab, others relative to the parent
    trans : (n, N, 3) m, float32
    betas : (n, S)
    """

    rotation_vectors: np.ndarray
    trans: np.ndarray
    betas: np.ndarray


@dataclass(frozen=True)
class Candidate:
    """A hypothesis after bundle adjustment.

    Attributes
    ----------
    hypothesis : its row in the localization
    refined : False if it was left behind after the coarse phase
    energies : cost per frame by kind of evidence (markers, prior, anatomical, image, shape, placement)
    energy : their sum; comparable only among refined, or only among unrefined, candidates
    bone : (U,) bone of each marker
    vertex : (U,) nearest vertex of each marker
    part : the bones that carry markers, in words
    heading_deg : which way the camera looks in the lab, about the vertical
    camera : as fitted
    rest, dirs, weights : placement of the markers: (U, 3) m on the mean rest body, (U, 3, S), (U, 24)
    surface, normal : (U, 3) m and (U, 3), the rest skin below each marker
    betas : (S,) shape, bone lengths last
    rotations, trans : pose of the keyframes, lab frame
    trace : total energy after each step
    bias : (K, 3, 3) what turns the video's joints towards the true ones, in every frame alike
    steps : the body after each of these, where it was kept
    behind : times the energy that the best answer had when this one was left behind; NaN for refined ones
    """

    hypothesis: int
    refined: bool
    energies: dict[str, float]
    energy: float
    bone: np.ndarray
    vertex: np.ndarray
    part: str
    heading_deg: float
    camera: CameraResult
    rest: np.ndarray
    dirs: np.ndarray
    weights: np.ndarray
    surface: np.ndarray
    normal: np.ndarray
    betas: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    trace: tuple[float, ...]
    bias: np.ndarray = field(default_factory=no_bias)
    steps: Steps | None = None
    behind: float = float("nan")


@dataclass(frozen=True)
class Orientation:
    """The hypotheses ranked after bundle adjustment, and how sure the first is.

    Attributes
    ----------
    candidates : refined ones first, least energy first
    margin : energy of the best *different* answer over the best; 1 = they tie, infinite = there is no other. Where none
        was refined: of the best of those left behind, on the few keyframes
    runner_up : its row in ``candidates``, -1 if there is none
    confidence : 0..1
    warnings : what is ambiguous, in words
    far : columns of markers that fit no place on the body and were left out; in the candidates they have one still
    mirror : times the energy that the best answer costs of what it does with the video mirrored; NaN where the video
        gave no cause to try
    """

    candidates: tuple[Candidate, ...]
    margin: float
    runner_up: int
    confidence: float
    warnings: tuple[str, ...]
    far: np.ndarray = field(default_factory=_no_markers)
    mirror: float = float("nan")


@dataclass(frozen=True, eq=False)
class Solution:
    """What all frames of a fit share, as the standard errors need it.

    Attributes
    ----------
    frames : (N,) keyframes that it was found on
    placement : of the U markers in use
    surface : the rest skin below each
    bias : (K, 3, 3) what turns the video's joints towards the true ones
    weights : with which every frame was solved
    pull : what draws markers to bony landmarks; None for nothing
    """

    frames: np.ndarray
    placement: Points
    surface: Surface
    bias: np.ndarray
    weights: Weights
    pull: Pull | None = None


@dataclass(frozen=True)
class FittedMotion:
    """The body fitted to every frame.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    rotations : (T, 24, 3, 3) root in the internal lab frame (z up), others relative to the parent
    trans : (T, 3) m
    betas : (S,) shape, bone lengths last
    joints : (T, 24, 3) m
    marker_joint, marker_vertex : (M,) bone and nearest vertex of each marker, -1 where it was not used
    placed : (T, M, 3) m, where the body says each marker is; NaN where it was not used
    residual : (T, M) m, distance of each marker from there; NaN where lost
    camera : as fitted
    chosen : row of the candidate it was refined from
    confidence : 0..1
    warnings : in words
    settled_deg : degrees, a further step would turn no joint of a settled frame by more; NaN where it was not iterated
        so
    settled : (T,) True where the frame's iteration came to that, None where it was not iterated so
    pull : which markers were drawn to which bony landmarks; None where the method knows no such thing
    second : second answers for single limbs, that cost hardly more
    solution : what all frames share; None where the method knows no standard errors
    """

    time: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    betas: np.ndarray
    joints: np.ndarray
    marker_joint: np.ndarray
    marker_vertex: np.ndarray
    placed: np.ndarray
    residual: np.ndarray
    camera: CameraResult
    chosen: int
    confidence: float
    warnings: tuple[str, ...]
    settled_deg: float = np.nan
    settled: np.ndarray | None = None
    pull: LandmarkPull | None = None
    second: tuple[LimbAnswer, ...] = ()
    solution: Solution | None = None
