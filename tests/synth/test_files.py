"""Sessions as files: read back as they were, readable by everything else, never over what is not theirs."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver import __version__
from markerscope.solver.core.errors import InputError
from markerscope.solver.evaluate.evaluate import Posed, compare, evaluate
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.io.priors.load import load_prior
from markerscope.solver.synth import files
from markerscope.solver.synth.files import FILES, load_session, write_session
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise

SETTINGS = SynthSettings(
    frames=60,
    markers=30,
    lost=0.1,
    ghosts=3,
    swaps=2,
    video_lost=0.2,
    video_flips=1,
    video_wrong_shape=True,
    desync_frames=-2,
)


@pytest.fixture(scope="module")
def session() -> SynthSession:
    return synthesise("throw", SETTINGS, 3)


@pytest.fixture
def folder(tmp_path: Path, session: SynthSession) -> Path:
    write_session(tmp_path / "deep" / "made", session)
    return tmp_path / "deep" / "made"


def test_a_session_comes_back_from_its_files(folder: Path, session: SynthSession) -> None:
    assert sorted(os.listdir(folder)) == sorted(FILES) and os.listdir(folder.parent) == ["made"]
    back = load_session(folder)
    assert (back.settings, back.seed, back.motion, back.nominal_offset) == (SETTINGS, 3, "throw", 0.0)
    np.testing.assert_allclose(back.markers.positions, session.markers.positions, atol=1e-6)
    assert (back.markers.rate, back.markers.first_time) == (30, 0)
    assert back.markers.labels == session.markers.labels
    for name in ("rotations", "tracked", "time", "betas"):
        np.testing.assert_allclose(getattr(back.prior, name), getattr(session.prior, name), atol=1e-9)
    for name in ("marker_vertex", "marker_joint", "carrier", "swaps", "K", "R", "t", "betas", "offset"):
        np.testing.assert_array_equal(getattr(back.truth, name), getattr(session.truth, name))
    np.testing.assert_allclose(back.truth.paths, session.truth.paths, atol=1e-6)
    np.testing.assert_allclose(back.truth.joints, session.truth.joints, atol=1e-5)
    np.testing.assert_allclose(back.truth.surface([7])[0], session.truth.surface([7])[0], atol=5e-5)
    about = json.loads((folder / "synth.json").read_text())
    assert about["version"] == __version__ and about["true_offset"] == pytest.approx(-2 / 30)
    again = synthesise(back.motion, back.settings, back.seed)
    np.testing.assert_array_equal(again.markers.positions, session.markers.positions)


def test_the_other_readers_of_the_program_read_them(folder: Path, session: SynthSession) -> None:
    markers = load_markers(folder / "markers.c3d")
    np.testing.assert_array_equal(markers.present, session.markers.present)
    prior = load_prior(folder / "prior.npz")
    np.testing.assert_allclose(prior.rotations, session.prior.rotations, atol=1e-9)
    np.testing.assert_array_equal(prior.tracked, session.prior.tracked)


def test_the_truth_against_its_reference_is_no_error_at_all(folder: Path) -> None:
    found = evaluate(folder / "reference.npz", folder / "reference.npz")
    assert found.mpjpe.mean < 1e-6
    assert found.v2v is not None
    other = evaluate_nearest(folder)
    assert 0.001 < other < 0.02, "the nearest shape is not near"
    assert found.v2v.mean == pytest.approx(other, rel=1e-3), "the reference is on its true body, the result is not"


def evaluate_nearest(folder: Path) -> float:
    """m, V2V of the reference in the nearest shape against the truth, by hand."""
    from markerscope.solver.body.bones import with_bone_lengths
    from markerscope.solver.body.model import Body
    from markerscope.solver.core.rotations import exp_so3

    with np.load(folder / "reference.npz") as data:
        shape = np.concatenate([data["betas"], data["bone_lengths"]])
        turns = exp_so3(data["poses"].reshape(len(data["poses"]), -1, 3))
        near, _ = with_bone_lengths(Body.load()).pose(turns, shape, data["trans"])
    return float(np.linalg.norm(near - load_session(folder).truth.surface()[0], axis=2).mean())


def test_only_a_session_is_overwritten(folder: Path, session: SynthSession, tmp_path: Path) -> None:
    (folder / "solved").mkdir()
    write_session(folder, replace(session, seed=4))
    assert load_session(folder).seed == 4 and (folder / "solved").is_dir()
    foreign = tmp_path / "photos"
    foreign.mkdir()
    (foreign / "a.jpg").touch()
    with pytest.raises(InputError, match="not empty and holds no synthetic session; name a new folder"):
        write_session(foreign, session)
    assert os.listdir(foreign) == ["a.jpg"]
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="a file of that name"):
        write_session(tmp_path / "file", session)


def test_a_failure_leaves_nothing(tmp_path: Path, session: SynthSession, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*given: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(files, "save_truth", full)
    with pytest.raises(InputError, match="the disk is full"):
        write_session(tmp_path / "made", session)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("content", [None, b"", b"garbage" * 99])
def test_a_damaged_session_is_told_in_one_sentence(folder: Path, name: str, content: bytes | None) -> None:
    if name == "reference.npz":
        return
    if content is None:
        (folder / name).unlink()
    else:
        (folder / name).write_bytes(content)
    with pytest.raises(InputError):
        load_session(folder)


def test_compare_of_truth_with_itself_is_zero(session: SynthSession) -> None:
    truth = session.truth
    own = Posed(truth.body, truth.betas, truth.motion.time, truth.motion.rotations, truth.motion.trans, truth.joints)
    found = compare(own, own, None, "")
    assert found.mpjpe.mean == 0 and found.v2v is not None and found.v2v.mean == 0
