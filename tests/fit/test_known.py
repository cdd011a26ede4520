"""A known person found in single frames of unlabelled points, wherever they stand and whatever else is seen."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.known.body import KnownBody, known_body
from markerscope.solver.fit.known.find import find
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.results import FittedMotion
from tests.fit.conftest import simulate

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])


def fitted(seed: int, markers: int = 40) -> tuple[Body, Points, FittedMotion]:
    """A trial as a perfect fit would have it, and where its markers truly are on the body."""
    body = with_bone_lengths(Body.load())
    scene = simulate(body, seed, markers=markers)
    skin = Skin(body, scene.pose.betas)
    rng = np.random.default_rng(seed)
    vertices = rng.choice(skin.index, markers, replace=False)
    placement, _ = skin.on_vertices(vertices, 0.0095)
    seen = place_points(placement, forward(body, scene.pose), scene.pose.betas)
    camera = CameraResult(np.eye(3), np.zeros(3), 1.0, (0, 0), float("nan"))
    sites = (body.weights[vertices].argmax(1), vertices)
    time = np.arange(len(seen)) / 15
    motion = motion_from(body, seen, time, scene.pose, np.arange(markers), placement, sites, camera=camera)
    return body, placement, motion


@pytest.fixture(scope="module")
def person() -> tuple[Body, Points, FittedMotion, KnownBody]:
    body, placement, motion = fitted(11)
    return body, placement, motion, known_body(body, motion)


def standing(body: Body, placement: Points, betas: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """(U, 3) m of a person who stands anywhere, facing anywhere, near a relaxed pose; and the pose."""
    rng = np.random.default_rng(seed)
    rotations = anatomical.mean_pose() @ exp_so3(np.radians(6) * rng.normal(0, 1, (24, 3)))
    rotations[0] = exp_so3(np.array([0, 0, rng.uniform(0, 2 * np.pi)])) @ UPRIGHT
    pose = Pose(rotations[None], rng.uniform(-3, 3, (1, 3)), betas)
    return place_points(placement, forward(body, pose), betas)[0], rotations


def test_where_markers_sit_is_read_off_a_fit(person: tuple[Body, Points, FittedMotion, KnownBody]) -> None:
    body, placement, motion, known = person
    off = known.placement.shaped(motion.betas) - placement.shaped(motion.betas)
    assert np.linalg.norm(off, axis=1).max() < 1e-6
    pose = Pose(motion.rotations[7:8], motion.trans[7:8], motion.betas)
    again = place_points(known.placement, forward(body, pose), motion.betas)[0]
    assert np.allclose(again, motion.placed[7], atol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_a_person_is_found_from_any_heading(seed: int, person: tuple[Body, Points, FittedMotion, KnownBody]) -> None:
    body, placement, motion, known = person
    points, rotations = standing(body, placement, motion.betas, seed)
    order = np.random.default_rng(seed).permutation(len(points))
    found = find(body, known, points[order])
    assert (order[found.match] == np.arange(len(points))).all()
    assert 1000 * np.nanmedian(found.residual) < 2, f"{1000 * np.nanmedian(found.residual):.1f} mm (synthetic)"
    assert found.next_cost > 2 * found.cost
    turn = found.rotations[0].T @ rotations[0]
    assert np.degrees(np.arccos(np.clip((np.trace(turn) - 1) / 2, -1, 1))) < 4


def test_points_may_be_missing_and_others_be_there(person: tuple[Body, Points, FittedMotion, KnownBody]) -> None:
    body, placement, motion, known = person
    points, _ = standing(body, placement, motion.betas, 9)
    rng = np.random.default_rng(9)
    gone, lost = rng.choice(len(points), 5, replace=False), rng.choice(len(points), 2, replace=False)
    seen = np.setdiff1d(np.arange(len(points)), gone)
    others = points.mean(axis=0) + rng.uniform(0.6, 1.2, (4, 3))
    given = np.concatenate([points[seen], others])
    given[np.isin(np.r_[seen, [-1] * 4], lost)] = np.nan
    found = find(body, known, given)
    truth = np.full(len(points), -1)
    truth[seen] = np.arange(len(seen))
    truth[lost] = -1
    assert (found.match == truth).all()
    assert np.isnan(found.residual[gone]).all()


def test_another_person_fits_worse(person: tuple[Body, Points, FittedMotion, KnownBody]) -> None:
    body, placement, motion, known = person
    own, _ = standing(body, placement, motion.betas, 3)
    other = motion.betas.copy()
    other[:3] += np.array([2.5, -2.0, 1.5])
    theirs, _ = standing(body, placement, other, 3)
    assert find(body, known, theirs).cost > 4 * find(body, known, own).cost
