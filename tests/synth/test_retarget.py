"""Motion files on our body: directions kept, joints bent the way they bend, soles on the floor."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS
from markerscope.solver.io.asf_amc import read_asf_amc
from markerscope.solver.io.bvh import read_bvh
from markerscope.solver.io.motion import SkeletonMotion
from markerscope.solver.synth.demo_motion import demo_motion
from markerscope.solver.synth.retarget import match_joints, retarget

FILES = (
    "cmu/02_01.amc",
    "cmu/02_05.amc",
    "bandai/dataset-1_kick_normal_001.bvh",
    "bandai/dataset-1_bow_normal_001.bvh",
)
LIMBS = (("hip", "knee"), ("knee", "ankle"), ("shoulder", "elbow"), ("elbow", "wrist"))


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


def read(path: Path) -> SkeletonMotion:
    return read_bvh(path) if path.suffix == ".bvh" else read_asf_amc(path.with_name("02.asf"), path)


def directions(places: np.ndarray, index: dict[str, int]) -> np.ndarray:
    """(T, 8, 3) of the limbs."""
    bones = [
        places[:, index[f"{side}_{b}"]] - places[:, index[f"{side}_{a}"]]
        for side in ("left", "right")
        for a, b in LIMBS
    ]
    stacked = np.stack(bones, axis=1)
    return stacked / np.linalg.norm(stacked, axis=2, keepdims=True)


def check(source: SkeletonMotion, body: Body) -> None:
    betas = np.zeros(body.shape_count)
    motion = retarget(source, body, betas)
    _, joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)
    theirs = directions(source.joint_positions(), match_joints(source))
    off = np.degrees(np.arccos(np.clip(np.sum(theirs * directions(joints, INDEX), axis=2), -1, 1)))
    assert off.max() < 1, f"a limb is {off.max():.1f} degrees off"
    step = np.degrees(np.linalg.norm(log_so3(motion.rotations[:-1].swapaxes(2, 3) @ motion.rotations[1:]), axis=2))
    fastest = step.max() * motion.rate
    assert fastest < 2500, f"{JOINTS[step.max(0).argmax()]} turns by {fastest:.0f} degrees a second: it flips"
    for side, sign in (("left", -1), ("right", 1)):
        knee = log_so3(motion.rotations[:, INDEX[f"{side}_knee"]])
        elbow = log_so3(motion.rotations[:, INDEX[f"{side}_elbow"]])
        assert np.degrees(knee[:, 0]).min() > -15, (
            f"the {side} knee bends forward by {-np.degrees(knee[:, 0].min()):.0f}"
        )
        assert np.degrees(sign * elbow[:, 1]).min() > -15, f"the {side} elbow bends backward"
    soles = joints[:, [INDEX["left_ankle"], INDEX["right_ankle"]], 2].min(axis=1)
    ankle = body.joints(betas)[INDEX["left_ankle"], 1] - body.surface(betas)[:, 1].min()
    assert abs(np.median(soles) - ankle) < 0.06, f"the lower ankle is {np.median(soles):.2f} m high, for {ankle:.2f} m"
    up = joints[:, INDEX["neck"]] - joints[:, [1, 2]].mean(axis=1)
    assert np.median(up[:, 2]) > 0.4


@pytest.mark.parametrize("name", FILES)
def test_limbs_point_where_the_source_s_do(name: str, body: Body, shared_data: Path) -> None:
    if not (shared_data / "motion" / name).exists():
        pytest.skip("the motion files are not there")
    check(read(shared_data / "motion" / name), body)


def as_source(body: Body, turned_rest: bool) -> tuple[SkeletonMotion, np.ndarray]:
    """Our own motion as a file would hold it, in its own rest pose or with arbitrary axes in every joint."""
    betas = np.zeros(body.shape_count)
    motion = demo_motion(body, betas, seconds=9, rate=30)
    rest = body.joints(betas)
    offsets = rest - np.where(PARENTS[:, None] >= 0, rest[PARENTS], 0)
    axes = exp_so3(np.random.default_rng(1).normal(0, 1.5, (24, 3))) if turned_rest else np.tile(np.eye(3), (24, 1, 1))
    above = np.where(PARENTS[:, None, None] >= 0, axes[PARENTS], np.eye(3))
    offsets = np.einsum("jba,jb->ja", above, offsets)
    rotations = above.swapaxes(1, 2) @ motion.rotations @ axes
    translations = np.broadcast_to(offsets, (len(rotations), 24, 3)).copy()
    translations[:, 0] = rest[0] + motion.trans
    source = SkeletonMotion(tuple(JOINTS), PARENTS, offsets, np.zeros((24, 3)), rotations, translations, 30.0)
    return source, motion.rotations


@pytest.mark.parametrize("turned_rest", [False, True])
def test_our_own_motion_comes_back_whatever_the_rest_pose(turned_rest: bool, body: Body) -> None:
    source, truth = as_source(body, turned_rest)
    check(source, body)
    found = retarget(source, body, np.zeros(body.shape_count)).rotations
    off = np.degrees(np.linalg.norm(log_so3(found.swapaxes(2, 3) @ truth), axis=2)).mean(axis=0)
    legs = [INDEX[f"{side}_{name}"] for side in ("left", "right") for name in ("hip", "knee", "ankle")]
    assert off[legs].max() < 12, dict(zip(JOINTS, off.round(1)))
    assert off[0] < 8, f"the pelvis is {off[0]:.1f} degrees off"


def test_the_frame_rate_is_changed_over_the_same_time(body: Body) -> None:
    source, _ = as_source(body, False)
    slow = retarget(source, body, np.zeros(10), rate=10)
    assert slow.rate == 10
    assert len(slow.trans) == 90
    np.testing.assert_allclose(slow.trans[7], retarget(source, body, np.zeros(10)).trans[21], atol=1e-9)


def test_an_unknown_skeleton_is_refused_in_one_sentence(body: Body) -> None:
    source, _ = as_source(body, False)
    with pytest.raises(InputError, match="no joint known as left hip"):
        retarget(replace(source, names=tuple(f"bone{i}" for i in range(24))), body, np.zeros(10))
