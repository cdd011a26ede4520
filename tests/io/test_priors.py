"""Reconstructions of other programs: written in each layout, read back, compared with what was written."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.skeleton import INDEX, PARENTS
from markerscope.solver.io.priors import load_prior

FRAMES = 12


def poses(seed: int = 0, frames: int = FRAMES, joints: int = 24) -> np.ndarray:
    """(frames, joints, 3) rad, angles up to 1.5 rad; the root upright in a camera (y down)."""
    vectors = np.random.default_rng(seed).uniform(-0.85, 0.85, (frames, joints, 3))
    tilt = Rotation.from_euler("xyz", np.random.default_rng(seed + 1).uniform(-0.3, 0.3, (frames, 3)))
    vectors[:, 0] = (Rotation.from_euler("x", np.pi) * tilt).as_rotvec()
    return vectors


def matrices(vectors: np.ndarray) -> np.ndarray:
    return Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix().reshape(*vectors.shape, 3)


def error(prior: PosePrior, expected: np.ndarray) -> float:
    return float(np.abs(prior.rotations - expected).max())


def phalp_entry(people: dict[int, tuple[int, np.ndarray]], time: int) -> dict[str, Any]:
    """One frame; ``people`` maps a track id to (tracked_time, (24, 3, 3))."""
    return {
        "time": time,
        "tid": list(people),
        "tracked_ids": [i for i, (age, _) in people.items() if age == 0],
        "tracked_time": [age for age, _ in people.values()],
        "smpl": [
            {
                "global_orient": r[:1].astype(np.float32),
                "body_pose": r[1:].astype(np.float32),
                "betas": np.zeros(10, np.float32),
            }
            for _, r in people.values()
        ],
    }


# each layout ----------------------------------------------------------------------------------------------------------
@pytest.mark.parametrize("compress", [0, 3])
def test_phalp_takes_the_longest_real_track(tmp_path: Path, compress: int) -> None:
    joblib = pytest.importorskip("joblib")
    body, other = matrices(poses(0)), matrices(poses(5))
    file = {}
    for i in range(FRAMES):
        people = {3: (i, other[i])}  # listed first and in every frame, but a ghost after the first
        if i not in (0, 5, 6, 11):
            people[8] = (0, body[i])
        file[f"img/{i + 1:06d}.jpg"] = phalp_entry(people, i)
    file["img/000001.jpg"] = {"time": 0, "shot": 0}  # nobody yet
    joblib.dump(file, tmp_path / "a.pkl", compress=compress)
    prior = load_prior(tmp_path / "a.pkl", fps=25)
    seen = [i not in (0, 5, 6, 11) for i in range(FRAMES)]
    assert prior.tracked.tolist() == seen
    assert np.abs(prior.rotations[prior.tracked] - body[seen]).max() < 1e-6
    np.testing.assert_allclose(prior.time, np.arange(FRAMES) / 25)
    np.testing.assert_allclose(prior.rotations[0], prior.rotations[1], atol=1e-6)
    np.testing.assert_allclose(prior.rotations[11], prior.rotations[10], atol=1e-6)
    for joint in range(24):  # scipy's own slerp through the gap
        between = Slerp([4, 7], Rotation.from_matrix(prior.rotations[[4, 7], joint]))([5, 6]).as_matrix()
        np.testing.assert_allclose(prior.rotations[[5, 6], joint], between, atol=1e-6)
    assert prior.betas is None, "all zero: it says no shape"
    assert any("4 of 12 frames were lost" in note for note in prior.notes)


def test_phalp_says_when_there_are_several_people(tmp_path: Path) -> None:
    a, b = matrices(poses(0)), matrices(poses(1))
    file = {str(i): phalp_entry({1: (0, a[i]), 2: (0, b[i])} if i < 5 else {2: (0, b[i])}, i) for i in range(FRAMES)}
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(file))
    prior = load_prior(tmp_path / "a.pkl")
    assert error(prior, b) < 1e-6
    assert any("2 people" in note and "id 2" in note for note in prior.notes), prior.notes
    assert any("30 Hz is assumed" in note for note in prior.notes), prior.notes


def test_wham_with_missing_frames(tmp_path: Path) -> None:
    from collections import defaultdict

    vectors, ids = poses(), np.array([2, 3, 4, 5, 9, 10, 11, 12, 13, 14, 15, 16])
    file: dict = defaultdict(dict)
    file[0] = {"pose": poses(3, 4).reshape(4, 72).astype(np.float32), "frame_ids": np.arange(4)}
    file[1] = {
        "pose": vectors.reshape(FRAMES, 72).astype(np.float32),
        "trans": np.zeros((FRAMES, 3)),
        "pose_world": np.zeros((FRAMES, 72)),
        "betas": np.zeros((FRAMES, 10)),
        "frame_ids": ids,
    }
    pytest.importorskip("joblib").dump(file, tmp_path / "wham_output.pkl")
    prior = load_prior(tmp_path / "wham_output.pkl", fps=50)
    assert np.flatnonzero(prior.tracked).tolist() == ids.tolist()
    assert np.abs(prior.rotations[ids] - matrices(vectors)).max() < 1e-6
    assert prior.time[-1] == pytest.approx(16 / 50)


@pytest.mark.parametrize("name", ["smpl_params_incam", "smpl_params_global"])
def test_gvhmr_body_of_21_joints(tmp_path: Path, name: str) -> None:
    torch = pytest.importorskip("torch")
    vectors = poses()
    root = vectors[:, 0]
    if name == "smpl_params_global":  # the same person in a y-up world
        root = (Rotation.from_euler("x", np.pi) * Rotation.from_rotvec(root)).as_rotvec()
    parameters = {
        "global_orient": torch.tensor(root),
        "body_pose": torch.tensor(vectors[:, 1:22].reshape(FRAMES, 63)),
        "betas": torch.zeros(FRAMES, 10),
        "transl": torch.zeros(FRAMES, 3),
    }
    torch.save({name: parameters, "K_fullimg": torch.eye(3).expand(FRAMES, 3, 3)}, tmp_path / "a.pt")
    prior = load_prior(tmp_path / "a.pt")
    expected = matrices(vectors)
    expected[:, 22:] = np.eye(3)
    assert error(prior, expected) < 1e-12
    assert prior.tracked.all()


def test_tram_with_tensors(tmp_path: Path) -> None:
    torch = pytest.importorskip("torch")
    expected = matrices(poses())
    file = {
        "pred_rotmat": torch.tensor(expected, dtype=torch.float32),
        "pred_shape": torch.zeros(FRAMES, 10),
        "pred_trans": torch.zeros(FRAMES, 1, 3),
        "frame": torch.arange(3, 3 + FRAMES),
    }
    np.save(tmp_path / "hps_track_0.npy", file, allow_pickle=True)
    prior = load_prior(tmp_path / "hps_track_0.npy", fps=30)
    assert prior.tracked.tolist() == [False] * 3 + [True] * FRAMES
    assert np.abs(prior.rotations[3:] - expected).max() < 1e-6


@pytest.mark.parametrize("count", [22, 24, 52, 55])
@pytest.mark.parametrize("flat", [True, False])
def test_amass_of_every_body(tmp_path: Path, count: int, flat: bool) -> None:
    vectors = poses(joints=count)
    tracked = np.arange(FRAMES) % 4 != 1
    stored = vectors.reshape(FRAMES, -1) if flat else vectors
    np.savez(
        tmp_path / "a.npz", poses=stored, betas=np.zeros(10), mocap_frame_rate=60.0, tracked=tracked, gender="neutral"
    )
    prior = load_prior(tmp_path / "a.npz", fps=30)
    expected = np.tile(np.eye(3), (FRAMES, 24, 1, 1))
    used = 24 if count == 24 else 22
    expected[:, :used] = matrices(vectors[:, :used])
    assert np.abs(prior.rotations - expected)[tracked].max() < 1e-12
    assert prior.tracked.tolist() == tracked.tolist()
    np.testing.assert_allclose(prior.time, np.arange(FRAMES) / 60)
    assert any("60 Hz is used, not the 30 Hz" in note for note in prior.notes), prior.notes


@pytest.mark.parametrize(
    ("up", "turn"), [("z", Rotation.from_euler("x", 90, degrees=True)), ("y", Rotation.identity())]
)
def test_a_world_frame_ends_upright_in_camera_axes(tmp_path: Path, up: str, turn: Rotation) -> None:
    heading = Rotation.from_euler("y", np.linspace(0, 300, FRAMES)[:, None], degrees=True)
    vectors = poses()
    vectors[:, 0] = (turn * heading).as_rotvec()
    np.savez(tmp_path / "a.npz", poses=vectors.reshape(FRAMES, 72), mocap_framerate=120)
    prior = load_prior(tmp_path / "a.npz")
    np.testing.assert_allclose(prior.rotations[:, 0] @ [0, 1, 0], np.tile([0, -1, 0], (FRAMES, 1)), atol=1e-12)
    relative = prior.rotations[0, 0].T @ prior.rotations[:, 0]
    np.testing.assert_allclose(relative, heading.as_matrix(), atol=1e-12)
    assert prior.time[1] == pytest.approx(1 / 120)
    assert any(f"({up} up)" in note for note in prior.notes), prior.notes


def test_amass_new_layout_and_clock(tmp_path: Path) -> None:
    vectors = poses()
    time = 5 + np.arange(FRAMES) / 100
    np.savez(tmp_path / "a.npz", root_orient=vectors[:, 0], pose_body=vectors[:, 1:22].reshape(FRAMES, 63), time=time)
    prior = load_prior(tmp_path / "a.npz")
    np.testing.assert_array_equal(prior.time, time)
    assert np.abs(prior.rotations[:, :22] - matrices(vectors[:, :22])).max() < 1e-12


def test_frames_with_invalid_numbers_are_lost(tmp_path: Path) -> None:
    vectors = poses()
    vectors[4, 7] = np.nan
    np.savez(tmp_path / "a.npz", poses=vectors.reshape(FRAMES, 72), mocap_frame_rate=30)
    prior = load_prior(tmp_path / "a.npz")
    assert np.flatnonzero(~prior.tracked).tolist() == [4]
    assert np.isfinite(prior.rotations).all()
    rotations = matrices(poses())
    rotations[6, 3] = np.diag([1, 1, -1])
    np.save(tmp_path / "b.npy", {"pred_rotmat": rotations}, allow_pickle=True)
    assert np.flatnonzero(~load_prior(tmp_path / "b.npy").tracked).tolist() == [6]


# what cannot be used --------------------------------------------------------------------------------------------------
GOOD = poses().reshape(FRAMES, 72)
BAD = {
    "unknown layout": ({"vertices": np.zeros((3, 3))}, {}, "known layout"),
    "no frames": ({"poses": np.zeros((0, 72))}, {}, "no frames"),
    "wrong width": ({"poses": np.zeros((4, 69))}, {}, "4 x 69"),
    "one dimension": ({"poses": np.zeros(72)}, {}, "no frames"),
    "text": ({"poses": np.array(["a", "b"])}, {}, "not an array of numbers"),
    "all invalid": ({"poses": np.full((4, 72), np.nan)}, {}, "no frame in which"),
    "never tracked": ({"poses": GOOD, "tracked": np.zeros(FRAMES, bool)}, {}, "no frame in which"),
    "tracked of another length": ({"poses": GOOD, "tracked": np.ones(5, bool)}, {}, "5 entries for 12 frames"),
    "impossible rate": ({"poses": GOOD, "mocap_frame_rate": -1.0}, {}, "not possible"),
    "impossible given rate": ({"poses": GOOD}, {"fps": float("nan")}, "not possible"),
    "time runs back": ({"poses": GOOD, "time": np.arange(FRAMES)[::-1]}, {}, "ascending"),
    "halves of different length": (
        {"root_orient": np.zeros((3, 3)), "pose_body": np.zeros((4, 63))},
        {},
        "match in length",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_npz_files_say_what_is_wrong(tmp_path: Path, name: str) -> None:
    content, options, sentence = BAD[name]
    np.savez(tmp_path / "bad.npz", **content)
    with pytest.raises(InputError, match=sentence) as caught:
        load_prior(tmp_path / "bad.npz", **options)
    assert str(tmp_path / "bad.npz") in str(caught.value)


ONE = matrices(poses())[0]
BAD_PICKLES: dict[str, Any] = {
    "a list": [1, 2, 3],
    "empty": {},
    "frames without lists": {"a": phalp_entry({1: (0, ONE)}, 0), "b": {"tid": 3, "smpl": None}},
    "frames that are numbers": {"a": phalp_entry({1: (0, ONE)}, 0), "b": 7},
    "nobody": {"a": phalp_entry({}, 0)},
    "only ghosts": {"a": phalp_entry({1: (2, ONE)}, 0)},
    "lists of different lengths": {"a": {**phalp_entry({1: (0, ONE)}, 0), "tid": [1, 2]}},
    "no body": {"a": {**phalp_entry({1: (0, ONE)}, 0), "smpl": [{}]}},
    "half a body": {"a": phalp_entry({1: (0, ONE[:10])}, 0)},
    "body of text": {"a": {**phalp_entry({1: (0, ONE)}, 0), "smpl": [{"global_orient": "x", "body_pose": "y"}]}},
    "WHAM without numbers": {0: {"pose": "none"}},
    "WHAM of another width": {0: {"pose": np.zeros((3, 70))}},
    "WHAM ids of another length": {0: {"pose": np.zeros((3, 72)), "frame_ids": np.arange(2)}},
    "WHAM ids that run back": {0: {"pose": np.zeros((3, 72)), "frame_ids": np.array([2, 1, 0])}},
    "WHAM ids beyond reason": {0: {"pose": np.zeros((2, 72)), "frame_ids": np.array([0, 10**15])}},
    "GVHMR without a body": {"smpl_params_incam": {"global_orient": np.zeros((3, 3))}},
    "GVHMR of lists": {"smpl_params_incam": [1]},
    "TRAM of another shape": {"pred_rotmat": np.zeros((3, 23, 3, 3))},
    "TRAM of zeros": {"pred_rotmat": np.zeros((3, 24, 3, 3))},
    "TRAM of a list": {"pred_rotmat": [1]},
}


@pytest.mark.parametrize("name", BAD_PICKLES)
def test_bad_pickles_say_what_is_wrong(tmp_path: Path, name: str) -> None:
    (tmp_path / "bad.pkl").write_bytes(pickle.dumps(BAD_PICKLES[name]))
    with pytest.raises(InputError) as caught:
        load_prior(tmp_path / "bad.pkl")
    assert str(caught.value).startswith(str(tmp_path / "bad.pkl")) and str(caught.value).endswith(".")


# real files -----------------------------------------------------------------------------------------------------------
def directions(prior: PosePrior, joint: str, rest: np.ndarray) -> np.ndarray:
    """(F, 3) where a bone that points along ``rest`` in the rest body points, in the camera's axes."""
    chain, j = [], INDEX[joint]
    while j >= 0:
        chain.append(j)
        j = int(PARENTS[j])
    total = np.tile(np.eye(3), (len(prior.time), 1, 1))
    for j in reversed(chain):
        total = total @ prior.rotations[:, j]
    return total @ rest


def test_jumping_jacks_raise_both_arms_and_spread_both_legs(shared_data: Path) -> None:
    prior = load_prior(shared_data / "priors" / "demo_jumpingjacks.pkl")
    assert prior.rotations.shape == (91, 24, 3, 3)
    height = {
        s: -directions(prior, f"{s}_shoulder", np.array([x, 0, 0]))[:, 1] for s, x in (("left", 1), ("right", -1))
    }
    for side, h in height.items():
        assert h.max() > 0.7 and h.min() < -0.7, f"{side} arm moves between {h.min():.2f} and {h.max():.2f}"
        raised = np.flatnonzero((h[1:] > 0) & (h[:-1] <= 0))
        assert len(raised) >= 2, f"{side} arm is raised at frames {raised}"
    assert np.corrcoef(height["left"], height["right"])[0, 1] > 0.95
    spread = (
        directions(prior, "left_hip", np.array([0, -1.0, 0]))[:, 0]
        - directions(prior, "right_hip", np.array([0, -1.0, 0]))[:, 0]
    )
    assert np.corrcoef(np.abs(spread), height["left"])[0, 1] > 0.5
    assert (-directions(prior, "spine3", np.array([0, 1.0, 0]))[:, 1] < -0.8).sum() == 0, "never upside down"
    assert (directions(prior, "spine3", np.array([0, 1.0, 0]))[:, 1] < -0.9).mean() > 0.9, "upright in a camera, y down"


def test_a_walk_swings_the_legs_in_turn(shared_data: Path) -> None:
    prior = load_prior(shared_data / "priors" / "demo_walk_1.pkl")
    flexion = [Rotation.from_matrix(prior.rotations[:, INDEX[f"{s}_hip"]]).as_rotvec()[:, 0] for s in ("left", "right")]
    assert np.corrcoef(*flexion)[0, 1] < -0.5
    knee = Rotation.from_matrix(prior.rotations[:, INDEX["left_knee"]]).as_rotvec()[:, 0]
    assert knee.max() > 0.5 and knee.min() > -0.3, "knees bend one way only"


def test_gvhmr_frames_differ_by_the_camera_alone(shared_data: Path, tmp_path: Path) -> None:
    """The clip's camera is fixed, so its two root tracks differ by one rotation."""
    torch = pytest.importorskip("torch")
    path = shared_data / "priors" / "gvhmr_hmr4d_results.pt"
    camera = load_prior(path)
    data = torch.load(path, weights_only=True)
    torch.save({"smpl_params_global": data["smpl_params_global"]}, tmp_path / "world.pt")
    world = load_prior(tmp_path / "world.pt")
    assert np.array_equal(camera.rotations[:, 1:20], world.rotations[:, 1:20]) or (
        np.abs(camera.rotations[:, 1:] - world.rotations[:, 1:]).max() < 0.6
    )
    between = Rotation.from_matrix(world.rotations[:, 0] @ camera.rotations[:, 0].transpose(0, 2, 1))
    apart = np.degrees((between.mean().inv() * between).magnitude())
    assert np.median(apart) < 5, f"{np.median(apart):.1f} degrees"
    assert camera.rotations[:, 0, 1, 1].mean() < -0.9 and world.rotations[:, 0, 1, 1].mean() < -0.9


# the person's shape ---------------------------------------------------------------------------------------------------
SHAPE = np.array([1.5, -2.0, 0.5, 0, 0.25, 0, 0, -0.75, 0, 1.0])


def shaped(tmp_path: Path, program: str) -> Path:
    """A file of each program whose person has a shape, told anew in every frame by those that do so."""
    vectors, wobble = poses(), np.linspace(-0.3, 0.3, FRAMES)[:, None]
    each = (SHAPE + wobble).astype(np.float32)
    if program == "phalp":
        turned = matrices(vectors)
        file: dict[Any, Any] = {str(i): phalp_entry({1: (0, turned[i])}, i) for i in range(FRAMES)}
        for i, entry in enumerate(file.values()):
            entry["smpl"][0]["betas"] = each[i]
        (tmp_path / "a.pkl").write_bytes(pickle.dumps(file))
        return tmp_path / "a.pkl"
    if program == "wham":
        pose = {"pose": vectors.reshape(FRAMES, 72), "betas": each, "frame_ids": np.arange(FRAMES)}
        (tmp_path / "a.pkl").write_bytes(pickle.dumps({0: pose}))
        return tmp_path / "a.pkl"
    if program == "gvhmr":
        torch = pytest.importorskip("torch")
        parameters = {"global_orient": vectors[:, 0], "body_pose": vectors[:, 1:22].reshape(FRAMES, 63), "betas": each}
        torch.save({"smpl_params_incam": {k: torch.tensor(v) for k, v in parameters.items()}}, tmp_path / "a.pt")
        return tmp_path / "a.pt"
    if program == "tram":
        np.save(tmp_path / "a.npy", {"pred_rotmat": matrices(vectors), "pred_shape": each}, allow_pickle=True)  # type: ignore[arg-type]
        return tmp_path / "a.npy"
    width = {"amass": 72, "amass smplh": 156, "amass smplx": 165}[program]
    stored = np.zeros((FRAMES, width))
    stored[:, :66] = vectors[:, :22].reshape(FRAMES, 66)
    np.savez(tmp_path / "a.npz", poses=stored, betas=np.append(SHAPE, np.zeros(6)), mocap_frame_rate=30.0)
    return tmp_path / "a.npz"


@pytest.mark.parametrize(
    ("program", "kind"),
    [("phalp", "smpl"), ("wham", "smpl"), ("tram", "smpl"), ("gvhmr", "smplx"), ("amass", "smpl"),
     ("amass smplh", "smplh"), ("amass smplx", "smplx")],
)  # fmt: skip
def test_the_shape_is_read_with_the_kind_of_body_it_belongs_to(tmp_path: Path, program: str, kind: str) -> None:
    prior = load_prior(shaped(tmp_path, program))
    assert prior.kind == kind and prior.betas is not None
    assert np.abs(prior.betas - SHAPE).max() < 1e-5, "the median of what the frames say"
    assert any("shape coefficients" in note and "--body" in note for note in prior.notes), prior.notes


@pytest.mark.parametrize("odd", [{"betas": np.full(10, np.nan)}, {"betas": np.full(10, 50.0)}, {"betas": np.zeros(0)}])
def test_a_shape_of_nobody_is_left_out_and_said(tmp_path: Path, odd: dict[str, Any]) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((FRAMES, 72)), mocap_frame_rate=30.0, **odd)
    prior = load_prior(tmp_path / "a.npz")
    assert prior.betas is None and prior.kind == ""
    assert any("shape coefficients" in note and "left out" in note for note in prior.notes)


@pytest.mark.parametrize("mark", [{"bone_lengths": np.zeros(8)}, {"shaped": np.array(True)}])
def test_the_shape_of_this_programs_own_body_is_not_taken_for_smpls(tmp_path: Path, mark: dict[str, Any]) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros((FRAMES, 72)), mocap_frame_rate=30.0, betas=SHAPE, **mark)
    assert load_prior(tmp_path / "a.npz").betas is None
