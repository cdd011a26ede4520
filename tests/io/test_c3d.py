"""C3D: round trips, and what two other programs make of the same bytes."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import list_subjects, load_markers
from markerscope.solver.io.c3d import read_c3d
from markerscope.solver.io.export_c3d import write_c3d

relaxed = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
REAL = [
    "fullbody/Walk1.c3d",
    "fullbody/cmu_02_05.c3d",
    "fullbody/mcgill_HC040A14_raw_unlabeled.c3d",
    "fullbody/nick_freeform_001.c3d",
    "fullbody/squat.c3d",
    "partial/pyomeca_right_arm_shoulder_box.c3d",
    "partial/vaila_lowerlimb.c3d",
]


def by_ezc3d(path: Path) -> tuple[np.ndarray, np.ndarray, Any]:
    """Positions (T, M, 3) in file units, residuals (T, M), and the whole, as ezc3d reads them."""
    whole = pytest.importorskip("ezc3d").c3d(str(path))
    return whole["data"]["points"][:3].transpose(2, 1, 0), whole["data"]["meta_points"]["residuals"][0].T, whole


def by_c3d(path: Path) -> tuple[np.ndarray, np.ndarray, Any]:
    """The same as the package ``c3d`` reads them."""
    with warnings.catch_warnings(), path.open("rb") as file:
        warnings.simplefilter("ignore")
        reader = pytest.importorskip("c3d").Reader(file)
        points = np.array([points for _, points, _ in reader.read_frames()])
        return points[..., :3], points[..., 3], reader


@relaxed
@given(seed=st.integers(0, 2**32), count=st.integers(1, 300), up=st.sampled_from("xyz"), first=st.integers(0, 5000))
def test_round_trip_and_two_other_readers(
    tmp_path: Path, recording: Callable[..., Markers], seed: int, count: int, up: Any, first: int
) -> None:
    out = recording(seed, frames=6, count=count, up=up, first=first, rate=[100.0, 59.94, 240.0][seed % 3])
    path = tmp_path / "a.c3d"
    write_c3d(path, out)
    back = load_markers(path)
    assert back.labels == out.labels
    assert back.rate == pytest.approx(out.rate, rel=1e-6)
    assert back.first_time == pytest.approx(out.first_time, abs=1e-3)
    np.testing.assert_array_equal(back.R_lab_internal, out.R_lab_internal)
    np.testing.assert_array_equal(back.present, out.present)
    error = np.nanmax(np.abs(back.positions - out.positions), initial=0)
    assert error < 1e-6, f"{error} m"
    if (out.present & ~out.filled).any():
        np.testing.assert_array_equal(back.filled, out.filled)
    expected = out.positions @ out.R_lab_internal.T * 1000
    for read in (by_ezc3d, by_c3d):
        positions, residuals, _ = read(path)
        np.testing.assert_array_equal(residuals < 0, ~out.present)
        np.testing.assert_array_equal(residuals == 0, out.filled)
        np.testing.assert_allclose(positions[out.present], expected[out.present], atol=1e-3)


@relaxed
@given(labels=st.lists(st.text(max_size=140), min_size=1, max_size=20))
def test_names_with_odd_characters(tmp_path: Path, recording: Callable[..., Markers], labels: list[str]) -> None:
    labels = [label.replace("\0", "").replace(":", "") for label in labels]
    out = recording(1, count=len(labels), labels=labels, lost=0)
    write_c3d(tmp_path / "a.c3d", out)
    raw = read_c3d(tmp_path / "a.c3d")
    assert len(set(raw.labels)) == len(labels), raw.labels
    for label, back in zip(labels, raw.labels):
        if len(label.strip().encode()) < 100 and labels.count(label) == 1 and label.strip() and label.isprintable():
            assert back.startswith(label.strip()[:100])


def test_long_trials_keep_every_frame(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    out = recording(2, frames=70_000, count=1, first=12, lost=0.01)
    write_c3d(tmp_path / "a.c3d", out)
    back = load_markers(tmp_path / "a.c3d")
    assert back.positions.shape == (70_000, 1, 3)
    assert back.first_time == pytest.approx(0.12)
    assert np.nanmax(np.abs(back.positions - out.positions)) < 1e-5
    assert by_c3d(tmp_path / "a.c3d")[0].shape == (70_000, 1, 3)


def test_more_than_255_points_are_all_named_to_others(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    out = recording(3, count=600)
    write_c3d(tmp_path / "a.c3d", out)
    point = by_ezc3d(tmp_path / "a.c3d")[2]["parameters"]["POINT"]
    assert tuple(name for key in ("LABELS", "LABELS2", "LABELS3") for name in point[key]["value"]) == out.labels


def encode(points: np.ndarray, scale: float, processor: int, units: str = "mm") -> bytes:
    """A minimal C3D, built by hand: points (T, M, 4) as stored, in one of the three machine formats."""
    order = ">" if processor == 86 else "<"

    def single(value: float) -> bytes:
        if processor != 85:
            return struct.pack(order + "f", value)
        raw = struct.pack("<f", value * 4)  # the VAX exponent is 2 larger, its 16-bit halves are swapped
        return raw[2:] + raw[:2]

    frames, count = points.shape[:2]
    text = units.encode()
    unit = struct.pack("bb", 5, 1) + b"UNITS" + struct.pack(order + "h", 2 + 3 + len(text) + 1)
    unit += struct.pack("bBB", -1, 1, len(text)) + text + b"\0"
    group = struct.pack("bb", 5, -1) + b"POINT" + struct.pack(order + "h", 3) + b"\0"
    section = (bytes([1, 80, 1, processor]) + group + unit).ljust(512, b"\0")
    header = bytes([2, 80]) + struct.pack(order + "5H", count, 0, 1, frames, 0) + single(scale)
    header += struct.pack(order + "2H", 3, 0) + single(50.0)
    values = points.ravel().tolist()
    body = b"".join(map(single, values)) if scale < 0 else struct.pack(f"{order}{len(values)}h", *map(int, values))
    return header.ljust(512, b"\0") + section + body


@pytest.mark.parametrize("processor", [84, 85, 86])
@pytest.mark.parametrize("scale", [-0.5, 0.25])
def test_every_machine_format(tmp_path: Path, processor: int, scale: float) -> None:
    rng = np.random.default_rng(4)
    stored = np.concatenate([rng.integers(-3000, 3000, (12, 5, 3)), rng.choice([-1, 0, 1, 257], (12, 5, 1))], axis=2)
    path = tmp_path / "a.c3d"
    path.write_bytes(encode(stored.astype(float), scale, processor))
    raw = read_c3d(path)
    assert raw.rate == 50.0
    assert raw.units == "mm"
    lost = stored[..., 3] < 0
    np.testing.assert_array_equal(np.isnan(raw.positions).all(axis=2), lost)
    expected = stored[..., :3] * (scale if scale > 0 else 1)
    np.testing.assert_allclose(raw.positions[~lost], expected[~lost], rtol=1e-6)
    np.testing.assert_array_equal(raw.filled, stored[..., 3] == 0)


@pytest.mark.parametrize("name", REAL)
def test_real_files_agree_with_ezc3d(shared_data: Path, name: str) -> None:
    raw = read_c3d(shared_data / name)
    positions, _, whole = by_ezc3d(shared_data / name)
    np.testing.assert_array_equal(raw.positions, positions)
    point = whole["parameters"]["POINT"]
    keys = [key for key in ("LABELS", "LABELS2") if key in point]
    assert raw.labels == tuple(label.strip() for key in keys for label in point[key]["value"])
    assert raw.first_frame == whole["header"]["points"]["first_frame"]
    assert raw.rate == point["RATE"]["value"][0]


def test_model_outputs_are_left_out_and_unlabelled_tracks_kept(shared_data: Path) -> None:
    markers = load_markers(shared_data / "fullbody/mcgill_HC040A14_raw_unlabeled.c3d")
    stars = [label for label in markers.labels if label.startswith("*")]
    assert len(stars) == 34
    assert {"RASI", "LASI", "RKNE", "LTOE"} <= set(markers.labels)
    gone = {"PELO", "LFEA", "LHipAngles", "RKneeMoment", "LHJC", "RArchHeightIndex", "RHipForce"}
    assert not gone & set(markers.labels)
    assert any("computed" in note for note in markers.notes)


def test_virtual_markers_known_by_their_description(shared_data: Path) -> None:
    markers = load_markers(shared_data / "fullbody/Walk1.c3d")
    assert len(markers.labels) == 29
    assert "VSAC" in markers.labels  # a skin marker in spite of its V
    assert {"RKNE", "RKNE_2"} <= set(markers.labels)


def test_a_choice_of_subjects(shared_data: Path) -> None:
    path = shared_data / "partial/pyomeca_right_arm_shoulder_box.c3d"
    assert list_subjects(path) == ("boite", "Daphnee")
    markers = load_markers(path)
    assert len(markers.labels) == 43
    assert any("Daphnee" in note and "boite" in note for note in markers.notes)
    assert load_markers(path, subject="boite").labels[0] == "gauche_ext"
    assert len(load_markers(path, subject="boite").labels) == 8
    with pytest.raises(InputError, match="boite, Daphnee"):
        load_markers(path, subject="Nobody")


def test_time_starts_where_the_file_says(shared_data: Path) -> None:
    markers = load_markers(shared_data / "partial/vaila_lowerlimb.c3d")
    assert markers.first_time == pytest.approx(12.58)


def test_without_points_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.c3d"
    path.write_bytes(encode(np.zeros((5, 0, 4)), -1, 84))
    with pytest.raises(InputError, match="without points"):
        load_markers(path)
