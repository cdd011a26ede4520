"""Bone lengths as shape coefficients: joints and skin go where a longer bone takes them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import MODES, BoneMode, load_body, with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, JOINTS, descendants, mirror_index


@pytest.fixture(scope="module")
def bodies() -> tuple[Body, Body]:
    own = Body.load()
    return own, with_bone_lengths(own)


def unit(bodies: tuple[Body, Body], mode: BoneMode) -> tuple[np.ndarray, np.ndarray]:
    """(V, 3) and (24, 3) m moved by a unit coefficient."""
    own, longer = bodies
    betas = np.zeros(longer.shape_count)
    betas[own.betas_count + MODES.index(mode)] = 1
    return longer.surface(betas) - own.template, longer.joints(betas) - own.joint_template


@pytest.mark.parametrize("mode", MODES, ids=lambda mode: mode.name)
def test_each_bone_grows_by_its_share_along_itself_and_no_other_does(bodies: tuple[Body, Body], mode: BoneMode) -> None:
    own = bodies[0].joint_template
    moved = own + unit(bodies, mode)[1]
    grown = {(INDEX[a], INDEX[b]) for a, b in mode.bones}
    parents = [0, 0, 0, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 9, 9, 12, 13, 14, 16, 17, 18, 19, 20, 21]
    for child in range(1, len(JOINTS)):
        before, after = own[child] - own[parents[child]], moved[child] - moved[parents[child]]
        share = 1 + mode.share if (parents[child], child) in grown else 1.0
        np.testing.assert_allclose(after, share * before, atol=1e-12, err_msg=f"{mode.name}: {JOINTS[child]}")
    np.testing.assert_array_equal(moved[0], own[0])


@pytest.mark.parametrize(("kind", "joint", "child"), [("thigh", "hip", "knee"), ("forearm", "elbow", "wrist")])
def test_skin_of_a_longer_bone_is_stretched_and_beyond_it_moves_whole(
    bodies: tuple[Body, Body], kind: str, joint: str, child: str
) -> None:
    own = bodies[0]
    mode = next(mode for mode in MODES if mode.name == kind)
    skin, _ = unit(bodies, mode)
    j, c = INDEX[f"left_{joint}"], INDEX[f"left_{child}"]
    bone = own.joint_template[c] - own.joint_template[j]
    along = (own.template - own.joint_template[j]) @ bone / (bone @ bone)
    on_bone = (own.weights[:, j] > 0.99) & (along > 0.05) & (along < 0.95)
    beyond = own.weights[:, descendants()[c]].sum(axis=1) > 0.999
    above = own.weights[:, INDEX["head"]] > 0.999
    assert min(on_bone.sum(), beyond.sum(), above.sum()) > 10, (on_bone.sum(), beyond.sum(), above.sum())
    np.testing.assert_allclose(skin[on_bone], along[on_bone, None] * mode.share * bone, atol=2e-4)
    np.testing.assert_allclose(skin[beyond], np.tile(mode.share * bone, (beyond.sum(), 1)), atol=2e-4)
    np.testing.assert_allclose(skin[above], 0, atol=1e-12)


def test_both_sides_grow_alike(bodies: tuple[Body, Body]) -> None:
    for mode in MODES:
        _, joints = unit(bodies, mode)
        np.testing.assert_allclose(joints[mirror_index()], joints * [-1, 1, 1], atol=2e-4, err_msg=mode.name)


def test_a_body_to_be_fitted_is_loaded_in_one_place(bodies: tuple[Body, Body]) -> None:
    own, longer = bodies
    assert load_body().shape_count == longer.shape_count == own.shape_count + len(MODES)
    root = Path(__file__).parents[2]
    copies = [
        str(path.relative_to(root))
        for room in ("app", "benchmarks", "resources", "solver", "tools", "widgets")
        for path in (root / room).rglob("*.py")
        if "with_bone_lengths(Body.load(" in path.read_text(encoding="utf-8") and path.name != "bones.py"
    ]
    assert copies == []
