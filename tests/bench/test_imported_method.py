"""A result that another program left in a folder is measured like any method's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.bench.execute import given_of
from markerscope.solver.bench.imported import imported, marker_key, write_for_others
from markerscope.solver.bench.measure import measure
from markerscope.solver.bench.methods import Given, Variant
from markerscope.solver.bench.registry import method_named
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.io.priors import load_prior
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise


@pytest.fixture(scope="module")
def session() -> SynthSession:
    return synthesise("squat", SynthSettings(markers=30, frames=60, shape="inside", bones=0, bumps=0), 3)


@pytest.fixture(scope="module")
def given(session: SynthSession) -> Given:
    return given_of(session, Variant("x", "", imported(Path())))


def test_what_is_written_is_what_methods_are_given(tmp_path: Path, given: Given) -> None:
    key = write_for_others(tmp_path, given)
    markers = load_markers(tmp_path / f"{key}.c3d")
    assert np.allclose(markers.positions, given.markers.positions, atol=1e-5, equal_nan=True)
    prior = load_prior(tmp_path / f"{key}_prior.npz")
    assert np.allclose(prior.rotations[:, 1:], given.prior.rotations[:, 1:], atol=1e-6)
    assert key == marker_key(given.markers)


def test_the_true_motion_handed_in_is_measured_as_right(tmp_path: Path, session: SynthSession, given: Given) -> None:
    motion = session.truth.motion
    poses = log_so3(motion.rotations).reshape(len(motion.rotations), -1)
    extra = {"joints": session.truth.joints}
    path = tmp_path / f"{marker_key(given.markers)}.npz"
    write_smpl_npz(path, poses, motion.trans, session.truth.betas, given.markers.rate, extra)
    solved = imported(tmp_path)(given, {}, lambda fraction, text: None)
    figures = measure(session, solved)
    assert figures["mpjpe_mm"] < 1e-3, f"{figures['mpjpe_mm']} mm"
    assert figures["right"]
    assert figures["right_bones"] > 0.9


def test_a_result_that_is_not_there_is_named(tmp_path: Path, given: Given) -> None:
    with pytest.raises(InputError, match=f"holds no result for the session {marker_key(given.markers)}"):
        imported(tmp_path)(given, {}, lambda fraction, text: None)
    assert (tmp_path / f"{marker_key(given.markers)}.c3d").is_file(), "it is written for the other program"


def test_a_folder_is_a_method_whose_key_follows_its_results(tmp_path: Path, given: Given) -> None:
    first = method_named(f"soma={tmp_path}")
    write_for_others(tmp_path, given)
    assert method_named(f"soma={tmp_path}").settings == first.settings, "what is written for others is no result"
    (tmp_path / "0123.npz").write_bytes(b"x")
    assert method_named(f"soma={tmp_path}").settings != first.settings
    for name in (f"soma={tmp_path}/no", f"={tmp_path}"):
        with pytest.raises(InputError, match="NAME=FOLDER"):
            method_named(name)
