"""The shape that a video's reconstruction comes with: a prior on a body of its kind, and nothing on another."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.fit.observe import observe
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.state import State, Weights
from tests.fit.conftest import Scene, simulate

SHAPE = np.array([1.5, -1.0, 0.5, 0, 0, 0.75, 0, 0, 0, 1.0])


def smpl_file(folder: Path) -> Path:
    """The embedded body's surface as an SMPL file, 10 shape coefficients."""
    body = Body.load()
    regressor = np.zeros((24, len(body.template)))
    for j, centre in enumerate(body.joint_template):
        regressor[j, np.argsort(np.linalg.norm(body.template - centre, axis=1))[:8]] = 1 / 8
    from markerscope.solver.core.skeleton import PARENTS

    tree = np.stack([np.where(PARENTS < 0, 2**32 - 1, PARENTS), np.arange(24)]).astype(np.int64)
    np.savez(
        folder / "SMPL_NEUTRAL.npz",
        v_template=body.template,
        shapedirs=body.shape_dirs[..., :10],
        J_regressor=regressor,
        weights=body.weights,
        f=body.faces,
        kintree_table=tree,
    )
    return folder / "SMPL_NEUTRAL.npz"


@pytest.fixture(scope="module")
def smpl(tmp_path_factory: pytest.TempPathFactory) -> Body:
    return with_bone_lengths(Body.load(smpl_file(tmp_path_factory.mktemp("smpl"))))


def seen_by(scene: Scene, body: Body, kind: str, betas: np.ndarray | None = SHAPE) -> np.ndarray | None:
    frames = len(scene.seen.markers)
    prior = PosePrior(scene.seen.prior, scene.seen.tracked, np.arange(frames) / 15, betas, kind=kind)
    markers = Markers(scene.seen.markers, 15.0, tuple(f"m{i}" for i in range(scene.seen.markers.shape[1])))
    return observe(markers, prior, None, body, 0.0, 1.0)[0].shape


def test_it_is_used_on_a_body_of_its_kind_alone(scene: Scene, smpl: Body) -> None:
    assert smpl.kind == "smpl" and scene.body.kind == ""
    found = seen_by(scene, smpl, "smpl")
    assert found is not None and np.array_equal(found, SHAPE)
    for body, kind in ((scene.body, "smpl"), (smpl, "smplx"), (smpl, "")):
        assert seen_by(scene, body, kind) is None
    assert seen_by(scene, smpl, "smpl", None) is None


def test_it_moves_what_the_markers_do_not_hold(smpl: Body) -> None:
    """A step from the mean shape, markers hardly counting: to the video's shape; bone lengths stay."""
    scene = simulate(smpl, 3, frames=6, markers=12)
    placement, surface = Skin(smpl, np.zeros(smpl.shape_count)).on_vertices(np.arange(12) * 50, 0.0095)
    state = State(replace(scene.pose, betas=np.zeros(smpl.shape_count)), placement, scene.camera)
    weights = Weights(marker=1e3, image=1e6, offset_spread=1e3)
    told = Problem(smpl, replace(scene.seen, shape=SHAPE), scene.landmarks)
    stepped = told.step(told.step(state, weights, surface, 0.0), weights, surface, 0.0)
    assert np.abs(stepped.pose.betas[:10] - SHAPE).max() < 0.01
    assert np.abs(stepped.pose.betas[10:]).max() < 0.01
    blind = Problem(smpl, scene.seen, scene.landmarks)
    assert np.abs(blind.step(state, weights, surface, 0.0).pose.betas).max() < 0.01


def test_its_cost_counts_by_the_spread_that_is_stated(smpl: Body) -> None:
    scene = simulate(smpl, 3, frames=6, markers=12)
    placement, surface = Skin(smpl, np.zeros(smpl.shape_count)).on_vertices(np.arange(12) * 50, 0.0095)
    off = np.concatenate([SHAPE + 0.35, np.full(smpl.shape_count - 10, 0.5)])
    state = State(replace(scene.pose, betas=off), placement, scene.camera)
    weights = Weights(video_shape=0.7)
    told = Problem(smpl, replace(scene.seen, shape=SHAPE), scene.landmarks).energies(state, weights, surface)
    assert told["shape"] == pytest.approx(10 * (0.35 / 0.7) ** 2 + (smpl.shape_count - 10) * 0.25)
