"""The least-squares problem of a fit: what a guess costs, and the Gauss-Newton step that improves it.

Unknown per frame: a right-hand turn of every free joint and the translation. Shared by all frames: shape, the camera,
and where each marker sits on the rest body.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, right_jacobian_inverse, skew
from markerscope.solver.fit.kinematics import Chain, Points, Pose, blended_turn, forward, place_points, shape_jacobian
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks, group_jacobian, groups
from markerscope.solver.fit.residuals import (
    bias_residual,
    focal_residual,
    habit_residual,
    height_residual,
    image_residual,
    marker_residual,
    projection_jacobian,
    video_residual,
)
from markerscope.solver.fit.state import CAMERA_SIZE, FREE, Energies, Observations, State, Surface, Weights

_LARGEST_TURN = 0.5
_LARGEST_MOVE_M = 0.5
_LARGEST_SLIDE_M = 0.05


class Problem:
    """One set of observations on one body.

    Parameters
    ----------
    body : with the shape coefficients that are to be found
    seen : the observations
    landmarks : (L) rest points of the body that the video's landmarks show
    person : px, height of the person in the image; of these observations where not given. Who solves a recording in
        parts gives that of the whole, or what a landmark counts would depend on the parts
    """

    def __init__(self, body: Body, seen: Observations, landmarks: Points, person: float | None = None) -> None:
        self.body, self.seen, self.landmarks = body, seen, landmarks
        self.present = np.isfinite(seen.markers).all(axis=2)
        self.target = np.where(self.present[..., None], seen.markers, 0.0)
        self.in_image = np.isfinite(seen.image).all(axis=2) & seen.tracked[:, None]
        self.pixels = np.where(self.in_image[..., None], seen.image, 0.0)
        self.visible = np.where(self.in_image, seen.visibility, 0.0)
        self.person = person_height(seen) if person is None else person
        count, shapes = self.present.shape[1], body.shape_count
        self.told_shape = 0 if seen.shape is None else len(seen.shape)
        self.usual_shape = np.zeros(shapes)
        if seen.shape is not None:
            self.usual_shape[: self.told_shape] = seen.shape
        self.shape_at = slice(0, shapes)
        self.camera_at = slice(shapes, shapes + CAMERA_SIZE)
        self.bias_at = slice(self.camera_at.stop, self.camera_at.stop + 3 * len(FREE))
        self.placement_at = slice(self.bias_at.stop, self.bias_at.stop + 3 * count)

    def energies(self, state: State, weights: Weights, surface: Surface) -> Energies:
        """What the state costs, per frame."""
        frames, betas = len(self.target), state.pose.betas
        links = forward(self.body, state.pose)
        where = place_points(state.placement, links, betas)
        height = height_residual(state, surface, weights)
        image = 0.0
        if self.in_image.any():
            local = state.camera.to_camera(place_points(self.landmarks, links, betas))
            image = float(self._image(local, state, weights)[2].sum())
            image += (focal_residual(state.camera, self.seen.image_size, weights) / weights.focal_spread) ** 2
        return Energies(
            markers=float(marker_residual(where, self.target, self.present, weights)[2].sum()) / frames,
            prior=float(video_residual(self.seen, state, weights)[2].sum() + self._bias(state, weights)) / frames,
            anatomical=float(habit_residual(state, weights)[2].sum()) / frames,
            image=image / frames,
            shape=weights.shape * float(self._shape_information(weights) @ (betas - self.usual_shape) ** 2),
            placement=float(((height / weights.offset_spread) ** 2).sum()) / frames,
        )

    def step(self, state: State, weights: Weights, surface: Surface, damping: float) -> State:
        """One damped Gauss-Newton step of everything that is free."""
        sums = self.linearised(state, weights, surface)
        return self._moved(state, *sums.solve(self._free(weights), damping))

    def frame_step(self, state: State, weights: Weights, surface: Surface, damping: float) -> np.ndarray:
        """(F, 69) rad and m: the step of each frame on its own, with all that they share held."""
        by_frame, _ = self.linearised(state, weights, surface).solve(np.zeros(0, dtype=np.intp), damping)
        return by_frame

    def linearised(self, state: State, weights: Weights, surface: Surface) -> NormalEquations:
        """The normal equations at a state; their slope is half that of the cost summed over frames."""
        sums = NormalEquations(len(self.target), self.placement_at.stop)
        links = forward(self.body, state.pose)
        self._add_markers(sums, state, links, weights)
        if self.in_image.any():
            self._add_image(sums, state, links, weights)
        self._add_joints(sums, state, weights)
        self._add_shared(sums, state, surface, weights)
        return sums

    def reprojection(self, state: State) -> float:
        """Median distance in px of the landmarks from where the body puts them; NaN where there are none."""
        if not self.in_image.any():
            return float("nan")
        points = place_points(self.landmarks, forward(self.body, state.pose), state.pose.betas)
        gap = state.camera.project(points, self.seen.image_size) - self.pixels
        return float(np.median(np.linalg.norm(gap, axis=2)[self.in_image]))

    def _shape_information(self, weights: Weights) -> np.ndarray:
        """(S,) one over the variance of each shape coefficient about the usual: people's, or the video's error."""
        information = np.ones(len(self.usual_shape))
        information[: self.told_shape] = weights.video_shape**-2
        return information

    def _bias(self, state: State, weights: Weights) -> float:
        """What the video's bias costs, once and not in every frame."""
        return float((bias_residual(state) ** 2).sum() / np.radians(weights.bias_deg) ** 2)

    def _image(self, local: np.ndarray, state: State, weights: Weights) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        size = self.seen.image_size
        return image_residual(local, state.camera, self.pixels, self.visible, self.person, size, weights)

    def _add_markers(self, sums: NormalEquations, state: State, links: Chain, weights: Weights) -> None:
        points, betas = state.placement, state.pose.betas
        where = place_points(points, links, betas)
        residual, information, _ = marker_residual(where, self.target, self.present, weights)
        root = np.sqrt(information)[..., None]
        by_shape = root[..., None] * shape_jacobian(self.body, points, links) if weights.free_shape else None
        by_place = root[..., None] * blended_turn(points, links) if weights.free_placement else None
        scaled = root * residual
        frames = len(residual)
        for group in groups(points.weights):
            p = group.points
            rows = root[:, p, :, None] * group_jacobian(points, group, links, betas)
            flat = rows.reshape(frames, -1, rows.shape[3])
            shape_rows = None if by_shape is None else by_shape[:, p].reshape(frames, flat.shape[1], -1)
            sums.add_rows(group, flat, scaled[:, p].reshape(frames, -1), self.shape_at, shape_rows)
            if by_place is not None:
                cross = np.swapaxes(rows, 2, 3) @ by_place[:, p]  # (F, p, C, 3)
                columns = (self.placement_at.start + 3 * p[:, None] + np.arange(3)).ravel()
                block = cross.transpose(0, 2, 1, 3).reshape(frames, len(group.columns), -1)
                for at, of in group.runs:
                    sums.h_fs[:, at, columns] += block[:, of]
        if by_place is not None:
            self._add_placement(sums, by_place, by_shape, scaled)

    def _add_placement(
        self, sums: NormalEquations, by_place: np.ndarray, by_shape: np.ndarray | None, scaled: np.ndarray
    ) -> None:
        """What the markers say of their own places, and of the shape together with them."""
        transposed = by_place.transpose(1, 3, 0, 2).reshape(by_place.shape[1], 3, -1)  # (M, 3, F * 3)
        own = transposed @ np.swapaxes(transposed, 1, 2)
        diagonal_blocks(sums.h_ss[None, self.placement_at, self.placement_at])[:, 0] += own
        target = scaled.transpose(1, 0, 2).reshape(len(own), -1, 1)
        sums.g_s[self.placement_at] += (transposed @ target).ravel()
        if by_shape is not None:
            shape_rows = by_shape.transpose(1, 0, 2, 3).reshape(len(own), -1, by_shape.shape[3])
            cross = (transposed @ shape_rows).reshape(-1, by_shape.shape[3])
            sums.h_ss[self.placement_at, self.shape_at] += cross
            sums.h_ss[self.shape_at, self.placement_at] += cross.T

    def _add_image(self, sums: NormalEquations, state: State, links: Chain, weights: Weights) -> None:
        points, betas, camera = self.landmarks, state.pose.betas, state.camera
        where = place_points(points, links, betas)
        local = camera.to_camera(where)
        residual, information, _ = self._image(local, state, weights)
        root = np.sqrt(information)[..., None]
        by_local = root[..., None] * projection_jacobian(local, camera)
        by_lab = by_local @ camera.R_lab_cam.T
        scaled = root * residual
        frames = len(residual)
        shared_rows = None
        if weights.free_shape or weights.free_camera:
            # the residual's distance from the middle of the image is what a longer focal length scales
            zoom = root * (residual + self.pixels - np.array(self.seen.image_size) / 2)
            shape_rows = by_lab @ shape_jacobian(self.body, points, links)
            turn = by_lab @ skew(where - camera.centre)
            shared_rows = np.concatenate([shape_rows, turn, by_local, zoom[..., None]], axis=-1)
        shared = slice(self.shape_at.start, self.camera_at.stop)
        for group in groups(points.weights):
            p = group.points
            rows = (by_lab[:, p] @ group_jacobian(points, group, links, betas)).reshape(frames, 2 * len(p), -1)
            mine = None if shared_rows is None else shared_rows[:, p].reshape(frames, 2 * len(p), -1)
            sums.add_rows(group, rows, scaled[:, p].reshape(frames, -1), shared, mine)
        focal_at = self.camera_at.stop - 1
        sums.h_ss[focal_at, focal_at] += 1 / weights.focal_spread**2
        focal = focal_residual(camera, self.seen.image_size, weights)
        sums.g_s[focal_at] += focal / weights.focal_spread**2

    def _add_joints(self, sums: NormalEquations, state: State, weights: Weights) -> None:
        """The video's pose and the relaxed pose act on each joint alone; turning the camera turns the video's root."""
        video, trust, _ = video_residual(self.seen, state, weights)
        by_turn = right_jacobian_inverse(video)
        block = trust[..., None, None] * (np.swapaxes(by_turn, -1, -2) @ by_turn)
        slope = trust[..., None] * (np.swapaxes(by_turn, -1, -2) @ video[..., None])[..., 0]
        habit, information, _ = habit_residual(state, weights)
        by_habit = right_jacobian_inverse(habit)
        block += np.swapaxes(by_habit, -1, -2) @ (information[..., None] * by_habit)
        slope += (np.swapaxes(by_habit, -1, -2) @ (information * habit)[..., None])[..., 0]
        diagonal_blocks(sums.h_ff)[:-1] += block.swapaxes(0, 1)
        sums.g_f[:, :-3] += slope.reshape(len(slope), -1)
        if weights.free_bias:
            by_bias = -np.swapaxes(by_turn, -1, -2)
            weighted = trust[..., None, None] * by_bias
            cross = (np.swapaxes(by_turn, -1, -2) @ weighted).swapaxes(0, 1)
            diagonal_blocks(sums.h_fs[..., self.bias_at])[1:] += cross[1:]
            own = np.einsum("nkia,nkib->kab", by_bias, weighted)
            diagonal_blocks(sums.h_ss[None, self.bias_at, self.bias_at])[1:, 0] += own[1:]
            sums.g_s[self.bias_at][3:] += np.einsum("nkia,nki->ka", weighted, video)[1:].ravel()
        turn_at = slice(self.camera_at.start, self.camera_at.start + 3)
        by_camera = -by_turn[:, 0] @ np.swapaxes(state.pose.rotations[:, 0], -1, -2)
        weighted = trust[:, 0, None, None] * by_camera
        sums.h_fs[:, :3, turn_at] += np.swapaxes(by_turn[:, 0], -1, -2) @ weighted
        sums.h_ss[turn_at, turn_at] += np.einsum("nia,nib->ab", by_camera, weighted)
        sums.g_s[turn_at] += np.einsum("nia,ni->a", weighted, video[:, 0])

    def _add_shared(self, sums: NormalEquations, state: State, surface: Surface, weights: Weights) -> None:
        """Priors of shape, of the video's bias, of each marker's height over the skin; damping of its slide."""
        strength = len(self.target) * weights.shape * self._shape_information(weights)
        sums.h_ss[self.shape_at, self.shape_at] += np.diag(strength)
        sums.g_s[self.shape_at] += strength * (state.pose.betas - self.usual_shape)
        bias = np.radians(weights.bias_deg) ** -2
        sums.h_ss[self.bias_at, self.bias_at] += bias * np.eye(3 * len(FREE))
        sums.g_s[self.bias_at] += bias * bias_residual(state).ravel()
        height = height_residual(state, surface, weights)
        normal = surface.normal
        own = normal[:, :, None] * normal[:, None] / weights.offset_spread**2 + np.eye(3) / weights.slide**2
        diagonal_blocks(sums.h_ss[None, self.placement_at, self.placement_at])[:, 0] += own
        sums.g_s[self.placement_at] += (normal * height[:, None]).ravel() / weights.offset_spread**2

    def _free(self, weights: Weights) -> np.ndarray:
        """Indices of the shared unknowns that may move."""
        free = np.zeros(self.placement_at.stop, dtype=bool)
        free[self.shape_at] = weights.free_shape
        free[self.camera_at] = weights.free_camera
        if not self.in_image.any():
            free[self.camera_at.start + 3 : self.camera_at.stop] = False
        free[self.bias_at.start + 3 : self.bias_at.stop] = weights.free_bias
        free[self.placement_at] = weights.free_placement
        return np.flatnonzero(free)

    @staticmethod
    def turned(pose: Pose, by_frame: np.ndarray) -> Pose:
        """The poses after a step (F, 69) of each frame."""
        turns = by_frame[:, :-3].reshape(len(by_frame), len(FREE), 3).clip(-_LARGEST_TURN, _LARGEST_TURN)
        rotations = pose.rotations.copy()
        rotations[:, FREE] = rotations[:, FREE] @ exp_so3(turns)
        trans = pose.trans + by_frame[:, -3:].clip(-_LARGEST_MOVE_M, _LARGEST_MOVE_M)
        return replace(pose, rotations=rotations, trans=trans)

    def _moved(self, state: State, by_frame: np.ndarray, shared: np.ndarray) -> State:
        """The state after a step, no part of which goes further than the linearisation can be trusted."""
        pose = self.turned(state.pose, by_frame)
        betas = state.pose.betas + shared[self.shape_at].clip(-1, 1)
        slide = shared[self.placement_at].clip(-_LARGEST_SLIDE_M, _LARGEST_SLIDE_M).reshape(-1, 3)
        turn, shift, zoom = np.split(shared[self.camera_at], [3, 6])
        return State(
            replace(pose, betas=betas),
            replace(state.placement, rest=state.placement.rest + slide),
            replace(
                state.camera,
                R_lab_cam=exp_so3(turn.clip(-_LARGEST_TURN, _LARGEST_TURN)) @ state.camera.R_lab_cam,
                shift=state.camera.shift + shift,
                focal=float(state.camera.focal * np.exp(zoom[0].clip(-0.2, 0.2))),
            ),
            state.bias @ exp_so3(shared[self.bias_at].reshape(-1, 3).clip(-_LARGEST_TURN, _LARGEST_TURN)),
        )


def person_height(seen: Observations) -> float:
    """How tall the person stands in the landmarks, px, median over frames, at least 50.

    The extent changes as a person crouches; how well the network sees them does not.
    """
    there = np.isfinite(seen.image).all(axis=2) & seen.tracked[:, None]
    if not there.any():
        return 50.0
    low = np.where(there[..., None], seen.image, np.inf).min(axis=1)
    high = np.where(there[..., None], seen.image, -np.inf).max(axis=1)
    size = np.linalg.norm((high - low)[np.isfinite(high - low).all(axis=1)], axis=1)
    return max(float(np.median(size)), 50.0)
