"""What is out of date is drawn as such in every view, and a result that was undone is drawn in none."""

from __future__ import annotations

import random
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from markerscope.app.models import edits
from markerscope.app.models.display import COLOURS
from markerscope.app.models.fields import title
from markerscope.app.window.bind_dated import DRAWN
from markerscope.app.window.main import MainWindow
from markerscope.solver.pipeline.run import keys_of, run_session
from markerscope.solver.pipeline.session import Session
from markerscope.widgets.images import to_rgb
from markerscope.widgets.plots.rows import CurveRow
from markerscope.widgets.theme import colours

Spin = Callable[..., None]


def settled(window: MainWindow) -> bool:
    """Whether every view has what there is to draw."""
    board = window.bench.board
    waiting = [stage for stage in window.shown._refs | board.keys if stage in STAGES and wanted(window, stage) is False]
    return not waiting and not window.bench.runner.running


STAGES = frozenset(stage for drawn in DRAWN.values() for stage in drawn)


def wanted(window: MainWindow, stage: str) -> bool:
    latest = window.bench.board.latest(stage)
    return window.shown.key(stage) == (None if latest is None else latest[0])


def near(picture: np.ndarray, rgb: tuple[int, int, int], within: int = 40) -> int:
    """How many pixels have nearly a colour."""
    return int((np.abs(picture.astype(int) - np.array(rgb)).max(axis=2) < within).sum())


class Record:
    """By stage, what was the answer of the settings, state by state of the history: kept apart from the models."""

    def __init__(self, session: Session) -> None:
        self.line: list[dict[str, str]] = [{}]
        self.at = 0
        self.note(session)

    def note(self, session: Session) -> None:
        self.line[self.at] |= {s: k for s, k in keys_of(session).items() if (session.store.root / s / k).is_dir()}

    def step(self, session: Session) -> None:
        self.line = [*self.line[: self.at + 1], {}]
        self.at += 1
        self.note(session)

    def go(self, to: int, session: Session) -> None:
        self.at = to
        self.note(session)

    def last(self, stage: str) -> str | None:
        return next((state[stage] for state in self.line[self.at :: -1] if stage in state), None)


def residual_row(window: MainWindow) -> CurveRow:
    return next(row for row in window.timelines.rows.shown_rows() if row.name == "Residual")


def check(window: MainWindow, record: Record) -> None:
    """Every view draws the answer of the settings, or the one that was so last and says that it is out of date."""
    bench, shown, board = window.bench, window.shown, window.bench.board
    now = keys_of(bench.document.session)
    key = record.last("fit")
    old = key != now["fit"]
    assert shown.key("fit") == key
    motion = board.results.get("fit", key)
    # The scene: pose, stripes, legend.
    track = window.scene_binder._body[0]
    assert track is shown.track and np.array_equal(track.trans, motion.trans)
    assert window.scene_binder._body[-1] == old
    legend, sections = window.scene._sheet.legend, []
    while legend is not None:
        sections.append(legend.title)
        legend = legend.also
    assert ("Out of date" in sections) == old
    # The residual over time.
    own = [curve for curve in residual_row(window).curves if curve.label in ("fit in force", "fit, out of date")]
    assert [curve.label for curve in own] == ["fit, out of date" if old else "fit in force"]
    assert (own[0].old, own[0].dashed) == (old, False)
    both = min(len(own[0].values), len(motion.residual))  # every range begins alike
    expected = 1000 * np.nanmean(motion.residual, axis=1)[:both]
    assert np.allclose(own[0].values[:both], expected, atol=1e-3, equal_nan=True)
    assert all(curve.dashed for curve in residual_row(window).curves if curve is not own[0])
    # The angles.
    said = record.last("angles")
    angles, old_angles = board.results.get("angles", said), said != now["angles"]
    curve = window.angles._all[0].curves[0]
    kept = np.where(angles.singular, np.nan, angles.degrees)[:, angles.names.index(curve.name)]
    assert np.array_equal(curve.degrees, kept, equal_nan=True)
    assert window.angles._title.text().startswith("Out of date") == old_angles
    assert window.angles.plots._old == old_angles
    # Cards, and the note above every panel.
    for stage in board.names:
        last, card = record.last(stage), board.card(stage)
        state = "not run" if last is None else "cached" if last == now[stage] else "stale"
        assert card.state == state, stage
        said_so = {"stale": {"out of date"}, "cached": {"done", "to check"}}.get(state, {state})
        assert window.stages.card(stage)._state.text() in said_so
    for name, panel in window.dated.items():
        drawn = [s for s in DRAWN[name] if s in now and shown.get(s) is not None]
        expected = [s for s in drawn if record.last(s) != now[s]]
        for stage in expected:
            assert title(stage) in panel.note.text(), (name, stage)
        assert bool(panel.note.text()) == bool(expected) == (not panel.note.isHidden()), name
    # The video.
    if shown.get("landmarks") is not None and bench.clock.video_frame is not None:
        assert ("out of date" in window.video._text) == (old or record.last("sync") != now["sync"])


@pytest.fixture
def window(solved_window: Any, spin: Spin) -> MainWindow:
    made: MainWindow = solved_window()
    made.angles.setVisible(True)
    spin(lambda: settled(made), "the results")
    return made


@pytest.fixture
def two_fits(session: Session) -> None:
    """The fit in force, and a newer one of another candidate that was pinned and given up again."""
    run_session(edits.pin_candidate(session, 1).session, ["fit", "angles"])


def test_a_walk_over_decisions_draws_no_answer_that_was_given_up(
    two_fits: None, window: MainWindow, spin: Spin
) -> None:
    bench, document, chance = window.bench, window.bench.document, random.Random(5)
    record = Record(document.session)
    check(window, record)

    def apply(edit: edits.Edit) -> None:
        before = document.history.position
        bench.apply(edit)
        if document.history.position > before:
            record.step(document.session)

    def go(by: int) -> None:
        document.go_to(document.history.position + by)
        record.go(document.history.position, document.session)

    script = ["pin", "undo", "range"]  # as it was reported
    others = ["pin", "unpin", "offset", "range", "undo", "undo", "redo"]
    seen = set()
    for step in [*script, "undo", "pin", "offset", *(chance.choice(others) for _ in range(3))]:
        session = document.session
        if step == "pin":
            apply(edits.pin_candidate(session, 1))
        elif step == "unpin":
            apply(edits.unpin_candidate(session))
        elif step == "offset":
            apply(edits.Edit("Offset", edits.set_offset(session, chance.choice([0.35, 0.39])).session))
        elif step == "range":
            apply(edits.Edit("Range", edits.set_range(session, 2.0, chance.choice([2.8, 2.9, 3.0])).session))
        else:
            go(-1 if step == "undo" else 1)
        spin(lambda: settled(window), step)
        spin(lambda: not window.bench.reading, "the markers")
        record.note(document.session)
        spin(lambda: settled(window), step)
        spin()
        check(window, record)
        seen.add((bench.board.state("fit"), record.last("fit")))
    assert len(seen) == 4, "both fits, in force and out of date"


def test_what_is_out_of_date_is_seen_to_be_so(window: MainWindow, spin: Spin) -> None:
    window.scene.set_selected([])
    window.raise_dock("angles")
    spin()
    before = {name: to_rgb(view.image() if name == "scene" else view.grab().toImage()) for name, view in views(window)}
    window.bench.apply(edits.set_value(window.bench.document.session, "orient", "offset_mm", 12.0))
    spin(lambda: settled(window), "the views")
    spin()
    after = {name: to_rgb(view.image() if name == "scene" else view.grab().toImage()) for name, view in views(window)}
    warning = colours().warning
    assert near(after["scene"], warning, 60) > near(before["scene"], warning, 60) + 500, "stripes"
    assert near(after["angles"], warning) > near(before["angles"], warning) + 20, "words"
    for name in ("candidates", "hypotheses", "convergence", "markers", "timelines", "angles"):
        panel = window.dated[name]
        window.raise_dock(name)
        spin()
        assert panel.note.isVisible(), name
        assert near(to_rgb(panel.note.grab().toImage()), warning) > 30, name
    for name in ("affinity",):
        assert not window.dated[name].note.text(), "the groups are as they were"
    window.bench.document.undo()
    spin(lambda: settled(window), "the views")
    spin()
    again = to_rgb(window.scene.image())
    assert near(again, warning, 60) < near(before["scene"], warning, 60) + 50


def views(window: MainWindow) -> list[tuple[str, Any]]:
    return [("scene", window.scene), ("angles", window.angles.plots)]


def test_candidates_that_are_out_of_date_are_not_pinned(window: MainWindow, spin: Spin) -> None:
    window.bench.apply(edits.set_value(window.bench.document.session, "orient", "offset_mm", 12.0))
    spin(lambda: settled(window), "the views")
    session = window.bench.document.session
    window.candidates.pin_requested.emit(1)
    window.hypotheses.pin_requested.emit(1)
    assert window.bench.document.session == session
    assert "out of date" in window.said[-1].what  # type: ignore[attr-defined]


def test_all_that_a_view_draws_is_in_its_list() -> None:
    """The lists name no stage that is not drawn, and every stage that is drawn; the head says itself what is old."""
    from markerscope.app.window.bind_glance import STANDS_ON
    from markerscope.app.window.shown import WANTED

    assert set(WANTED) == STAGES | set(STANDS_ON)


def test_every_layer_can_be_hidden_while_the_clock_moves(window: MainWindow, spin: Spin) -> None:
    display, clock = window.bench.display, window.bench.clock
    window.bench.selection.select_markers([0, 3])
    layers = list(display.layers)
    for k, layer in enumerate(["markers"] * len(COLOURS) + layers):  # colours are the markers' own
        display.set(colour_by=COLOURS[k % len(COLOURS)])
        before = display.layers[layer]
        for shown in (not before, before):
            display.show(layer, shown)
            clock.step(1)
            spin()
