"""From trajectories to curves: every kind of line, derivatives, gaps and outliers shaded, what is said of the gap."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.app.models.gap_previews import BODY, WAYS, best, preview
from markerscope.app.models.working import Working
from markerscope.app.views.marker_curves import (
    MOST,
    NOTHING,
    Looks,
    curves_picture,
    derivative,
    fill_in,
    heading_of,
    proposal_rows,
    ways_of,
)
from markerscope.solver.cleaning.by_hand import edited
from markerscope.solver.cleaning.gaps import Gap
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import silent
from markerscope.solver.pipeline.cleaning import CleaningSettings, clean_markers

RATE = 50.0
GAP = Gap(1, 40, 49)


def moving(frames: int = 120, markers: int = 10) -> np.ndarray:
    rng = np.random.default_rng(3)
    time = np.arange(frames)[:, None, None] / RATE
    places = rng.uniform(-0.2, 0.2, (1, markers, 3))
    return places + 0.3 * np.sin(2 * np.pi * 0.7 * time + rng.uniform(0, 6, 3))


def work_of(settings: CleaningSettings | None = None, in_force: bool = True) -> Working:
    positions = moving()
    positions[GAP.first : GAP.last + 1, GAP.marker] = np.nan
    positions[80, 2] += 0.1
    settings = settings or CleaningSettings()
    raw = Markers(positions, RATE, tuple(f"m{k}" for k in range(positions.shape[1])), first_time=1.0)
    cleaned = clean_markers(settings, silent, markers=raw)
    return Working(raw, edited(raw, settings.tracks), settings, cleaned, in_force)


def test_every_kind_of_curve_of_the_selected_markers_is_drawn() -> None:
    work = work_of(CleaningSettings(fills=((1, 40, 49, "rigid"),)))
    placed = moving() + 0.005
    made = tuple(preview(work, placed, GAP, way) for way in WAYS)
    looks = Looks(quantities=("position", "velocity"))
    picture = curves_picture(
        work, [1, 2], looks, placed=placed, targets=[GAP], previewed=GAP, previews=made, way="spline"
    )
    assert [(p.title, p.unit) for p in picture.plots] == [
        ("x", "mm"), ("y", "mm"), ("z", "mm"),
        ("x, velocity", "mm/s"), ("y, velocity", "mm/s"), ("z, velocity", "mm/s"),
    ]  # fmt: skip
    assert picture.kinds == {"raw", "measured", "filled", "body", "preview"}
    x = {(line.kind, line.label): line for line in picture.plots[0].lines if line.kind != "preview"}
    truth = 1000 * moving()
    assert np.isnan(x["measured", "m1"].values[40:50]).all() and np.allclose(
        x["measured", "m1"].values[:40], truth[:40, 1, 0]
    )
    filled = x["filled", "m1"].values
    assert np.allclose(filled[39:51], truth[39:51, 1, 0], atol=1e-3), "it meets both ends"
    assert np.isnan(filled[:39]).all() and np.isnan(filled[51:]).all()
    assert np.isnan(x["measured", "m2"].values[80]) and x["raw", "m2"].values[80] == pytest.approx(
        truth[80, 2, 0] + 100
    )
    assert np.allclose(x["body", "m2"].values, truth[:, 2, 0] + 5)
    previews = [line for line in picture.plots[0].lines if line.kind == "preview"]
    assert (
        len(previews) == sum(p.values is not None for p in made) and [line.strong for line in previews].count(True) == 1
    )
    assert picture.plots[0].lines[-1].strong and previews[0].start == 39 and len(previews[0].values) == 12
    assert [(s.first, s.last, s.kind, s.target) for s in picture.shades] == [
        (40, 49, "filled", True), (80, 80, "outlier", False), (80, 80, "gap", False),
    ] or sorted((s.first, s.kind, s.target) for s in picture.shades) == [
        (40, "filled", True), (80, "gap", False), (80, "outlier", False),
    ]  # fmt: skip


def test_metres_and_components_and_what_is_left_out() -> None:
    work = work_of()
    picture = curves_picture(work, range(10), Looks((2,), raw=False, metres=True))
    assert [(p.title, p.unit) for p in picture.plots] == [("z", "m")] and picture.kinds == {"measured"}
    assert len(picture.names) == MOST and f"{MOST} of 10" in picture.note
    assert np.allclose(picture.plots[0].lines[0].values, work.raw.positions[:, 0, 2])
    nobody = curves_picture(work, [], Looks())
    assert nobody.plots == () and nobody.note == NOTHING


def test_velocity_and_acceleration_are_those_of_a_known_path() -> None:
    time = np.arange(200) / RATE
    track = np.stack([3 * time, 2 * time**2, np.sin(time)], axis=1)
    velocity, acceleration = (derivative(track, RATE, name) for name in ("velocity", "acceleration"))
    assert np.allclose(velocity[1:-1], np.stack([np.full(200, 3.0), 4 * time, np.cos(time)], axis=1)[1:-1], atol=1e-3)
    assert np.allclose(acceleration[1:-1, 1], 4.0) and np.allclose(
        acceleration[1:-1, 2], -np.sin(time)[1:-1], atol=1e-3
    )
    assert np.isnan(velocity[[0, -1]]).all()


def test_previews_say_their_error_and_why_not() -> None:
    work = work_of()
    without = preview(work, None, GAP, BODY)
    assert without.values is None and "no fit" in without.why_not
    by_body = preview(work, moving() + 0.004, GAP, BODY)
    assert by_body.values is not None and np.abs(by_body.values - moving()[40:50, 1]).max() < 1e-9
    made = tuple(preview(work, None, GAP, way) for way in WAYS)
    chosen = best(made)
    assert chosen is not None and chosen.error == min(p.error for p in made if p.values is not None)
    rows = ways_of(made[:3], {way: way for way in WAYS}, {})
    assert [row.error for row in rows[:3]] == [f"{1000 * e:.1f} mm" for e in sorted(p.error for p in made[:3])]
    assert rows[-1].error == "" and rows[-1].why_not == "", "it is still on its way"


def test_the_heading_says_what_an_edit_would_be_made_on() -> None:
    work = work_of(CleaningSettings(fills=((1, 40, 49, "rigid"),)))
    assert heading_of(work, [1], [GAP]) == "m1, frames 40 to 49 (0.2 s)"
    done = fill_in(work, (), GAP)
    assert done is not None and heading_of(work, [1], [GAP], done).endswith("filled by rigid")
    assert fill_in(work, (), Gap(2, 80, 80)) is None
    assert "m1 has 1 gap: N" in heading_of(work, [1], [])
    assert "markers have" in heading_of(work, [1, 2], [])
    assert "No marker is selected" in heading_of(work, [], [])


def test_proposals_are_listed_with_what_was_decided() -> None:
    swap, join = Proposal("swap", 40, 119, (3, 7), 0.02, "swap."), Proposal("join", 20, 30, (5, 9), 0.01, "join.")
    work = work_of()
    assert work.cleaned is not None
    cleaned = replace(work.cleaned, proposals=(swap, join))
    settings = CleaningSettings(swaps=((3, 7, 40),), rejected=(("join", 5, 9, 20),))
    rows = proposal_rows(replace(work, cleaned=cleaned, settings=settings))
    assert [(row.sentence, row.state, row.time) for row in rows] == [
        ("swap.", "accepted", "1.80 s"),
        ("join.", "rejected", "1.40 s"),
    ]
