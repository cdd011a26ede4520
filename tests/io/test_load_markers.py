"""Units, vertical axis, subjects, labels and lost samples, on made and on real recordings."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers, UpAxis
from markerscope.solver.core.markers_check import require_solvable
from markerscope.solver.io import list_subjects, load_markers
from markerscope.solver.io.export_csv import write_markers_csv
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.labels import computed_by_name, unique
from markerscope.solver.io.units import cloud_size, metres_per_unit, settle_units
from markerscope.solver.io.up_axis import vertical_scores

# What is known of the real files apart from what they say: frames, markers, Hz, percent lost, and the vertical axis
# of the file.
REAL: dict[str, tuple[int, int, float, UpAxis]] = {
    "fullbody/Walk1.c3d": (151, 29, 60, "z"),
    "fullbody/cmu_02_05.c3d": (1854, 41, 120, "z"),
    "fullbody/mcgill_HC040A14_raw_unlabeled.c3d": (653, 95, 100, "z"),
    "fullbody/nick_freeform_001.c3d": (1101, 53, 120, "y"),
    "fullbody/squat.c3d": (2539, 53, 120, "y"),
    "fullbody/labval_dropjump_gaps.trc": (245, 47, 100, "y"),
    "fullbody/labval_dropjump_male.trc": (231, 47, 100, "y"),
    "fullbody/labval_walk.trc": (131, 47, 100, "y"),
    "partial/pyomeca_right_arm_shoulder_box.c3d": (580, 43, 100, "z"),
    "partial/vaila_lowerlimb.c3d": (144, 33, 100, "z"),
    "squat_video/squats1.trc": (1346, 47, 100, "y"),
    "squat_video/static1.trc": (517, 51, 100, "y"),
}


@pytest.mark.parametrize("name", REAL)
def test_real_files(shared_data: Path, name: str) -> None:
    markers = load_markers(shared_data / name)
    frames, count, rate, up = REAL[name]
    assert markers.positions.shape == (frames, count, 3)
    assert markers.rate == rate
    assert "xyz"[int(np.argmax(markers.R_lab_internal[:, 2]))] == up, markers.notes
    body = markers.select(markers=np.array([not label.startswith("*") for label in markers.labels]))  # less ghosts
    low, high = np.percentile(body.positions[..., 2][body.present], [1, 99])
    assert -0.1 < low < 0.3 and 0.8 < high < 2.3, f"heights from {low:.2f} to {high:.2f} m"
    size = cloud_size(body.positions)
    assert size is not None and 0.7 < size < 2.5, f"{size} m across"
    assert all(re.fullmatch(r"[^\n]+\.", note) for note in markers.notes), markers.notes
    require_solvable(markers)


def test_lost_samples_of_a_real_file(shared_data: Path) -> None:
    markers = load_markers(shared_data / "fullbody/nick_freeform_001.c3d")
    assert 1 - markers.present.mean() == pytest.approx(0.066, abs=0.001)
    never = [label for label, seen in zip(markers.labels, markers.present.any(axis=0)) if not seen]
    assert never == ["CLAV"]
    assert "Never seen: CLAV." in markers.notes
    assert load_markers(shared_data / "partial/vaila_lowerlimb.c3d").present.mean() > 0.99


def test_guessed_axis_of_a_real_file_is_said_and_can_be_overridden(shared_data: Path) -> None:
    path = shared_data / "fullbody/squat.c3d"
    guessed = load_markers(path)
    assert any("y was taken" in note for note in guessed.notes)
    forced = load_markers(path, up="z")
    assert not any("axis" in note for note in forced.notes)
    np.testing.assert_allclose(forced.positions, guessed.positions @ guessed.R_lab_internal.T)
    told = load_markers(shared_data / "fullbody/cmu_02_05.c3d", up="y")
    assert any("says z is up; y was taken as asked" in note for note in told.notes)
    assert any("You say y is up, but the markers look as if z were" in note for note in told.notes)


@pytest.mark.parametrize("part", [("L_knee", "L_ankle", "L_toe", "L_calc", "L_thigh1", "L_thigh2", "L_shank_antsup")])
@pytest.mark.parametrize("up", ["y", "z"])
def test_vertical_of_one_leg(shared_data: Path, tmp_path: Path, part: tuple[str, ...], up: UpAxis) -> None:
    whole = load_markers(shared_data / "squat_video/squats1.trc")
    leg = whole.select(markers=np.array([whole.labels.index(name) for name in part]))
    write_markers_csv(tmp_path / "a.csv", replace(leg, notes=()), up=up)
    text = (tmp_path / "a.csv").read_text()
    (tmp_path / "a.csv").write_text(text.replace(f"; up={up}", "").replace("units=m;", ""))
    back = load_markers(tmp_path / "a.csv")
    np.testing.assert_allclose(back.positions, leg.positions, atol=1e-6)
    assert any(f"{up} was taken" in note for note in back.notes)
    assert any("m was taken" in note for note in back.notes)


@pytest.mark.parametrize("name", [name for name in REAL if "pyomeca" not in name])
def test_vertical_of_whole_bodies_wherever_they_stand(shared_data: Path, name: str) -> None:
    markers = load_markers(shared_data / name)
    wrong = []
    for seed in range(12):
        shift = np.random.default_rng(seed).uniform(-3, 3, 3) * [1, 1, 0]
        scores = vertical_scores(markers.positions + shift)
        assert scores is not None
        if scores.argmax() != 2:
            wrong.append((seed, scores.round(2).tolist()))
    assert not wrong, wrong


@pytest.mark.parametrize("units", ["m", "cm", "mm"])
@given(seed=st.integers(0, 10000))
def test_units_of_a_body(units: str, recording: Callable[..., Markers], seed: int) -> None:
    out = recording(seed, count=30, lost=0.1)
    factor, notes = settle_units(out.positions / {"m": 1, "cm": 0.01, "mm": 0.001}[units], None, None, "a")
    assert factor == {"m": 1, "cm": 0.01, "mm": 0.001}[units], notes
    assert units in notes[0]


@pytest.mark.parametrize(
    ("name", "metres"),
    [("mm", 1e-3), ("MM", 1e-3), ("Millimeters", 1e-3), ("millimetre", 1e-3), (" m ", 1), ("Meters", 1), ("cm", 0.01),
     ("inches", 0.0254), ("feet", 0.3048), ("(mm)", 1e-3), ("furlong", None), ("", None), (None, None), ("s", None)],
)  # fmt: skip
def test_unit_names(name: str | None, metres: float | None) -> None:
    assert metres_per_unit(name) == metres


def test_an_unlikely_declared_unit_is_said(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    write_trc(tmp_path / "a.trc", recording(1, count=20))
    text = (tmp_path / "a.trc").read_text().replace("\tm\t", "\tmm\t")
    (tmp_path / "a.trc").write_text(text)
    assert any("check the unit" in note for note in load_markers(tmp_path / "a.trc").notes)
    fixed = load_markers(tmp_path / "a.trc", units="m")
    assert any("m was taken as asked" in note for note in fixed.notes)
    np.testing.assert_allclose(fixed.positions[..., 2].max(), recording(1, count=20).positions[..., 2].max())


@pytest.mark.parametrize("arguments", [{"up": "w"}, {"units": "furlong"}, {"rate": 0}, {"rate": np.nan}, {"rate": -5}])
def test_impossible_wishes(tmp_path: Path, recording: Callable[..., Markers], arguments: dict[str, object]) -> None:
    write_trc(tmp_path / "a.trc", recording(1))
    with pytest.raises(InputError):
        load_markers(tmp_path / "a.trc", **arguments)  # type: ignore[arg-type]


def test_subjects_by_prefix(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    labels = ["Anna:KNE", "Anna:TOE", "Bob:KNE", "Bob:TOE", "*17", "Bob:ANK"]
    write_trc(tmp_path / "a.trc", recording(1, count=6, labels=labels, lost=0))
    assert list_subjects(tmp_path / "a.trc") == ("Anna", "Bob")
    markers = load_markers(tmp_path / "a.trc")
    assert markers.labels == ("KNE", "TOE", "*17", "ANK")
    assert any("Bob was taken" in note and "Anna" in note for note in markers.notes)
    assert load_markers(tmp_path / "a.trc", subject="Anna").labels == ("KNE", "TOE", "*17")
    with pytest.raises(InputError, match="choose one of: Anna, Bob"):
        load_markers(tmp_path / "a.trc", subject="anna")
    write_trc(tmp_path / "b.trc", recording(1))
    assert list_subjects(tmp_path / "b.trc") == ()
    with pytest.raises(InputError, match="names none"):
        load_markers(tmp_path / "b.trc", subject="Anna")


def test_the_content_counts_not_the_name(shared_data: Path, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes((shared_data / "fullbody/Walk1.c3d").read_bytes())
    (tmp_path / "b.c3d").write_bytes((shared_data / "squat_video/static1.trc").read_bytes())
    assert load_markers(tmp_path / "a.csv").rate == 60
    assert load_markers(tmp_path / "b.c3d").rate == 100


@given(st.lists(st.text(max_size=8), max_size=20), st.integers(8, 40) | st.none())
def test_unique_names(names: list[str], limit: int | None) -> None:
    result = unique(names, limit)
    assert len(set(result)) == len(names) == len(result)
    assert all(result)
    assert all(limit is None or len(name.encode()) <= limit for name in result)
    for name, back in zip(names, result):
        if name == name.strip() and name and names.count(name) == 1 and (limit is None or len(name.encode()) <= limit):
            assert back == name


def test_computed_points_are_known_by_name() -> None:
    bones = ["PELO", "PELA", "PELL", "PELP", "LFEO", "LFEA", "LFEL", "LFEP", "L_HJC", "R_HJC_reg", "LKneeAngles"]
    real = ["LFEO2", "RFEO", "RKNE", "LTOE", "C7", "*12", "RACOM", "left_hip_1", "HEDO", "V", "L_toe", "Sternum"]
    assert computed_by_name(bones).all()
    assert not computed_by_name(real).any()


def build(positions: np.ndarray) -> Markers:
    return Markers(positions, 100.0, tuple(map(str, range(positions.shape[1]))), source="trial.c3d")


def test_what_a_solve_needs() -> None:
    cloud = np.random.default_rng(0).normal(size=(50, 6, 3))
    require_solvable(build(cloud))
    two = cloud.copy()
    two[:, 2:] = np.nan
    never_three = cloud.copy()
    for t in range(50):
        never_three[t, (t + np.arange(4)) % 6] = np.nan
    for positions, words in (
        (np.full((50, 6, 3), np.nan), "every sample is lost"),
        (np.zeros((0, 6, 3)), "every sample is lost"),
        (cloud[:, :2], "2 markers with data where a solve needs at least 3"),
        (two, "2 markers with data"),
        (cloud[:1], "1 frame where a solve needs at least 10"),
        (cloud[:9], "9 frames"),
        (never_three, "shows 3 markers at once in 0 frames"),
        (np.ones((50, 6, 3)), "in one place"),
    ):
        with pytest.raises(InputError, match=words) as caught:
            require_solvable(build(positions))
        assert "trial.c3d" in str(caught.value)
        assert str(caught.value).count("\n") == 0
