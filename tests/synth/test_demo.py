"""The generator of known sessions, and the embedded session that it made."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.resources import resource
from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.sync.offset import find_offset
from markerscope.solver.synth import (
    MARKERS_PER_BONE,
    Corruption,
    Motion,
    Placement,
    corrupt,
    demo_motion,
    marker_paths,
    place_markers,
    vary_body,
)
from markerscope.solver.synth.truth import Truth, load_truth
from markerscope.solver.video.blazepose import track_pose
from markerscope.solver.video.flips import mend_flips
from markerscope.solver.video.frames import index_video
from tools.make_demo import session


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def made(body: Body) -> tuple[Body, np.ndarray, Motion, Placement, np.ndarray]:
    rng = np.random.default_rng(5)
    varied, betas = vary_body(body, rng), rng.normal(0, 0.8, body.shape_count)
    motion, placement = demo_motion(varied, betas, seed=5), place_markers(varied, betas, rng)
    return varied, betas, motion, placement, marker_paths(varied, betas, motion, placement)


@pytest.fixture(scope="module")
def truth() -> Truth:
    return load_truth()


@pytest.fixture(scope="module")
def demo_landmarks() -> Landmarks:
    return track_pose(resource("demo", "video.mp4"), rate=10)


def test_feet_stand_on_the_floor_and_stay_there(made) -> None:
    varied, betas, motion, *_ = made
    feet = np.flatnonzero(varied.weights[:, [INDEX["left_ankle"], INDEX["right_ankle"]]].sum(axis=1) > 0.9)
    skin, joints = varied.pose(motion.rotations, betas, motion.trans, feet)
    lowest = skin[:, :, 2].min(axis=1)
    assert np.abs(lowest).max() < 0.015, f"the lowest sole is {1000 * np.abs(lowest).max():.0f} mm off the floor"
    speed = (
        np.linalg.norm(np.diff(joints[:, [INDEX["left_ankle"], INDEX["right_ankle"]]], axis=0), axis=2) * motion.rate
    )
    assert np.median(speed, axis=0).max() < 0.02, "the feet slide while they stand"
    assert (speed.min(axis=1) < 0.25).mean() > 0.97, "at hardly any time both feet are in the air"


def test_the_motion_is_smooth_human_and_long_enough(made) -> None:
    varied, betas, motion, *_ = made
    _, joints = varied.pose(motion.rotations, betas, motion.trans, want_vertices=False)
    acceleration = np.linalg.norm(np.diff(joints, 2, axis=0), axis=2) * motion.rate**2
    assert acceleration.max() < 90, f"{JOINTS[acceleration.max(axis=0).argmax()]}: {acceleration.max():.0f} m/s^2"
    assert motion.time[-1] > 9.9
    pelvis = joints[:, 0]
    assert np.ptp(pelvis[:, 0]) > 1.5, "it does not walk"
    forward = motion.rotations[:, 0, :, 2]
    heading = np.unwrap(np.arctan2(forward[:, 1], forward[:, 0]))
    assert np.ptp(heading) > 1.2, "it does not turn"
    assert joints[:, INDEX["head"], 2].min() < 0.75 * joints[0, INDEX["head"], 2], "it does not bend"
    for side in ("left", "right"):
        knee = log_so3(motion.rotations[:, INDEX[f"{side}_knee"]])
        assert np.degrees(knee[:, 0]).min() > 0, "a knee bends forward"
        assert 75 < np.degrees(knee[:, 0]).max() < 140


def test_the_body_cannot_be_reached_by_shape_coefficients(body: Body) -> None:
    varied = vary_body(body, np.random.default_rng(2))
    change = (varied.template - body.template).reshape(-1)
    basis = body.shape_dirs.reshape(len(change), -1)
    rest = (change - basis @ np.linalg.lstsq(basis, change, rcond=None)[0]).reshape(-1, 3)
    rest -= rest.mean(axis=0)
    assert 0.003 < np.sqrt((rest**2).sum(axis=1).mean()) < 0.03
    lengths = [
        np.linalg.norm(b.joint_template[INDEX["left_knee"]] - b.joint_template[INDEX["left_ankle"]])
        for b in (body, varied)
    ]
    assert abs(lengths[1] / lengths[0] - 1) > 0.002


def test_a_varied_body_is_posed_anew_in_torch(body: Body) -> None:
    """The cache of tensors must not travel with the copy."""
    torch = pytest.importorskip("torch")
    eye, zero = torch.eye(3, dtype=torch.float64).expand(1, 24, 3, 3), torch.zeros(1, 3, dtype=torch.float64)
    betas = torch.zeros(body.shape_count, dtype=torch.float64)
    body.pose(eye, betas, zero)
    varied = vary_body(body, np.random.default_rng(2))
    posed = varied.pose(eye, betas, zero)[0].numpy()[0]
    np.testing.assert_allclose(posed, varied.template, atol=1e-9)


def test_markers_cover_every_bone_and_sit_above_the_skin(made) -> None:
    varied, betas, motion, placement, paths = made
    assert 36 <= len(placement.vertex) <= 45 and len(set(placement.vertex)) == len(placement.vertex)
    for name, count in MARKERS_PER_BONE.items():
        assert (placement.joint == INDEX[name]).sum() == count
    frames = [0, 250, 720]
    skin, _ = varied.pose(motion.rotations[frames], betas, motion.trans[frames])
    for shown, markers in zip(skin, paths[frames], strict=True):
        own = np.linalg.norm(markers - shown[placement.vertex], axis=1)
        assert np.abs(own - placement.height).max() < 0.001
    standing = np.linalg.norm(paths[0, :, None] - skin[0], axis=2).min(axis=1)  # bent, a fold of skin may touch one
    assert standing.min() > 0.002, "a marker is inside the body"


def test_nothing_corrupted_is_only_shuffled(made) -> None:
    varied, betas, motion, placement, paths = made
    clean = Corruption(slide=0, jitter=0, lost=0)
    markers, order = corrupt(paths, varied, betas, motion, placement, np.random.default_rng(1), clean)
    np.testing.assert_allclose(markers.positions, paths[:, order], atol=1e-12)
    assert sorted(order) == list(range(paths.shape[1])) and not (order == np.arange(len(order))).all()


def test_corruption_has_the_size_it_says(made) -> None:
    varied, betas, motion, placement, paths = made
    settings = Corruption(lost=0.08)
    markers, order = corrupt(paths, varied, betas, motion, placement, np.random.default_rng(1), settings)
    lost = ~markers.present
    assert 0.08 <= lost.mean() < 0.11
    edges = np.diff(np.concatenate([np.zeros((1, lost.shape[1])), lost, np.zeros((1, lost.shape[1]))]), axis=0)
    lengths = np.concatenate(
        [np.flatnonzero(edges[:, m] < 0) - np.flatnonzero(edges[:, m] > 0) for m in range(lost.shape[1])]
    )
    assert np.median(lengths) < 10 and lengths[lengths >= 40].sum() > 0.5 * lengths.sum(), "the tail is not heavy"
    error = np.linalg.norm(markers.positions - paths[:, order], axis=2)
    assert 0.001 < np.nanmedian(error) < 0.005 and np.nanmax(error) < 0.05
    turns, _ = chain(motion.rotations, varied.joints(betas), motion.trans)
    bone = np.einsum("tmba,tmb->tma", turns[:, placement.joint[order]], markers.positions - paths[:, order])
    step = np.nanmedian(np.abs(np.diff(bone, axis=0)))
    assert step < 0.001, f"skin slides by {1000 * step:.2f} mm a frame: not slow"


def test_the_same_seed_gives_the_embedded_session(truth: Truth) -> None:
    markers, fresh = session()
    stored = load_markers(resource("demo", "session.c3d"))
    assert stored.rate == 100 and stored.labels == markers.labels
    np.testing.assert_allclose(stored.positions, markers.positions, atol=2e-6)
    np.testing.assert_allclose(truth.joints, fresh.joints, atol=2e-5)
    np.testing.assert_array_equal(truth.marker_vertex, fresh.marker_vertex)
    total = sum(file.stat().st_size for file in resource("demo").iterdir())
    assert total < 2_000_000, f"{total} bytes"


def test_the_markers_lie_on_the_true_body(truth: Truth) -> None:
    stored: Markers = load_markers(resource("demo", "session.c3d"))
    frames = np.arange(0, len(stored.positions), 50)
    skin = truth.body.pose(
        truth.motion.rotations[frames], truth.betas, truth.motion.trans[frames], truth.marker_vertex
    )[0]
    away = np.linalg.norm(stored.positions[frames] - skin, axis=2)
    assert 0.008 < np.nanmedian(away) < 0.012 and np.nanmax(away) < 0.04
    assert (truth.body.weights[truth.marker_vertex, truth.marker_joint] > 0.6).all()


def test_the_person_in_the_video_is_tracked_where_the_truth_says(truth: Truth, demo_landmarks: Landmarks) -> None:
    assert demo_landmarks.tracked.mean() >= 0.95 and demo_landmarks.image_size == truth.image_size
    frames = np.round((demo_landmarks.time + truth.offset) * truth.motion.rate).astype(int)
    seen = truth.joints[frames] @ truth.R.T + truth.t
    seen = seen @ truth.K.T
    seen = seen[..., :2] / seen[..., 2:]
    for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist"):
        for side in ("left", "right"):
            landmark = demo_landmarks.image[:, LANDMARKS.index(f"{side}_{joint}")]
            error = np.nanmedian(np.linalg.norm(landmark - seen[:, INDEX[f"{side}_{joint}"]], axis=1))
            assert error < 10, f"{side} {joint}: {error:.1f} px of a person of 330 px"
    assert mend_flips(demo_landmarks)[1] == ()


def test_the_offset_of_the_embedded_session_is_found(truth: Truth, demo_landmarks: Landmarks) -> None:
    found = find_offset(demo_landmarks, load_markers(resource("demo", "session.c3d")))
    assert abs(found.offset - truth.offset) < 0.01, f"{found.offset:.4f} s, not {truth.offset}"
    assert found.confidence > 0.9


def test_the_video_is_short_and_exact() -> None:
    index = index_video(resource("demo", "video.mp4"))
    assert len(index.time) == 282 and index.notes == ()
    np.testing.assert_allclose(index.time, np.arange(282) / 30, atol=1e-4)


@pytest.mark.parametrize("content", [b"", b"garbage" * 100, None])
def test_a_truth_that_is_none_is_refused(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "truth.npz"
    if content is None:
        np.savez(path, other=1)
    else:
        path.write_bytes(content)
    with pytest.raises(InputError):
        load_truth(path)
