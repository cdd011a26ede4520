"""The least-squares problem of a fit: what was observed, what is unknown, and its linearisation.

Unknown per frame: a right-hand turn of every free joint and the translation. Shared by all frames: shape, the camera,
and where each marker sits on the rest body. Every residual of the fit stands in this file once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from solver.body.model import Body
from solver.rotations import exp_so3, log_so3, right_jacobian_inverse, skew
from solver.solve import anatomical
from solver.solve.kinematics import Points, Pose, blended_turn, forward, place_points, pose_jacobian, shape_jacobian

FREE = np.arange(22)
"""Joints that a fit turns: all but the hands, which neither markers nor landmarks show."""
POSE_SIZE = 3 * len(FREE) + 3
CAMERA_SIZE = 7


@dataclass(frozen=True)
class Observations:
    """What is seen in N frames.

    Attributes
    ----------
    markers : (N, M, 3) m, lab frame, NaN = lost
    prior : (N, 24, 3, 3) pose of the video, root in the camera's frame
    tracked : (N,) True where the video tracked the person
    image : (N, L, 2) px of the body landmarks in the video, NaN = not seen
    visibility : (N, L) 0..1
    image_size : (width, height) px; (0, 0) without landmarks
    """

    markers: np.ndarray
    prior: np.ndarray
    tracked: np.ndarray
    image: np.ndarray
    visibility: np.ndarray
    image_size: tuple[int, int]

    def at(self, frames: np.ndarray | slice) -> Observations:
        """Some of the frames."""
        names = ("markers", "prior", "tracked", "image", "visibility")
        return replace(self, **{name: getattr(self, name)[frames] for name in names})

    @property
    def lab_centre(self) -> np.ndarray:
        """(3,) m, the middle of all markers: the camera turns about it, which keeps the problem well scaled."""
        return np.nanmean(self.markers.reshape(-1, 3), axis=0)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: ``x_cam = R_lab_cam^T (x_lab - centre) + shift``, ``px = focal x / z + middle``.

    Attributes
    ----------
    R_lab_cam : (3, 3) turns camera axes (x right, y down, z away) into the lab
    shift : (3,) m, the point ``centre`` in the camera's frame
    centre : (3,) m, lab frame
    focal : px
    """

    R_lab_cam: np.ndarray
    shift: np.ndarray
    centre: np.ndarray
    focal: float

    def moved_to(self, centre: np.ndarray) -> Camera:
        """The same camera written about another lab point."""
        return replace(self, shift=self.shift + (centre - self.centre) @ self.R_lab_cam, centre=centre)

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) m, lab to camera frame."""
        return (points - self.centre) @ self.R_lab_cam + self.shift

    def project(self, points: np.ndarray, image_size: tuple[int, int]) -> np.ndarray:
        """(..., 3) m in the lab to (..., 2) px."""
        seen = self.to_camera(points)
        return self.focal * seen[..., :2] / np.maximum(seen[..., 2:], 0.05) + np.array(image_size) / 2


@dataclass(frozen=True)
class State:
    """One guess at everything: the pose, where the markers sit, and the camera."""

    pose: Pose
    placement: Points
    camera: Camera


@dataclass(frozen=True)
class Weights:
    """How much each kind of evidence counts, as its spread.

    Attributes
    ----------
    marker : m, spread of a marker about its place on the skin
    marker_kernel : m, beyond this a marker counts as an outlier (Geman-McClure)
    prior_deg : spread of the video's joint rotations
    root_deg : spread of the video's root rotation, once the camera is turned right
    anatomical : share of the anatomical prior
    image : spread of a 2D landmark as a share of the person's height in the image
    shape : strength of the prior on betas and bone lengths, per frame of evidence
    offset, offset_spread : m, marker centre above the skin (9.5 mm: Ghorbani and Black 2021)
    slide : m, how far a marker may slide over the skin in one step
    focal_spread : natural logarithm of the focal length
    free_focal, free_camera : False holds the camera's focal length, or all of it
    """

    marker: float = 0.01
    marker_kernel: float = 0.03
    prior_deg: float = 15.0
    root_deg: float = 12.0
    anatomical: float = 0.3
    image: float = 0.025
    image_kernel: float = 3.0
    shape: float = 0.25
    offset: float = 0.0095
    offset_spread: float = 0.002
    slide: float = 0.02
    focal_guess: float = 0.85
    focal_spread: float = 0.25
    free_focal: bool = True
    free_camera: bool = True
    free_shape: bool = True
    free_placement: bool = True


@dataclass(frozen=True)
class Surface:
    """The rest surface about each marker: what its placement is held to. All (M, ...)."""

    point: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Energies:
    """The cost of a state by kind of evidence, each per frame."""

    markers: float
    prior: float
    anatomical: float
    image: float
    shape: float
    placement: float

    @property
    def total(self) -> float:
        """Sum of all kinds."""
        return self.markers + self.prior + self.anatomical + self.image + self.shape + self.placement


class Problem:
    """Residuals of one set of observations on one body.

    Parameters
    ----------
    body : with the shape coefficients that are to be found
    seen : the observations
    landmarks : (L) rest points of the body that the video's landmarks show
    """

    def __init__(self, body: Body, seen: Observations, landmarks: Points) -> None:
        self.body, self.seen, self.landmarks = body, seen, landmarks
        self.present = np.isfinite(seen.markers).all(axis=2)
        self.target = np.where(self.present[..., None], seen.markers, 0.0)
        self.in_image = np.isfinite(seen.image).all(axis=2) & seen.tracked[:, None]
        self.pixels = np.where(self.in_image[..., None], seen.image, 0.0)
        self.person = _person_height(seen.image, self.in_image)

    # --- residuals -------------------------------------------------------------------------------------------------

    def _prior_residual(self, state: State) -> np.ndarray:
        """(N, 24, 3) rad from the video's pose, its root turned into the lab."""
        expected = self.seen.prior.copy()
        expected[:, 0] = state.camera.R_lab_cam @ expected[:, 0]
        return log_so3(np.swapaxes(expected, -1, -2) @ state.pose.rotations)

    def _prior_information(self, residual: np.ndarray, weights: Weights) -> tuple[np.ndarray, np.ndarray]:
        """(N, 24) robust weight per squared radian, and (N, 24) cost."""
        spread = np.full(24, np.radians(weights.prior_deg))
        spread[0] = np.radians(weights.root_deg)
        # A lost stretch of video is filled in: it still says roughly where the limbs are.
        trust = np.where(self.seen.tracked, 1.0, 0.15)[:, None] / spread**2
        squared = np.einsum("njk,njk->nj", residual, residual)
        kernel = (3 * spread) ** 2
        return trust / (1 + squared / kernel), trust * kernel * np.log1p(squared / kernel)

    def _image_residual(self, state: State, points: np.ndarray, weights: Weights) -> tuple[np.ndarray, ...]:
        """Camera coordinates (N, L, 3), residual (N, L, 2) px, weight and cost (N, L)."""
        local = state.camera.to_camera(points)
        depth = np.maximum(local[..., 2], 0.2)
        residual = state.camera.focal * local[..., :2] / depth[..., None] + np.array(self.seen.image_size) / 2 - self.pixels
        information = np.where(self.in_image, self.seen.visibility, 0.0) / (weights.image * self.person) ** 2
        squared = np.einsum("nlk,nlk->nl", residual, residual)
        kernel = (weights.image_kernel * weights.image * self.person) ** 2
        factor = 1 / (1 + squared / kernel)
        return local, residual, information * factor**2, information * squared * factor

    def _marker_weight(self, residual: np.ndarray, weights: Weights) -> tuple[np.ndarray, np.ndarray]:
        squared = np.einsum("nmk,nmk->nm", residual, residual)
        factor = 1 / (1 + squared / weights.marker_kernel**2)
        information = self.present / weights.marker**2
        return information * factor**2, information * squared * factor

    def energies(self, state: State, weights: Weights, surface: Surface) -> Energies:
        """What the state costs."""
        links = forward(self.body, state.pose)
        betas = state.pose.betas
        frames = len(self.target)
        marker = self._marker_weight(place_points(state.placement, links, betas) - self.target, weights)[1]
        prior = self._prior_information(self._prior_residual(state), weights)[1]
        relaxed = log_so3(np.swapaxes(anatomical.mean_pose()[FREE], -1, -2) @ state.pose.rotations[:, FREE])
        image = 0.0
        if len(self.landmarks.rest):
            image = float(self._image_residual(state, place_points(self.landmarks, links, betas), weights)[3].sum())
        focal = (np.log(state.camera.focal / self._focal_guess(weights)) / weights.focal_spread) ** 2 if image else 0.0
        height = self._height(state, surface) - weights.offset
        return Energies(
            markers=float(marker.sum()) / frames,
            prior=float(prior[:, FREE].sum()) / frames,
            anatomical=weights.anatomical * float(((relaxed / anatomical.spread()[FREE]) ** 2).sum()) / frames,
            image=(image + focal) / frames,
            shape=weights.shape * float(betas @ betas),
            placement=float(((height / weights.offset_spread) ** 2).sum()) / frames,
        )

    def reprojection(self, state: State) -> float:
        """Median distance in px of the landmarks from where the body puts them; NaN where there are none."""
        if not self.in_image.any():
            return float("nan")
        points = place_points(self.landmarks, forward(self.body, state.pose), state.pose.betas)
        gap = state.camera.project(points, self.seen.image_size) - self.pixels
        return float(np.median(np.linalg.norm(gap, axis=2)[self.in_image]))

    def _height(self, state: State, surface: Surface) -> np.ndarray:
        """(M,) m of each marker above the skin."""
        return np.einsum("mk,mk->m", state.placement.shaped(state.pose.betas) - surface.point, surface.normal)

    def _focal_guess(self, weights: Weights) -> float:
        return weights.focal_guess * max(self.seen.image_size)

    # --- linearisation ---------------------------------------------------------------------------------------------

    def step(self, state: State, weights: Weights, surface: Surface, damping: float) -> State:
        """One damped Gauss-Newton step of everything that is free."""
        frames, marker_count = self.present.shape
        betas, shape_count = state.pose.betas, self.body.shape_count
        links = forward(self.body, state.pose)
        points = Points.joined(state.placement, self.landmarks)
        where = place_points(points, links, betas)
        by_pose = pose_jacobian(points, links, betas, FREE)
        shared = shape_count + CAMERA_SIZE + 3 * marker_count
        camera_at, placement_at = shape_count, shape_count + CAMERA_SIZE
        h_fs = np.zeros((frames, POSE_SIZE, shared))
        h_ss = np.zeros((shared, shared))
        g_s = np.zeros(shared)

        # markers
        residual = where[:, :marker_count] - self.target
        information = self._marker_weight(residual, weights)[0]
        root = np.sqrt(information)[..., None, None]
        rows = (root * by_pose[:, :marker_count]).reshape(frames, -1, POSE_SIZE)
        scaled = (root[..., 0] * residual).reshape(frames, -1)
        need_shared = weights.free_shape or weights.free_placement or weights.free_camera
        by_shape = shape_jacobian(self.body, points, links) if need_shared else None
        shape_rows = None
        if by_shape is not None:
            shape_rows = (root * by_shape[:, :marker_count]).reshape(frames, -1, shape_count)
            by_place = blended_turn(state.placement, links)
            weighted_place = information[..., None, None] * by_place
            cross = np.einsum("nmia,nmib->nmab", by_pose[:, :marker_count], weighted_place, optimize=True)
            h_fs[:, :, placement_at:] = cross.transpose(0, 2, 1, 3).reshape(frames, POSE_SIZE, -1)
            shape_place = np.einsum("nmia,nmib->mab", by_shape[:, :marker_count], weighted_place, optimize=True)
            h_ss[:shape_count, placement_at:] = shape_place.transpose(1, 0, 2).reshape(shape_count, -1)
            own = np.einsum("nmia,nmib->mab", by_place, weighted_place, optimize=True)
            for m in range(marker_count):
                at = slice(placement_at + 3 * m, placement_at + 3 * m + 3)
                h_ss[at, at] += own[m]
            g_s[placement_at:] = np.einsum("nmia,nmi->ma", weighted_place, residual).ravel()

        # landmarks in the image
        if len(self.landmarks.rest):
            local, pixel, image_weight, _ = self._image_residual(state, where[:, marker_count:], weights)
            root2 = np.sqrt(image_weight)[..., None]
            depth = np.maximum(local[..., 2], 0.2)
            by_local = np.zeros((*local.shape[:2], 2, 3))
            by_local[..., 0, 0] = by_local[..., 1, 1] = state.camera.focal / depth
            by_local[..., 2] = -state.camera.focal * local[..., :2] / depth[..., None] ** 2
            by_local *= root2[..., None]
            by_lab = by_local @ state.camera.R_lab_cam.T
            image_rows = (by_lab @ by_pose[:, marker_count:]).reshape(frames, -1, POSE_SIZE)
            rows = np.concatenate([rows, image_rows], axis=1)
            scaled = np.concatenate([scaled, (root2 * pixel).reshape(frames, -1)], axis=1)
            if by_shape is not None:
                shape_rows = np.concatenate(
                    [shape_rows, (by_lab @ by_shape[:, marker_count:]).reshape(frames, -1, shape_count)], axis=1
                )
                turn = by_lab @ skew(where[:, marker_count:] - state.camera.centre)
                zoom = root2 * state.camera.focal * local[..., :2] / depth[..., None]
                camera_rows = np.concatenate([turn, by_local, zoom[..., None]], axis=-1).reshape(frames, -1, CAMERA_SIZE)
                at = slice(camera_at, placement_at)
                h_fs[:, :, at] = np.swapaxes(image_rows, 1, 2) @ camera_rows
                h_ss[at, at] += np.einsum("nra,nrb->ab", camera_rows, camera_rows, optimize=True)
                image_shape = shape_rows[:, 3 * marker_count :]
                h_ss[:shape_count, at] += np.einsum("nra,nrb->ab", image_shape, camera_rows, optimize=True)
                g_s[at] += np.einsum("nra,nr->a", camera_rows, (root2 * pixel).reshape(frames, -1))
                h_ss[placement_at - 1, placement_at - 1] += 1 / weights.focal_spread**2
                g_s[placement_at - 1] += np.log(state.camera.focal / self._focal_guess(weights)) / weights.focal_spread**2

        h_ff = np.swapaxes(rows, 1, 2) @ rows
        g_f = (np.swapaxes(rows, 1, 2) @ scaled[..., None])[..., 0]
        if shape_rows is not None:
            h_fs[:, :, :shape_count] = np.swapaxes(rows, 1, 2) @ shape_rows
            h_ss[:shape_count, :shape_count] += np.einsum("nra,nrb->ab", shape_rows, shape_rows, optimize=True)
            g_s[:shape_count] += np.einsum("nra,nr->a", shape_rows, scaled, optimize=True)

        # the video's pose and the anatomical prior act on each joint alone
        video = self._prior_residual(state)[:, FREE]
        trust = self._prior_information(self._prior_residual(state), weights)[0][:, FREE]
        jr = right_jacobian_inverse(video)
        block = trust[..., None, None] * (np.swapaxes(jr, -1, -2) @ jr)
        slope = trust[..., None] * (np.swapaxes(jr, -1, -2) @ video[..., None])[..., 0]
        relaxed = log_so3(np.swapaxes(anatomical.mean_pose()[FREE], -1, -2) @ state.pose.rotations[:, FREE])
        ja = right_jacobian_inverse(relaxed)
        habit = weights.anatomical / anatomical.spread()[FREE] ** 2
        block += np.swapaxes(ja, -1, -2) @ (habit[..., None] * ja)
        slope += (np.swapaxes(ja, -1, -2) @ (habit * relaxed)[..., None])[..., 0]
        for k in range(len(FREE)):
            h_ff[:, 3 * k : 3 * k + 3, 3 * k : 3 * k + 3] += block[:, k]
        g_f[:, :-3] += slope.reshape(frames, -1)
        # turning the camera turns the pose that the video's root asks for
        by_camera = -jr[:, 0] @ np.swapaxes(state.pose.rotations[:, 0], -1, -2)
        weighted = trust[:, 0, None, None] * by_camera
        h_fs[:, :3, camera_at : camera_at + 3] += np.swapaxes(jr[:, 0], -1, -2) @ weighted
        h_ss[camera_at : camera_at + 3, camera_at : camera_at + 3] += np.einsum("nia,nib->ab", by_camera, weighted)
        g_s[camera_at : camera_at + 3] += np.einsum("nia,ni->a", weighted, video[:, 0])

        # priors of what is shared
        shape_prior = frames * weights.shape
        h_ss[:shape_count, :shape_count] += shape_prior * np.eye(shape_count)
        g_s[:shape_count] += shape_prior * betas
        height = self._height(state, surface) - weights.offset
        for m in range(marker_count):
            at = slice(placement_at + 3 * m, placement_at + 3 * m + 3)
            n = surface.normal[m]
            h_ss[at, at] += np.outer(n, n) / weights.offset_spread**2 + np.eye(3) / weights.slide**2
            g_s[at] += n * height[m] / weights.offset_spread**2

        h_ss = np.triu(h_ss) + np.triu(h_ss, 1).T
        diagonal = np.einsum("nii->ni", h_ff)
        diagonal += damping * diagonal + 1e-6
        h_ss[np.diag_indices(shared)] *= 1 + damping
        h_ss[np.diag_indices(shared)] += 1e-9
        held = self._held(weights, shape_count, camera_at, placement_at, shared)
        free = np.flatnonzero(~held)
        if not len(free):
            return self._moved(state, -np.linalg.solve(h_ff, g_f[..., None])[..., 0], np.zeros(shared))
        solved = np.linalg.solve(h_ff, np.concatenate([h_fs[:, :, free], g_f[..., None]], axis=2))
        cross = h_fs[:, :, free]
        stacked = cross.reshape(-1, len(free))
        reduced = h_ss[np.ix_(free, free)] - stacked.T @ solved[..., :-1].reshape(-1, len(free))
        slope_s = g_s[free] - stacked.T @ solved[..., -1].ravel()
        delta = np.zeros(shared)
        delta[free] = -np.linalg.solve(reduced, slope_s)
        return self._moved(state, -solved[..., -1] - solved[..., :-1] @ delta[free], delta)

    @staticmethod
    def _held(weights: Weights, shape_count: int, camera_at: int, placement_at: int, shared: int) -> np.ndarray:
        held = np.zeros(shared, dtype=bool)
        held[:shape_count] = not weights.free_shape
        held[camera_at:placement_at] = not weights.free_camera
        held[placement_at - 1] |= not weights.free_focal
        held[placement_at:] = not weights.free_placement
        return held

    def _moved(self, state: State, by_frame: np.ndarray, shared: np.ndarray) -> State:
        """The state after a step, its turns kept within half a radian a joint."""
        frames = len(by_frame)
        turns = np.clip(by_frame[:, :-3].reshape(frames, len(FREE), 3), -0.5, 0.5)
        rotations = state.pose.rotations.copy()
        rotations[:, FREE] = rotations[:, FREE] @ exp_so3(turns)
        shape_count = self.body.shape_count
        camera = shared[shape_count : shape_count + CAMERA_SIZE]
        return State(
            Pose(rotations, state.pose.trans + np.clip(by_frame[:, -3:], -0.5, 0.5), state.pose.betas + np.clip(shared[:shape_count], -1, 1)),
            replace(state.placement, rest=state.placement.rest + np.clip(shared[shape_count + CAMERA_SIZE :], -0.05, 0.05).reshape(-1, 3)),
            replace(
                state.camera,
                R_lab_cam=exp_so3(np.clip(camera[:3], -0.5, 0.5)) @ state.camera.R_lab_cam,
                shift=state.camera.shift + camera[3:6],
                focal=float(state.camera.focal * np.exp(np.clip(camera[6], -0.2, 0.2))),
            ),
        )


def _person_height(image: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """(N, 1) px, how tall the person stands in each frame's landmarks, at least 50."""
    if not image.shape[1]:
        return np.ones((len(image), 1))
    low = np.where(seen[..., None], image, np.inf).min(axis=1)
    high = np.where(seen[..., None], image, -np.inf).max(axis=1)
    size = np.linalg.norm(np.where(np.isfinite(high - low), high - low, 0.0), axis=1)
    usual = np.median(size[size > 0]) if (size > 0).any() else 1.0
    # The extent changes as a person crouches; how well the network sees them does not.
    return np.full((len(image), 1), max(float(usual), 50.0))
