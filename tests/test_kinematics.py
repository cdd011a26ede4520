"""Analytic derivatives against finite differences, and against the body's own forward pass."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, kabsch, log_so3, right_jacobian_inverse, slerp
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points, pose_jacobian, shape_jacobian


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture
def posed(body: Body) -> tuple[Pose, Points]:
    rng = np.random.default_rng(3)
    pose = Pose(exp_so3(rng.normal(0, 0.5, (4, 24, 3))), rng.normal(0, 1, (4, 3)), rng.normal(0, 1, body.shape_count))
    return pose, Points.of_vertices(body, rng.choice(len(body.template), 9, replace=False))


def test_points_follow_the_body(body: Body, posed: tuple[Pose, Points]) -> None:
    pose, _ = posed
    chosen = np.array([5, 300, 900])
    mine = place_points(Points.of_vertices(body, chosen), forward(body, pose), pose.betas)
    theirs, _ = body.pose(pose.rotations, pose.betas, pose.trans, chosen)
    assert np.abs(mine - theirs).max() < 1e-9


def test_pose_jacobian_is_the_finite_difference(body: Body, posed: tuple[Pose, Points]) -> None:
    pose, points = posed
    joints = np.arange(24)
    jacobian = pose_jacobian(points, forward(body, pose), pose.betas, joints)
    step, worst = 1e-6, 0.0
    for column in range(24 * 3 + 3):
        moved = []
        for sign in (1, -1):
            delta = np.zeros(75)
            delta[column] = sign * step
            turned = pose.rotations @ exp_so3(delta[:72].reshape(24, 3))
            moved.append(
                place_points(points, forward(body, Pose(turned, pose.trans + delta[72:], pose.betas)), pose.betas)
            )
        worst = max(worst, np.abs((moved[0] - moved[1]) / (2 * step) - jacobian[..., column]).max())
    assert worst < 1e-7, f"worst column is off by {worst:.2e} m per unit"


def test_shape_jacobian_is_the_finite_difference(body: Body, posed: tuple[Pose, Points]) -> None:
    pose, points = posed
    jacobian = shape_jacobian(body, points, forward(body, pose))
    for column in range(body.shape_count):
        moved = []
        for sign in (1, -1):
            betas = pose.betas + sign * 1e-5 * np.eye(body.shape_count)[column]
            moved.append(place_points(points, forward(body, Pose(pose.rotations, pose.trans, betas)), betas))
        error = np.abs((moved[0] - moved[1]) / 2e-5 - jacobian[..., column]).max()
        assert error < 1e-8, f"shape {column} is off by {error:.2e} m per unit"


def test_numpy_and_torch_agree_and_torch_differentiates(body: Body, posed: tuple[Pose, Points]) -> None:
    torch = pytest.importorskip("torch")
    pose, _ = posed
    tensors = [torch.tensor(v, requires_grad=True) for v in (pose.rotations, pose.betas, pose.trans)]
    vertices, joints = body.pose(*tensors, vertices=np.array([1, 2, 3]))
    plain, plain_joints = body.pose(pose.rotations, pose.betas, pose.trans, np.array([1, 2, 3]))
    assert np.abs(vertices.detach().numpy() - plain).max() < 1e-9
    assert np.abs(joints.detach().numpy() - plain_joints).max() < 1e-9
    vertices.sum().backward()
    assert np.allclose(tensors[2].grad.numpy(), 3), "each of three vertices moves with the translation"


def test_right_jacobian_inverse_is_the_finite_difference() -> None:
    rng = np.random.default_rng(1)
    vector = rng.normal(0, 0.8, (20, 3))
    base, inverse = exp_so3(vector), right_jacobian_inverse(vector)
    for axis in range(3):
        step = 1e-6 * np.eye(3)[axis]
        difference = (log_so3(base @ exp_so3(step)) - log_so3(base @ exp_so3(-step))) / 2e-6
        assert np.abs(difference - inverse[..., axis]).max() < 1e-6


def test_kabsch_recovers_a_rotation_and_refuses_a_reflection() -> None:
    rng = np.random.default_rng(2)
    truth = exp_so3(rng.normal(0, 1, (5, 3)))
    cloud = rng.normal(0, 1, (5, 8, 3))
    assert np.abs(kabsch(cloud, cloud @ np.swapaxes(truth, 1, 2)) - truth).max() < 1e-12
    mirrored = kabsch(cloud, cloud * [1, 1, -1])
    assert np.allclose(np.linalg.det(mirrored), 1)


def test_slerp_is_constant_in_speed_and_holds_the_ends() -> None:
    ends = exp_so3(np.array([[[0.0, 0, 0]], [[0, 0, 1.2]]]))
    found = log_so3(slerp(ends, np.array([1.0, 3.0]), np.array([0.0, 1.0, 1.5, 2.0, 9.0])))[:, 0, 2]
    assert np.allclose(found, [0, 0, 0.3, 0.6, 1.2])
