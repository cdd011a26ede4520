"""How noisy markers and video are in this session, read off what the fit leaves over."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from markerscope.solver.fit.kinematics import place_points
from markerscope.solver.fit.normal import NormalEquations, diagonal_blocks
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.earn import KAPPA
from markerscope.solver.fit.terms.image import ImageLandmarks
from markerscope.solver.fit.terms.markers import Markers, marker_residual
from markerscope.solver.fit.terms.term import Estimate
from markerscope.solver.fit.terms.video_pose import VideoPose, video_residual

ONCE = ("placement", "landmark_pull", "shape")
"""Terms that say something once and not in every frame."""
_USUAL_MARKER_M, _MARKERS_BELIEVED = 0.004, 50.0
_USUAL_VIDEO_DEG, _JOINTS_BELIEVED = 9.0, 2.0
"""What is believed of markers and video before the session is looked at, and as how much evidence it counts."""
_CONSTANT = (0.1, 0.9)
_MARKERS_INDEPENDENT = 10.0
"""Skin slides with the pose: however many keyframes there are, so many poses of a movement err on their own."""


@dataclass(frozen=True)
class Noise:
    """Variances by the name of the term, as times what its weight in the fit says.

    Attributes
    ----------
    shape : what changes from frame to frame
    level : what is the same in all frames
    shared : of what all frames share, from all keyframes together
    marker_m, video_deg, image_share : standard deviation a coordinate; NaN where there is none
    """

    shape: Mapping[str, float]
    level: Mapping[str, float]
    shared: Mapping[str, float]
    marker_m: float
    video_deg: float
    image_share: float


def found_noise(problem: Problem, at: Estimate, whole: NormalEquations, parts: Mapping[str, NormalEquations]) -> Noise:
    """The noise that the residuals of the keyframes show.

    Parameters
    ----------
    whole, parts : the normal equations at the keyframes, of all terms and of each
    """
    inverse = np.linalg.inv(whole.h_ff)
    shape: dict[str, float] = dict.fromkeys(parts, 1.0)
    level: dict[str, float] = dict.fromkeys(parts, 0.0)
    frames = at.frames
    marker = video = image = float("nan")
    for term in problem.terms:
        if isinstance(term, Markers):
            shape[term.name] = _markers(term, at, inverse, parts[term.name])
            marker = at.weights.marker * float(np.sqrt(shape[term.name]))
        elif isinstance(term, VideoPose):
            total, constant = _video(term, at, inverse)
            if at.weights.free_bias:  # then the bias holds what is constant, and its own spread tells how much
                constant = 0.0
            shape[term.name], level[term.name] = total * (1 - constant), total * constant
            video = float(np.sqrt(total) * np.mean(at.weights.prior_deg))
        elif isinstance(term, ImageLandmarks) and term.any_seen:
            total, constant = _image(term, at)
            shape[term.name], level[term.name] = total * (1 - constant), total * constant
            image = float(np.sqrt(total) * at.weights.image)
        elif term.name == "anatomical":  # a posture is kept: half of it changes, half does not
            shape[term.name] = level[term.name] = at.weights.anatomical / 2
    shared = {name: shape[name] + frames * level[name] for name in parts}
    shared["markers"] = shape["markers"] * max(frames / _MARKERS_INDEPENDENT, 1.0)
    # The fit counts people's usual shape in every frame; it is known once. A hit on a landmark counts as several.
    shared |= {"placement": 1.0, "shape": frames * at.weights.shape, "landmark_pull": KAPPA}
    return Noise(shape, level, shared, marker, video, image)


def _markers(term: Markers, at: Estimate, inverse: np.ndarray, part: NormalEquations) -> float:
    """Variance of a marker's coordinate over what the weight says, less what the unknowns took up."""
    where = place_points(at.state.placement, at.links, at.state.pose.betas)
    residual, information, _ = marker_residual(where, term.target, term.present, at.weights)
    counted = float(information.sum()) * at.weights.marker**2
    spent = float(np.einsum("nij,nji->", inverse, part.h_ff)) + 3 * term.target.shape[1] + at.body.shape_count
    left = max(3 * counted - spent, 0.3 * 3 * counted)
    cost = float((information[..., None] * residual**2).sum())
    usual = (_USUAL_MARKER_M / at.weights.marker) ** 2
    return (cost + _MARKERS_BELIEVED * usual) / (left + _MARKERS_BELIEVED)


def _video(term: VideoPose, at: Estimate, inverse: np.ndarray) -> tuple[float, float]:
    """Variance of the video's joint rotations over what the weights say, and how much of it is constant.

    Only joints that something else holds tell; those that the video alone holds agree with it in any case.
    """
    residual, trust, _ = video_residual(term.prior, term.tracked, at.state, at.weights)
    own = diagonal_blocks(inverse)[:-1]
    bound = np.clip(np.einsum("knii->nk", own) * trust / 3, 0, 1)
    tells = (1 - bound) ** 2 * term.tracked[:, None]
    usual = float((_USUAL_VIDEO_DEG / np.mean(at.weights.prior_deg)) ** 2)
    believed = _JOINTS_BELIEVED * at.frames
    squares = np.einsum("nki,nki->nk", residual, residual) * trust / 3
    total = (float((tells * squares).sum()) + believed * usual) / (float((tells * (1 - bound)).sum()) + believed)
    mean = np.einsum("nk,nki->ki", tells, residual) / np.maximum(tells.sum(axis=0), 1e-9)[:, None]
    about = np.einsum("nk,nki,nki->", tells, residual, residual)
    constant = float((tells.sum(axis=0) * (mean**2).sum(axis=1)).sum() / max(about, 1e-12))
    return total, float(np.clip(constant, *_CONSTANT))


def _image(term: ImageLandmarks, at: Estimate) -> tuple[float, float]:
    """Variance of the landmarks over what the weight says, and how much of it is constant."""
    camera = at.state.camera
    local = camera.to_camera(place_points(term.points, at.links, at.state.pose.betas))
    residual, information = term.residual(local, camera, at.weights)[:2]
    cost = np.einsum("nl,nlk,nlk->", information, residual, residual)
    spread = (at.weights.image * term.person) ** 2
    counted = max(float(information.sum() * spread), 1e-9)
    weight = np.maximum(information.sum(axis=0), 1e-12)
    mean = np.einsum("nl,nlk->lk", information, residual) / weight[:, None]
    constant = float((weight * (mean**2).sum(axis=1)).sum() / max(float(cost), 1e-12))
    return float(cost) / (2 * counted), float(np.clip(constant, *_CONSTANT))
