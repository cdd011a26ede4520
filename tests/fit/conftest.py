"""A small synthetic session on the embedded body: known poses, markers on the skin, a camera and a poor video."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.lift import landmark_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.state import Camera, Observations


@dataclass(frozen=True)
class Scene:
    """What was simulated, and what a solver is given of it."""

    body: Body
    pose: Pose
    joints: np.ndarray
    bones: np.ndarray
    camera: Camera
    seen: Observations
    landmarks: Points


def simulate(body: Body, seed: int, frames: int = 60, markers: int = 36, only: str | None = None) -> Scene:
    """Smooth random limbs about a relaxed pose, random markers, a video 8 degrees off on every joint."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 4, frames)
    swing = np.zeros((frames, 24, 3))
    for joint, axis, reach in (
        ("left_hip", 0, 40), ("right_hip", 0, 40), ("left_knee", 0, 50), ("right_knee", 0, 50), ("left_ankle", 0, 20),
        ("right_ankle", 0, 20), ("spine1", 0, 12), ("spine3", 1, 15), ("left_shoulder", 2, 30),
        ("right_shoulder", 2, 30), ("left_elbow", 1, 35), ("right_elbow", 1, 35),
    ):  # fmt: skip
        phase, speed = rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 4)
        swing[:, INDEX[joint], axis] = np.radians(reach) * np.sin(speed * time + phase)
    rotations = anatomical.mean_pose() @ exp_so3(swing)
    upright = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    heading = exp_so3(np.stack([0 * time, 0 * time, rng.uniform(0, 6) + 0.3 * np.sin(time)], 1))
    rotations[:, 0] = heading @ upright
    betas = rng.normal(0, 0.7, body.shape_count)
    trans = np.stack([0.3 * np.sin(time), 0.2 * time, 0.95 + 0.05 * np.cos(2 * time)], 1)
    pose = Pose(rotations, trans, betas)
    links = forward(body, pose)
    skin = Skin(body, betas)
    pool = skin.index if only is None else skin.index[body.weights[skin.index].argmax(1) == INDEX[only]]
    vertices = rng.choice(pool, markers, replace=False)
    placement, _ = skin.on_vertices(vertices, 0.0095)
    positions = place_points(placement, links, betas) + rng.normal(0, 0.001, (frames, markers, 3))
    positions[rng.random((frames, markers)) < 0.05] = np.nan
    view = exp_so3(np.array([0.0, 0, rng.uniform(0, 6)])) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    view = view @ exp_so3(np.array([0.1, 0.0, 0.03]))
    camera = Camera(view, np.array([0.1, 0.1, 4.0]), np.array([0.0, 0.4, 0.9]), 900.0)
    points, _ = landmark_points(body)
    image = camera.project(place_points(points, links, betas), (720, 960)) + rng.normal(
        0, 4, (frames, len(points.rest), 2)
    )
    prior = rotations @ exp_so3(np.radians(6) * rng.normal(0, 1, (24, 3)) / np.sqrt(3) * np.ones((frames, 1, 1)))
    prior = prior @ exp_so3(np.radians(5) * rng.normal(0, 1, (frames, 24, 3)) / np.sqrt(3))
    prior[:, 0] = view.T @ prior[:, 0]
    seen = Observations(positions, prior, np.ones(frames, bool), image, np.ones(image.shape[:2]), (720, 960))
    return Scene(body, pose, links.place, body.weights[vertices].argmax(1), camera, seen, points)


def drawn_vertices(body: Body, bones: np.ndarray, seed: int) -> np.ndarray:
    """The vertices that ``simulate`` draws for the same seed and number of markers."""
    rng = np.random.default_rng(seed)
    for _ in range(12):
        rng.uniform(0, 2 * np.pi), rng.uniform(1.5, 4)
    rng.uniform(0, 6)
    rng.normal(0, 0.7, body.shape_count)
    index = np.flatnonzero(body.marker_mask)
    vertices = rng.choice(index, len(bones), replace=False)
    assert np.array_equal(body.weights[vertices].argmax(1), bones)
    return vertices


@pytest.fixture(scope="session")
def free_body() -> Body:
    return with_bone_lengths(Body.load())


@pytest.fixture(scope="session")
def scene(free_body: Body) -> Scene:
    return simulate(free_body, 4)
