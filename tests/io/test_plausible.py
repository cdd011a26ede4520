"""What no recording of a person is, is said: size, rate and length, with the unit that would make sense."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.cleaning.request import CleanRequest
from markerscope.solver.commands.clean import clean_file
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.units import settle_units
from tests.io.c3d_bytes import c3d_bytes

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}
BODY = ("HEAD", "C7", "LSHO", "RSHO", "LASI", "RASI", "LKNE", "RKNE", "LANK", "RANK", "LTOE", "RTOE")


@pytest.mark.parametrize("asked", [False, True])
@pytest.mark.parametrize("labels", [(), BODY])
@given(real=st.sampled_from(sorted(METRES)), said=st.sampled_from(sorted(METRES)), seed=st.integers(0, 999))
def test_a_person_in_the_wrong_unit(
    asked: bool, labels: tuple[str, ...], real: str, said: str, seed: int, recording: Callable[..., Markers]
) -> None:
    positions = recording(seed, count=12, lost=0.1).positions / METRES[real]
    factor, notes = settle_units(positions, None if asked else said, said if asked else None, "a", labels)
    assert factor == METRES[said]
    told = [note for note in notes if "check the unit" in note]
    if real == said:
        assert not told
    elif labels or (real, said) != ("cm", "mm"):  # as large as a hand; only names tell
        assert len(told) == 1
        assert f"in {real} they would span" in told[0]


@given(seed=st.integers(0, 999))
def test_a_hand_is_no_doubt(seed: int, recording: Callable[..., Markers]) -> None:
    hand = recording(seed, count=15, lost=0.1).positions * 0.1
    assert settle_units(hand * 1000, "mm", None, "a", [f"finger{i}" for i in range(15)])[1] == ()
    guessed, notes = settle_units(hand * 1000, None, None, "a")
    assert "hand" in notes[0] or guessed == 0.001


@pytest.mark.parametrize(("rate", "doubted"), [(0.5, True), (1.0, True), (24, False), (1000, False), (2500, True)])
def test_rates(tmp_path: Path, rate: float, doubted: bool, recording: Callable[..., Markers]) -> None:
    write_trc(tmp_path / "a.trc", recording(1))
    notes = load_markers(tmp_path / "a.trc", rate=rate).notes
    assert any("motion capture" in note for note in notes) == doubted


def test_hours_are_said(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    write_trc(tmp_path / "a.trc", replace(recording(1, frames=30), rate=100.0))
    assert not any("hours" in note for note in load_markers(tmp_path / "a.trc").notes)
    assert any("hours" in note for note in load_markers(tmp_path / "a.trc", rate=0.001).notes)


def test_every_note_reaches_the_summary_and_both_lists(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    xyz = rng.uniform(0, 1000, (1, 6, 3)) + 20 * np.sin(np.arange(40) / 9)[:, None, None]
    events = {"EVENT": {"USED": np.array(3)}, "FORCE_PLATFORM": {"USED": np.array(2)}, "LAB": {"ROOM": ["4"]}}
    data = c3d_bytes(xyz, analog=np.zeros((40, 10, 5)), header={"count": 4}, groups=events)
    (tmp_path / "a.c3d").write_bytes(data)
    notes = load_markers(tmp_path / "a.c3d").notes
    held = "The C3D also holds 5 analog channels, 2 force plates, 3 events and 1 further parameter: kept where a C3D"
    assert any(held in note for note in notes)
    assert any("disagree" in note or "number of points" in note for note in notes)
    done = clean_file(CleanRequest(markers=tmp_path / "a.c3d", out=tmp_path / "b.csv"))
    listed = json.loads((tmp_path / "b.changes.json").read_text())["notes"]
    table = (tmp_path / "b.changes.csv").read_text()
    for note in notes:
        assert note in done.summary["notes"] and note in listed and note in done.lines
        assert note.split(",")[0] in table
