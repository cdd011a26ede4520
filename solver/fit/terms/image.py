"""The video's landmarks where the camera shows them, robust; and the usual focal length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.rotations import skew
from markerscope.solver.fit.kinematics import Points, place_points, shape_jacobian
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.state import Camera, Weights
from markerscope.solver.fit.terms.term import Estimate, add_points

_NEAREST_M = 0.2


def image_residual(
    local: np.ndarray,
    camera: Camera,
    pixels: np.ndarray,
    visible: np.ndarray,
    person: float,
    image_size: tuple[int, int],
    weights: Weights,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, L, 2) px between landmarks and the body's points in camera coordinates (N, L, 3); weight and cost (N, L).

    Parameters
    ----------
    visible : (N, L) 0..1
    person : px, height of the person in the image
    """
    depth = np.maximum(local[..., 2:], _NEAREST_M)
    residual = camera.focal * local[..., :2] / depth + np.array(image_size) / 2 - pixels
    spread = weights.image * person
    squared = np.einsum("nlk,nlk->nl", residual, residual)
    factor = 1 / (1 + squared / (weights.image_kernel * spread) ** 2)
    information = visible / spread**2
    return residual, information * factor**2, information * squared * factor


def projection_jacobian(local: np.ndarray, camera: Camera) -> np.ndarray:
    """(N, L, 2, 3) px per m: derivative of the projection by the camera coordinates."""
    depth = np.maximum(local[..., 2], _NEAREST_M)
    out = np.zeros((*local.shape[:2], 2, 3))
    out[..., 0, 0] = out[..., 1, 1] = camera.focal / depth
    out[..., 2] = -camera.focal * local[..., :2] / depth[..., None] ** 2
    return out


def focal_residual(camera: Camera, image_size: tuple[int, int], weights: Weights) -> float:
    """Natural logarithm of the focal length over its guess."""
    return float(np.log(camera.focal / (weights.focal_guess * max(image_size))))


@dataclass(frozen=True, eq=False)
class ImageLandmarks:
    """How far each landmark is from where body and camera put it in the picture; nothing, where none is seen.

    Attributes
    ----------
    points : (L) rest points of the body that the landmarks show
    pixels : (N, L, 2) px, finite
    visible : (N, L) 0..1, 0 where a landmark is not seen
    any_seen : whether there are landmarks at all
    person : px, height of the person in the image
    image_size : (width, height) px
    """

    points: Points
    pixels: np.ndarray
    visible: np.ndarray
    any_seen: bool
    person: float
    image_size: tuple[int, int]
    name: str = "image"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        if not self.any_seen:
            return 0.0
        camera = at.state.camera
        local = camera.to_camera(place_points(self.points, at.links, at.state.pose.betas))
        cost = float(self.residual(local, camera, at.weights)[2].sum())
        cost += (focal_residual(camera, self.image_size, at.weights) / at.weights.focal_spread) ** 2
        return cost / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``."""
        if not self.any_seen:
            return
        points, camera, weights, unknowns = self.points, at.state.camera, at.weights, at.unknowns
        where = place_points(points, at.links, at.state.pose.betas)
        local = camera.to_camera(where)
        residual, information, _ = self.residual(local, camera, weights)
        root = np.sqrt(information)[..., None]
        by_local = root[..., None] * projection_jacobian(local, camera)
        by_lab = by_local @ camera.R_lab_cam.T
        by_shared = None
        if weights.free_shape or weights.free_camera:
            # the residual's distance from the middle of the image is what a longer focal length scales
            zoom = root * (residual + self.pixels - np.array(self.image_size) / 2)
            by_shape = by_lab @ shape_jacobian(at.body, points, at.links)
            turn = by_lab @ skew(where - camera.centre)
            by_shared = np.concatenate([by_shape, turn, by_local, zoom[..., None]], axis=-1)
        shared = slice(unknowns.shape.start, unknowns.camera.stop)
        add_points(sums, at, points, by_lab, root * residual, shared, by_shared)
        focal_at = unknowns.camera.stop - 1
        sums.h_ss[focal_at, focal_at] += 1 / weights.focal_spread**2
        sums.g_s[focal_at] += focal_residual(camera, self.image_size, weights) / weights.focal_spread**2

    def residual(
        self, local: np.ndarray, camera: Camera, weights: Weights
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """As ``image_residual``, of these landmarks in camera coordinates (N, L, 3)."""
        return image_residual(local, camera, self.pixels, self.visible, self.person, self.image_size, weights)
