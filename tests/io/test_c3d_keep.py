"""Markers written back into their C3D: what is no marker stays byte for byte, and other programs read it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.cleaning.request import CleanRequest
from markerscope.solver.commands.clean import clean_file
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.io.c3d_format import decode_c3d
from markerscope.solver.io.c3d_keep import Original, kept_or_plain, write_c3d_like
from tests.io.c3d_bytes import c3d_bytes
from tests.io.test_c3d_contradictions import TURNS, walk

relaxed = settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
EVENTS: dict[str, Any] = {
    "EVENT": {"USED": np.array(2), "LABELS": ["Foot Strike", "Foot Off"], "TIMES": np.array([[0.0, 0.1], [0.0, 0.3]])},
    "FORCE_PLATFORM": {"USED": np.array(1), "TYPE": np.array([2])},
    "SUBJECTS": {"NAMES": ["Anna"]},
}


def sections(path: Path) -> tuple[bytes, bytes, bytes, Any]:
    """Header and parameters, analog values, what stands behind the points, and the points."""
    data = path.read_bytes()
    content = decode_c3d(data, path)
    layout = content.layout
    rows = np.frombuffer(data, np.uint8, layout.frames * layout.stride, layout.begin).reshape(layout.frames, -1)
    width = 4 * layout.count * (4 if layout.floating else 2)
    return data[: layout.begin], rows[:, width:].tobytes(), data[layout.end :], content


def edited(markers: Markers, seed: int) -> tuple[Markers, np.ndarray, np.ndarray]:
    """The markers with some samples filled and others cut, and which."""
    rng = np.random.default_rng(seed)
    draw = rng.random(markers.present.shape)
    cut, filled = markers.present & (draw < 0.1), ~markers.present & (draw < 0.7)
    positions = np.where(cut[..., None], np.nan, markers.positions)
    positions = np.where(filled[..., None], rng.uniform(-1, 1, positions.shape), positions)
    return replace(markers, positions=positions, filled=filled), cut, filled


@relaxed
@given(
    seed=st.integers(0, 9999), scale=st.sampled_from([-0.1, -1.0, 0.1]), channels=st.integers(0, 4),
    samples=st.integers(1, 5), word=st.sampled_from([0, 1, 257]), turning=st.booleans(),
)  # fmt: skip
def test_only_the_points_change(
    tmp_path: Path, seed: int, scale: float, channels: int, samples: int, word: int, turning: bool
) -> None:
    rng = np.random.default_rng(seed)
    xyz, words = walk(40, 6, seed), np.where(rng.random((40, 6)) < 0.2, -1, word)
    analog = rng.integers(-500, 500, (40, samples, channels)) if channels else None
    turn = np.append(np.eye(4).ravel(), 0.0).astype("<f4").tobytes() * 40 if turning else b""
    (tmp_path / "a.c3d").write_bytes(
        c3d_bytes(
            xyz,
            word=words,
            analog=analog,
            scale=scale,
            behind=turn,
            groups=EVENTS | (TURNS if turning else {}),
        )
    )
    markers = load_markers(tmp_path / "a.c3d")
    changed, cut, filled = edited(markers, seed)
    write_c3d_like(tmp_path / "b.c3d", changed, Original(tmp_path / "a.c3d"))
    for mine, theirs in zip(sections(tmp_path / "b.c3d")[:3], sections(tmp_path / "a.c3d")[:3]):
        assert mine == theirs
    back = load_markers(tmp_path / "b.c3d")
    np.testing.assert_array_equal(back.present, changed.present)
    np.testing.assert_allclose(back.positions, changed.positions, atol=2e-4 if scale > 0 else 1e-6)
    if filled.any():
        np.testing.assert_array_equal(back.filled, filled)
    same = ~cut & ~filled  # lost ones keep what stood there
    mine, theirs = (sections(tmp_path / name)[3].xyz for name in ("b.c3d", "a.c3d"))
    np.testing.assert_array_equal(mine[same], theirs[same])
    if not same.all():
        assert (tmp_path / "a.c3d").read_bytes() != (tmp_path / "b.c3d").read_bytes()
    else:
        assert (tmp_path / "a.c3d").read_bytes() == (tmp_path / "b.c3d").read_bytes()


@relaxed
@given(
    seed=st.integers(0, 9999), width=st.sampled_from([1, 20, 110]), start=st.integers(0, 10), stop=st.integers(20, 40)
)
def test_other_names_and_a_range(tmp_path: Path, seed: int, width: int, start: int, stop: int) -> None:
    ezc3d = pytest.importorskip("ezc3d")
    xyz = walk(40, 5, seed)
    analog = np.random.default_rng(seed).integers(-500, 500, (40, 3, 2)).astype(float)
    trial = {"TRIAL": {"ACTUAL_START_FIELD": np.array([7, 0]), "ACTUAL_END_FIELD": np.array([46, 0])}}
    (tmp_path / "a.c3d").write_bytes(c3d_bytes(xyz, analog=analog, first=7, groups=EVENTS | trial))
    markers = load_markers(tmp_path / "a.c3d").select(slice(start, stop))
    names = [f"{'n' * width}{i}" for i in range(5)]
    write_c3d_like(tmp_path / "b.c3d", markers, Original(tmp_path / "a.c3d"), names)
    back = load_markers(tmp_path / "b.c3d")
    assert list(back.labels) == names
    assert back.first_time == pytest.approx(markers.first_time)
    np.testing.assert_allclose(back.positions, markers.positions, atol=1e-6)
    assert not any("C3D header" in note for note in back.notes)
    whole = ezc3d.c3d(str(tmp_path / "b.c3d"))
    np.testing.assert_allclose(whole["data"]["analogs"][0].T, analog[start:stop].reshape(-1, 2))
    np.testing.assert_allclose(whole["data"]["points"][:3].transpose(2, 1, 0), xyz[start:stop], atol=1e-3)
    old = ezc3d.c3d(str(tmp_path / "a.c3d"))["parameters"]
    for name, parameters in old.items():
        for key, value in parameters.items():
            if key in ("__METADATA__", "LABELS", "FRAMES", "DATA_START", "ACTUAL_START_FIELD", "ACTUAL_END_FIELD"):
                continue
            np.testing.assert_array_equal(whole["parameters"][name][key]["value"], value["value"])


def test_a_file_that_contradicts_itself_comes_out_agreeing(tmp_path: Path) -> None:
    xyz = walk(40, 6)
    for header, point in (
        ({"count": 4}, {}), ({"last": 9}, {}), ({"scale": 0.1}, {}), ({}, {"DATA_START": np.array(9)}),
        ({}, {"USED": np.array(8)}), ({}, {"SCALE": np.array(0.1)}),
    ):  # fmt: skip
        (tmp_path / "a.c3d").write_bytes(c3d_bytes(xyz, header=header, point=point))
        write_c3d_like(tmp_path / "b.c3d", load_markers(tmp_path / "a.c3d"), Original(tmp_path / "a.c3d"))
        back = load_markers(tmp_path / "b.c3d")
        np.testing.assert_allclose(back.positions * 1000, xyz, atol=1e-3)
        assert not any("C3D header" in note for note in back.notes), back.notes


def test_one_subject_of_two_leaves_the_other_as_it_is(tmp_path: Path) -> None:
    xyz = walk(40, 6)
    labels = {"LABELS": ["A:KNE", "A:TOE", "A:ANK", "B:KNE", "B:TOE", "B:ANK"]}
    (tmp_path / "a.c3d").write_bytes(c3d_bytes(xyz, point=labels, groups=EVENTS))
    markers = load_markers(tmp_path / "a.c3d", subject="B")
    write_c3d_like(
        tmp_path / "b.c3d",
        replace(markers, positions=markers.positions + 0.1),
        Original(tmp_path / "a.c3d", subject="B"),
    )
    np.testing.assert_allclose(load_markers(tmp_path / "b.c3d", subject="A").positions * 1000, xyz[:, :3], atol=1e-3)
    np.testing.assert_allclose(
        load_markers(tmp_path / "b.c3d", subject="B").positions, markers.positions + 0.1, atol=1e-6
    )


def test_what_cannot_be_kept_is_said_and_the_markers_are_written(tmp_path: Path) -> None:
    (tmp_path / "a.c3d").write_bytes(c3d_bytes(walk(40, 5), scale=0.1, groups=EVENTS))
    markers = load_markers(tmp_path / "a.c3d")
    far = replace(markers, positions=markers.positions + 100.0)
    told = kept_or_plain(tmp_path / "b.c3d", far, Original(tmp_path / "a.c3d"))
    assert len(told) == 1 and "a.c3d could not be kept" in told[0]
    np.testing.assert_allclose(load_markers(tmp_path / "b.c3d").positions, far.positions, atol=1e-4)
    (tmp_path / "a.csv").write_text("time,a_x,a_y,a_z\n0,1,2,3\n0.01,1,2,3\n")
    assert kept_or_plain(tmp_path / "c.c3d", markers, Original(tmp_path / "a.csv")) == ()


@pytest.mark.parametrize("name", ["fullbody/Walk1.c3d", "fullbody/mcgill_HC040A14_raw_unlabeled.c3d"])
def test_real_files_through_clean(shared_data: Path, tmp_path: Path, name: str) -> None:
    clean_file(CleanRequest(markers=shared_data / name, out=tmp_path / "b.c3d", fill="spline", outliers="none"))
    mine, theirs = sections(tmp_path / "b.c3d"), sections(shared_data / name)
    assert mine[:3] == theirs[:3]
    kept = np.isfinite(mine[3].xyz).all(axis=2) & ~mine[3].lost & ~theirs[3].lost
    np.testing.assert_array_equal(mine[3].xyz[kept], theirs[3].xyz[kept])
