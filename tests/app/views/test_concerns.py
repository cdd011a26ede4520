"""What is to check: every kind of doubt has its place, a tie, an open offset, a pin and a poor fit are never green."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models.results import StageResults
from markerscope.app.models.stages import TITLES
from markerscope.app.views.concerns import PLACES, Concern, concerns
from markerscope.app.window.bind_dated import DRAWN
from markerscope.solver.fit import doubts
from markerscope.solver.fit.doubts.doubt import Doubt


@pytest.fixture
def good(results: StageResults) -> dict[str, object]:
    """The results of a session, made such that nothing speaks against them."""
    fit, ranked = results["fit"], results["orient"]
    return {
        "markers": results["markers"],
        "landmarks": replace(results["landmarks"], tracked=np.ones_like(results["landmarks"].tracked)),
        "sync": replace(results["sync"], confidence=0.9, notes=()),
        "orient": replace(ranked, margin=3.0, confidence=0.95, warnings=()),
        "fit": replace(fit, residual=np.full_like(fit.residual, 0.003), warnings=()),
        "check": replace(results["check"], confidence=0.95, doubts=(), suspect=()),
    }


def reasons(results: dict[str, object], pinned: int | None = None) -> dict[str, str]:
    return {concern.stage: concern.text for concern in concerns(results, pinned)}


def test_a_good_answer_gives_nothing_to_check(good: dict[str, object]) -> None:
    assert concerns(good) == ()
    assert concerns({}) == ()


def test_done_is_not_good(good: dict[str, object]) -> None:
    tie = {**good, "orient": replace(good["orient"], margin=1.13)}  # type: ignore[type-var]
    assert "1.13 times as much" in reasons(tie)["orient"]
    open_offset = {**good, "sync": replace(good["sync"], confidence=0.0)}  # type: ignore[type-var]
    assert "0.00" in reasons(open_offset)["sync"]
    residual = np.full_like(good["fit"].residual, 0.0198)  # type: ignore[attr-defined]
    residual[7] = 0.05
    poor = concerns({**good, "fit": replace(good["fit"], residual=residual)})  # type: ignore[type-var]
    assert "19.8 mm" in poor[0].text and poor[0].time == good["fit"].time[7]  # type: ignore[attr-defined]
    assert "candidate 2" in reasons(good, 1)["fit"], "counted from 1, as everywhere"
    tracked = np.arange(len(good["landmarks"].tracked)) % 2 == 0  # type: ignore[attr-defined]
    lost = reasons({**good, "landmarks": replace(good["landmarks"], tracked=tracked)})  # type: ignore[type-var]
    assert "% of the frames watched" in lost["landmarks"]


def test_a_doubt_speaks_against_its_stage_and_leads_to_its_markers(good: dict[str, object]) -> None:
    doubt = Doubt("far markers", "2 markers are far from the body.", (3, 5))
    check = replace(good["check"], doubts=(doubt,), confidence=0.6, suspect=(4,))  # type: ignore[type-var]
    found = concerns({**good, "check": check})
    labels = good["markers"].labels  # type: ignore[attr-defined]
    said = f"2 markers are far from the body ({labels[3]}, {labels[5]})."
    assert Concern("fit", "As it is: mend it.").short == "As it is."
    assert Concern("fit", said, "markers", (3, 5)) in found
    assert any(concern.markers == (4,) and concern.time is not None for concern in found)
    assert [concern.stage for concern in found][-1] == "check"


def test_every_kind_of_doubt_has_a_stage_and_a_panel() -> None:
    folder = Path(doubts.__file__).parent
    kinds = set(re.findall(r"return Doubt\(\s*\"([^\"]+)\"", "".join(file.read_text() for file in folder.glob("*.py"))))
    assert kinds == PLACES.keys()
    assert {stage for stage, _ in PLACES.values()} <= TITLES.keys()
    assert {panel for _, panel in PLACES.values()} <= DRAWN.keys()
