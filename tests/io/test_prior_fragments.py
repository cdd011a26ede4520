"""A track's number is no person: pieces that never overlap are one, in time's order."""

from __future__ import annotations

import pickle
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.io.mot import read_mot
from markerscope.solver.io.motion_in import read_motion
from markerscope.solver.io.priors import load_prior

relaxed = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
FRAMES = 40


def poses(seed: int, frames: int = FRAMES) -> np.ndarray:
    """(T, 72) rotation vectors that change smoothly."""
    rng = np.random.default_rng(seed)
    start, swing = rng.normal(0, 0.6, (2, 72))
    return start + 0.2 * swing * np.sin(np.arange(frames) / 15)[:, None]


def pieces_of(cuts: list[int], gap: int) -> list[np.ndarray]:
    edges = [0, *cuts, FRAMES]
    return [np.arange(a + (gap if a else 0), b) for a, b in pairwise(edges) if b > a + gap]


def wham(pieces: list[tuple[np.ndarray, np.ndarray]]) -> dict[int, Any]:
    return {7 * i: {"pose": pose[frames], "frame_ids": frames} for i, (frames, pose) in enumerate(pieces)}


def phalp(pieces: list[tuple[np.ndarray, np.ndarray]]) -> dict[str, Any]:
    file = {}
    for t in range(FRAMES):
        here = [(i + 1, pose[t]) for i, (frames, pose) in enumerate(pieces) if t in frames]
        bodies = [exp_so3(pose.reshape(24, 3)) for _, pose in here]
        file[f"img/{t:06d}.jpg"] = {
            "time": t, "tid": [i for i, _ in here], "tracked_time": [0] * len(here),
            "smpl": [{"global_orient": body[:1], "body_pose": body[1:]} for body in bodies],
        }  # fmt: skip
    return file


@pytest.mark.parametrize("write", [wham, phalp])
@relaxed
@given(
    cuts=st.lists(st.integers(4, 36), max_size=4, unique=True).map(sorted),
    gap=st.integers(0, 2),
    seed=st.integers(0, 99),
)
def test_pieces_that_never_overlap_are_one_person(
    tmp_path: Path, write: Any, cuts: list[int], gap: int, seed: int
) -> None:
    pose, frames = poses(seed), pieces_of(cuts, gap)
    order = np.random.default_rng(seed).permutation(len(frames))
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(write([(frames[i], pose) for i in order])))
    prior = load_prior(tmp_path / "a.pkl", fps=30)
    seen = np.concatenate(frames)
    assert np.flatnonzero(prior.tracked).tolist() == sorted(seen.tolist())
    np.testing.assert_allclose(prior.rotations[seen], exp_so3(pose[seen].reshape(-1, 24, 3)), atol=1e-6)
    assert any("never overlap" in note for note in prior.notes) == (len(frames) > 1)


@pytest.mark.parametrize("write", [wham, phalp])
@relaxed
@given(cut=st.integers(8, 30), other=st.integers(8, 30), seed=st.integers(0, 99))
def test_two_people_in_pieces_are_told_apart(tmp_path: Path, write: Any, cut: int, other: int, seed: int) -> None:
    a, b = poses(seed), poses(seed + 1000)
    pieces = [(np.arange(cut), a), (np.arange(other), b), (np.arange(cut, FRAMES), a), (np.arange(other, FRAMES), b)]
    (tmp_path / "a.pkl").write_bytes(pickle.dumps(write(pieces)))
    prior = load_prior(tmp_path / "a.pkl", fps=30)
    wanted = [exp_so3(pose.reshape(-1, 24, 3)) for pose in (a, b)]
    assert min(np.abs(prior.rotations - each).max() for each in wanted) < 1e-6, prior.notes
    assert any("2 people" in note for note in prior.notes)


@pytest.mark.parametrize("factor", [1, 1000])
def test_a_priors_times_are_held_against_its_rate(tmp_path: Path, factor: int) -> None:
    time = factor * np.arange(FRAMES) / 25
    np.savez(tmp_path / "a.npz", poses=poses(1), trans=np.zeros((FRAMES, 3)), mocap_frame_rate=25.0, time=time)
    prior = load_prior(tmp_path / "a.npz")
    np.testing.assert_allclose(prior.time, np.arange(FRAMES) / 25)
    assert any("milliseconds" in note for note in prior.notes) == (factor != 1)
    np.savez(tmp_path / "b.npz", poses=poses(1), trans=np.zeros((FRAMES, 3)), mocap_frame_rate=30.0, time=time / factor)
    prior = load_prior(tmp_path / "b.npz")
    assert any("30 Hz" in note and "25 Hz" in note for note in prior.notes)
    with pytest.raises(InputError, match="30 Hz but its times give 25 Hz"):
        read_motion(tmp_path / "b.npz")


@pytest.mark.parametrize("end", ["", "/value"])
def test_coordinates_with_paths(tmp_path: Path, end: str) -> None:
    names = [f"/jointset/hip_r/hip_flexion_r{end}", f"/jointset/knee_r/knee_angle_r{end}"]
    more = [f"/jointset/hip_r/hip_flexion_r{'/speed' if end else '/x/y'}", "/forceset/soleus_r/activation"]
    text = "\t".join(["time", *names, *more]) + "\n0\t1\t-nan(ind)\t3\t4\n0.1\t2\t3\t-1.#IND\t5\n"
    (tmp_path / "a.sto").write_text("Coordinates\nversion=3\nnRows=2\nnColumns=5\ninDegrees=yes\nendheader\n" + text)
    read = read_mot(tmp_path / "a.sto")
    assert list(read.columns) == ["hip_flexion_r", "knee_angle_r", *more]
    np.testing.assert_array_equal(read.columns["knee_angle_r"], [np.nan, 3])
