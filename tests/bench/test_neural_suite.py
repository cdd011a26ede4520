"""The suite of networks: what is held out, what is kept, and that a network that is good is seen to be."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.bench import neural, neural_rows
from markerscope.solver.bench.neural import held_out, neural_suite
from markerscope.solver.bench.neural_exam import examined, new_layout, recordings
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.neural.training.library import Clip, procedural_clips

pytest.importorskip("torch", reason="networks need torch")


@pytest.fixture(autouse=True)
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(neural, "_MADE", 4)
    monkeypatch.setattr(neural, "_BODIES", 2)


def test_the_shipped_network_is_examined_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    request = BenchRequest("neural", out=tmp_path, cases=("shipped",))
    rows = neural_suite(request).summary["rows"]
    assert [row["markers"] for row in rows] == ["47, full_body", "47, full_body", "40, new", "40, new"]
    assert all(row["seen_joe_deg"] < 8 and row["seen_jpe_cm"] < 1.5 for row in rows), rows
    assert json.loads((tmp_path / "bench.json").read_text())["suite"] == "neural"
    assert "| agnostic, as it ships, then refined | 40, new |" in (tmp_path / "bench.md").read_text()

    def never(*anything: object) -> None:
        raise AssertionError("it was examined before")

    again = tuple(replace(entry, run=never) for entry in neural_rows.ENTRIES)
    monkeypatch.setattr(neural_rows, "ENTRIES", again)
    assert neural_suite(request).summary["rows"] == rows


def test_a_row_that_there_is_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match='no row "magic"'):
        neural_suite(BenchRequest("neural", out=tmp_path, cases=("magic",)), silent)
    with pytest.raises(InputError, match="--minutes"):
        BenchRequest("neural", out=tmp_path, minutes=0)


def test_kinds_that_the_shipped_network_has_learnt_are_never_called_unseen() -> None:
    def clips(*kinds: str) -> list[Clip]:
        return [Clip(np.zeros((2, 24, 3, 3)), np.zeros((2, 3)), 60.0, kind, kind) for kind in kinds]

    assert held_out(clips("bow", "walk", "sword", "kick")) == ("bow", "kick")
    assert held_out(clips("walk", "jump", "a", "b", "c", "d")) == ("a", "d")


def test_an_answer_is_judged_by_the_truth() -> None:
    body = Body.load()
    exam = recordings(body, new_layout(body, 1), procedural_clips(2, 1), 2, 7)
    right = examined(lambda recording: (recording.rotations, recording.joints), exam)
    assert right.joe_deg < 1e-6 and right.jpe_cm < 1e-6
    off = examined(lambda recording: (recording.rotations, recording.joints + np.array([0.03, 0, 0.04])), exam)
    assert np.isclose(off.jpe_cm, 5.0), off
    assert all(len(recording.told.rest) == 40 for recording in exam)
