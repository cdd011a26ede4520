"""The pose that the video shows, robust; and its bias, which is small."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.rotations import log_so3, right_jacobian_inverse
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.state import FREE, State, Weights
from markerscope.solver.fit.terms.term import Estimate

_LOST_VIDEO_TRUST = 0.15
"""A lost stretch of video is filled in: it still says roughly where the limbs are."""


def video_residual(
    prior: np.ndarray, tracked: np.ndarray, state: State, weights: Weights
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(N, K, 3) rad between each joint and the video's, its bias undone; Cauchy weight and cost (N, K).

    Parameters
    ----------
    prior : (N, 24, 3, 3) pose of the video, root in the camera's frame
    tracked : (N,) True where the video tracked the person
    """
    expected = prior[:, FREE] @ state.bias
    expected[:, 0] = state.camera.R_lab_cam @ expected[:, 0]
    residual = log_so3(np.swapaxes(expected, -1, -2) @ state.pose.rotations[:, FREE])
    spread = np.full(len(FREE), np.radians(weights.prior_deg))
    spread[0] = np.radians(weights.root_deg)
    trust = np.where(tracked, 1.0, _LOST_VIDEO_TRUST)[:, None] / spread**2
    squared = np.einsum("njk,njk->nj", residual, residual)
    kernel = (3 * spread) ** 2
    return residual, trust / (1 + squared / kernel), trust * kernel * np.log1p(squared / kernel)


def bias_residual(state: State) -> np.ndarray:
    """(K, 3) rad, how far the video's joints are off on average."""
    turned: np.ndarray = log_so3(state.bias)
    return turned


@dataclass(frozen=True, eq=False)
class VideoPose:
    """How far each joint is turned from the video's, in every frame, and the video's bias, once.

    Attributes
    ----------
    prior : (N, 24, 3, 3) pose of the video, root in the camera's frame
    tracked : (N,) True where the video tracked the person
    """

    prior: np.ndarray
    tracked: np.ndarray
    name: str = "prior"

    def energy(self, at: Estimate) -> float:
        """See ``Term``."""
        bias = float((bias_residual(at.state) ** 2).sum() / np.radians(at.weights.bias_deg) ** 2)
        return float(video_residual(self.prior, self.tracked, at.state, at.weights)[2].sum() + bias) / at.frames

    def add_to(self, sums: NormalEquations, at: Estimate) -> None:
        """See ``Term``; turning the camera turns the video's root."""
        state, weights, unknowns = at.state, at.weights, at.unknowns
        video, trust, _ = video_residual(self.prior, self.tracked, state, weights)
        by_turn = right_jacobian_inverse(video)
        sums.add_joints(
            trust[..., None, None] * (np.swapaxes(by_turn, -1, -2) @ by_turn),
            trust[..., None] * (np.swapaxes(by_turn, -1, -2) @ video[..., None])[..., 0],
        )
        bias_at = unknowns.bias
        if weights.free_bias:
            by_bias = -np.swapaxes(by_turn, -1, -2)
            weighted = trust[..., None, None] * by_bias
            cross = (np.swapaxes(by_turn, -1, -2) @ weighted).swapaxes(0, 1)
            diagonal_blocks(sums.h_fs[..., bias_at])[1:] += cross[1:]
            own = np.einsum("nkia,nkib->kab", by_bias, weighted)
            diagonal_blocks(sums.h_ss[None, bias_at, bias_at])[1:, 0] += own[1:]
            sums.g_s[bias_at][3:] += np.einsum("nkia,nki->ka", weighted, video)[1:].ravel()
        turn_at = slice(unknowns.camera.start, unknowns.camera.start + 3)
        by_camera = -by_turn[:, 0] @ np.swapaxes(state.pose.rotations[:, 0], -1, -2)
        weighted = trust[:, 0, None, None] * by_camera
        sums.h_fs[:, :3, turn_at] += np.swapaxes(by_turn[:, 0], -1, -2) @ weighted
        sums.h_ss[turn_at, turn_at] += np.einsum("nia,nib->ab", by_camera, weighted)
        sums.g_s[turn_at] += np.einsum("nia,ni->a", weighted, video[:, 0])
        information = np.radians(weights.bias_deg) ** -2
        sums.h_ss[bias_at, bias_at] += information * np.eye(3 * len(FREE))
        sums.g_s[bias_at] += information * bias_residual(state).ravel()
