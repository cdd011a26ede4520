"""A body of one shape and its poses over time: a fitted motion, a candidate's ghost, one iteration of a descent."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from markerscope.app.views.posing import (
    Detail,
    Pose,
    PosedPoints,
    bones_of,
    fixed_points,
    mesh_of,
    pose_at,
    skin_points,
)
from markerscope.solver.body.model import Body
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3, slerp
from markerscope.solver.fit.known.neutral import Neutral, facing
from markerscope.solver.fit.localize import R_LAB_UPRIGHT_CAMERA
from markerscope.solver.fit.published.results import PaperLocalization, Trace
from markerscope.solver.fit.results import Candidate, FittedMotion, Localization
from markerscope.solver.sync.offset import Sync

_SAME_TIME_S = 1e-6
_BAND_M = 0.07
"""Width of the stripes of a body that is out of date."""


@dataclass(frozen=True, eq=False)
class BodyTrack:
    """One body over time, drawn at any moment of the marker clock.

    Attributes
    ----------
    body : with bone lengths among its shape coefficients
    betas : (S,) shape, or its first coefficients
    times : (N,) s, marker clock, when the poses hold; between them they are interpolated
    rotations, trans : (N, 24, 3, 3) root in the lab, others relative to the parent; (N, 3) m
    markers : (U,) the markers that have a place on this body
    vertex : (U,) the vertex below each
    placement : where each marker's centre belongs, fixed to the body; None where only the vertex is known
    """

    body: Body
    betas: np.ndarray
    times: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    markers: np.ndarray
    vertex: np.ndarray
    placement: PosedPoints | None = None

    @cached_property
    def coarse(self) -> PosedPoints:
        """The coarse mesh, for playing and for ghosts."""
        return mesh_of(self.body, self.betas, "coarse")

    @cached_property
    def full(self) -> PosedPoints:
        """Every vertex."""
        return mesh_of(self.body, self.betas, "full")

    @cached_property
    def bones(self) -> PosedPoints:
        """The bones inside."""
        return bones_of(self.body, self.betas)

    @cached_property
    def skin(self) -> PosedPoints:
        """(U) the vertex below each marker."""
        return skin_points(self.body, self.betas, self.vertex)

    @cached_property
    def coarse_bands(self) -> np.ndarray:
        """(V,) bool, of the coarse mesh: stripes across the body, fixed to the skin, for what is out of date."""
        return self._bands("coarse")

    @cached_property
    def full_bands(self) -> np.ndarray:
        """(V,) bool, the same of every vertex."""
        return self._bands("full")

    def _bands(self, detail: Detail) -> np.ndarray:
        height = self.vertices(float(self.times[len(self.times) // 2]), detail)[:, 2]
        return np.asarray(np.floor(height / _BAND_M).astype(int) % 2 == 1)

    def ready(self) -> BodyTrack:
        """Make every skin now and not when it is first drawn; the same track."""
        _ = self.coarse, self.full, self.bones, self.skin
        return self

    def nearest(self, time: float) -> int:
        """The pose whose time is nearest."""
        right = int(np.clip(np.searchsorted(self.times, time), 1, max(len(self.times) - 1, 1)))
        right = min(right, len(self.times) - 1)
        left = max(right - 1, 0)
        return left if abs(self.times[left] - time) <= abs(self.times[right] - time) else right

    def pose(self, time: float) -> Pose:
        """The pose at a time, s: a given one where there is one, else between its neighbours."""
        near = self.nearest(time)
        if abs(self.times[near] - time) < _SAME_TIME_S or len(self.times) == 1:
            return Pose(self.rotations[near], self.trans[near])
        return pose_at(self.times, self.rotations, self.trans, time)

    def is_given(self, time: float) -> bool:
        """Whether the pose at this time is one of the given, and not interpolated or held."""
        return bool(abs(self.times[self.nearest(time)] - time) < _SAME_TIME_S)

    def vertices(self, time: float, detail: Detail = "full") -> np.ndarray:
        """(V, 3) m, float32: the skin at a time."""
        return self.mesh(detail).at(self.pose(time))

    def faces(self, detail: Detail = "full") -> np.ndarray:
        """(F, 3) triangles of the skin."""
        return self.mesh(detail).faces

    def mesh(self, detail: Detail) -> PosedPoints:
        """The skin to be posed."""
        return self.full if detail == "full" else self.coarse

    def joints(self, time: float) -> np.ndarray:
        """(24, 3) m, joint centres at a time."""
        return self.skin.joints(self.pose(time))

    def skin_places(self, time: float, count: int) -> np.ndarray:
        """(M, 3) m, the skin below each of ``count`` markers at a time; NaN for those without a place."""
        return self._spread(self.skin.at(self.pose(time)), count)

    def marker_places(self, time: float, count: int) -> np.ndarray:
        """(M, 3) m, where each of ``count`` markers belongs at a time; the skin itself where no more is known."""
        return self._spread((self.placement or self.skin).at(self.pose(time)), count)

    def places_over(self, times: np.ndarray) -> np.ndarray:
        """(n, U, 3) m, where the markers that have a place belong at several times."""
        poses = [self.pose(float(time)) for time in times]
        rotations, trans = np.stack([pose.rotations for pose in poses]), np.stack([pose.trans for pose in poses])
        return (self.placement or self.skin).over(rotations, trans)

    def _spread(self, points: np.ndarray, count: int) -> np.ndarray:
        out = np.full((count, 3), np.nan)
        out[self.markers] = points
        return out


def of_motion(body: Body, motion: FittedMotion) -> BodyTrack:
    """The body of a fit, at every frame."""
    used = np.flatnonzero(motion.marker_vertex >= 0)
    return BodyTrack(body, motion.betas, motion.time, motion.rotations, motion.trans, used, motion.marker_vertex[used])


def of_neutral(body: Body, motion: FittedMotion, neutral: Neutral) -> BodyTrack:
    """The neutral pose, in the middle of where the fitted body goes, and facing as it does on the whole."""
    pose = np.broadcast_to(facing(neutral, motion), (2, *motion.rotations.shape[1:]))
    middle = motion.trans[[0, -1]].mean(axis=0)
    nothing = np.zeros(0, dtype=np.intp)
    return BodyTrack(body, motion.betas, motion.time[[0, -1]], pose, np.stack([middle, middle]), nothing, nothing)


def of_candidate(
    body: Body, candidate: Candidate, found: Localization | PaperLocalization, markers: Markers
) -> BodyTrack:
    """A candidate's ghost, known at its keyframes.

    Parameters
    ----------
    found : the localization that it was made from, whose frames are frames of ``markers``
    """
    placement = fixed_points(body, candidate.betas, candidate.rest, candidate.dirs, candidate.weights)
    return BodyTrack(
        body,
        candidate.betas,
        markers.time[keyframes_of(candidate, found)],
        candidate.rotations,
        candidate.trans,
        found.markers,
        candidate.vertex,
        placement,
    )


def belongs_to(candidate: Candidate, found: Localization | PaperLocalization) -> bool:
    """Whether a candidate can have been made from a localization, and not from another with other settings."""
    return len(keyframes_of(candidate, found)) == len(candidate.trans) and len(found.markers) == len(candidate.vertex)


def keyframes_of(candidate: Candidate, found: Localization | PaperLocalization) -> np.ndarray:
    """(N,) the frames that a candidate's poses are of."""
    if isinstance(found, PaperLocalization):
        return found.frames
    return found.many if candidate.refined else found.few


def of_hypothesis(
    body: Body, found: Localization, row: int, prior: PosePrior, sync: Sync, markers: Markers
) -> BodyTrack:
    """What a hypothesis started as: the video's body of mean shape, turned and shifted onto the markers."""
    times = markers.time[found.few]
    rotations = slerp(prior.rotations, prior.time, (times - sync.offset) / sync.rate_ratio)
    rotations[:, 0] = found.R_lab_cam[row] @ rotations[:, 0]
    betas = np.zeros(body.shape_count)
    trans = found.trans[row] - body.joints(betas)[0]
    return BodyTrack(body, betas, times, rotations, trans, found.markers, found.vertex[row])


def of_chain(
    body: Body, found: PaperLocalization, row: int, prior: PosePrior, sync: Sync, markers: Markers
) -> BodyTrack:
    """One of the chains that were laid over the markers: the whole body that it belongs to.

    Of a chain that was not, the body that the solve starts from.
    """
    chain = found.candidates[row] if row < len(found.candidates) else found
    times = markers.time[found.frames]
    rotations = slerp(prior.rotations, prior.time, (times - sync.offset) / sync.rate_ratio)
    turn = exp_so3(np.array([0.0, 0.0, np.radians(chain.yaw_deg)])) @ R_LAB_UPRIGHT_CAMERA
    rotations[:, 0] = turn @ rotations[:, 0]
    nothing = np.zeros(0, dtype=np.intp)
    return BodyTrack(body, chain.betas, times, rotations, chain.trans, nothing, nothing)


def of_iteration(
    body: Body,
    trace: Trace,
    step: int,
    found: Localization | PaperLocalization,
    markers: Markers,
    vertex: np.ndarray,
) -> BodyTrack:
    """The body as one of the iterations that a trace kept had it.

    Parameters
    ----------
    step : row of the trace
    vertex : (U,) of each marker, as the stage has it; none where it has none yet
    """
    used = found.markers if len(vertex) else np.zeros(0, dtype=np.intp)
    frames = found.frames if isinstance(found, PaperLocalization) else found.few
    return BodyTrack(
        body,
        trace.betas[step],
        markers.time[frames[trace.frames]],
        exp_so3(trace.rotation_vectors[step].astype(float)),
        trace.trans[step].astype(float),
        used,
        vertex,
    )
