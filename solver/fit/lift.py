"""From 33 landmarks to 24 joint rotations: the embedded video prior.

The body, its bone lengths free, is fitted to the network's metric landmarks in every frame at once, with hinge joints
held to their hinges and each joint drawn to its own smoothed course. The network's depth is its weakest axis, so the
result is a prior, not a measurement.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import kabsch, slerp
from markerscope.solver.core.skeleton import INDEX, PARENTS
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights

_UNUSED = ("mouth_left", "mouth_right", "left_eye_inner", "right_eye_inner", "left_eye_outer", "right_eye_outer")
"""Face points that say no more than the eyes do."""
_WEIGHTS = Weights(
    marker=0.03,
    marker_kernel=0.20,
    prior_deg=12.0,
    root_deg=25.0,
    anatomical=1.0,
    shape=0.1,
    free_placement=False,
    free_camera=False,
    free_bias=False,
)
_ROUNDS = 5
_SMOOTH_S = 0.15


def landmark_points(body: Body) -> tuple[Points, np.ndarray]:
    """The body's points that the landmarks show (L), and which of the 33 landmarks each is (L,)."""
    rest, dirs, weights = body.landmark_basis()
    used = [name for name in LANDMARKS if name not in _UNUSED]
    rows = [body.landmark_names.index(f"bp_{name}") for name in used]
    return Points(rest[rows], dirs[rows], weights[rows]), np.array([LANDMARKS.index(name) for name in used])


def mirror_landmarks() -> np.ndarray:
    """(L,) the landmark on the other side of each that ``landmark_points`` names."""
    used = [name for name in LANDMARKS if name not in _UNUSED]
    swap = {"left": "right", "right": "left"}
    return np.array([used.index("_".join(swap.get(word, word) for word in name.split("_"))) for name in used])


def lift(landmarks: Landmarks, body: Body, progress: Progress = silent) -> PosePrior:
    """Joint rotations of the person in the video.

    Parameters
    ----------
    landmarks : of the video, left/right flips mended
    body : whose landmarks are named; only its proportions matter

    Returns
    -------
    PosePrior, root in the camera's axes (x right, y down, z away); lost frames filled and marked as not tracked
    """
    if not landmarks.tracked.any():
        raise InputError(
            "no person was found in any frame", landmarks.source, "use a video that shows the whole person"
        )
    free = with_bone_lengths(body)
    points, column = landmark_points(free)
    used = np.flatnonzero(landmarks.tracked)
    target = landmarks.world[used][:, column]
    start = _start(free, points, column, target)
    rotations = _fit(free, points, target, landmarks.time[used], start, progress)
    filled = slerp(rotations, landmarks.time[used], landmarks.time)
    return PosePrior(filled, landmarks.tracked.copy(), landmarks.time, source=landmarks.source)


def _fit(
    body: Body, points: Points, target: np.ndarray, time: np.ndarray, state: State, progress: Progress
) -> np.ndarray:
    frames = len(target)
    surface = Surface(points.rest, np.zeros_like(points.rest))
    none = np.zeros((frames, 0))
    for round_ in range(_ROUNDS):
        progress(round_ / _ROUNDS, "lifting landmarks to joint rotations")
        course = _smoothed(state.pose.rotations, time) if round_ else state.pose.rotations
        weights = _WEIGHTS if round_ else replace(_WEIGHTS, prior_deg=90.0, root_deg=90.0)
        seen = Observations(target, course, np.ones(frames, bool), none[..., None].repeat(2, -1), none, (0, 0))
        problem = Problem(body, seen, Points.none(body.shape_count))
        steps, damping = (8 if not round_ else 2), 1e-3
        cost = problem.energies(state, weights, surface).total
        for _ in range(steps):
            trial = problem.step(state, weights, surface, damping)
            trial_cost = problem.energies(trial, weights, surface).total
            if trial_cost < cost:
                state, cost, damping = trial, trial_cost, damping * 0.3
            else:
                damping *= 10
    return state.pose.rotations


def _start(body: Body, points: Points, column: np.ndarray, target: np.ndarray) -> State:
    """Trunk by registration, limbs by the shortest turn onto their landmarks."""
    name_at = {LANDMARKS[c]: i for i, c in enumerate(column)}
    trunk = [name_at[n] for n in ("left_hip", "right_hip", "left_shoulder", "right_shoulder")]
    frames = len(target)
    rest, joints = points.rest, body.joint_template
    centre = target[:, trunk].mean(axis=1)
    source = np.broadcast_to(rest[trunk] - rest[trunk].mean(0), (frames, len(trunk), 3))
    # Landmarks that were not seen in a frame must not turn its trunk.
    root = kabsch(source, np.nan_to_num(target[:, trunk] - centre[:, None]))
    rotations = np.repeat(anatomical.mean_pose()[None], frames, axis=0)
    rotations[:, 0] = root
    trans = centre - np.einsum("nij,j->ni", root, rest[trunk].mean(0) - joints[0]) - joints[0]
    for side in ("left", "right"):
        for joint, child in (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist")):
            j, c = INDEX[f"{side}_{joint}"], INDEX[f"{side}_{child}"]
            turn, _ = chain(rotations, joints, trans)
            ends = target[:, name_at[f"{side}_{child}"]] - target[:, name_at[f"{side}_{joint}"]]
            wanted = np.einsum("nji,nj->ni", turn[:, PARENTS[j]], np.nan_to_num(ends))
            rotations[:, j] = _shortest_turn(joints[c] - joints[j], wanted)
    pose = Pose(rotations, trans, np.zeros(body.shape_count))
    return State(pose, points, Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0))


def _shortest_turn(source: np.ndarray, target: np.ndarray) -> np.ndarray:
    """(N, 3, 3) rotations that turn one direction (3,) into others (N, 3) the shortest way."""
    from markerscope.solver.core.rotations import exp_so3

    a = source / np.linalg.norm(source)
    b = target / np.maximum(np.linalg.norm(target, axis=1, keepdims=True), 1e-9)
    axis = np.cross(a, b)
    sine, cosine = np.linalg.norm(axis, axis=1, keepdims=True), (b @ a)[:, None]
    return exp_so3(axis / np.maximum(sine, 1e-9) * np.arctan2(sine, cosine))


def _smoothed(rotations: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Rotations (F, 24, 3, 3) averaged over a short Gaussian window, as matrices put back on SO(3)."""
    from scipy.ndimage import gaussian_filter1d

    step = float(np.median(np.diff(time))) if len(time) > 1 else 1.0
    mean = gaussian_filter1d(rotations, max(_SMOOTH_S / step, 0.5), axis=0, mode="nearest")
    u, _, vt = np.linalg.svd(mean)
    u[..., :, 2] *= np.sign(np.linalg.det(u @ vt))[..., None]
    return u @ vt
