"""Trajectories edited at random: nothing raises, no sample is shown twice, and undo leads back to the start."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.app.actions import Actions
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.cleaning.by_hand import NOWHERE
from markerscope.solver.pipeline.cleaning import CleaningSettings, require_markers
from markerscope.solver.pipeline.settings import from_table, to_table
from tests.app.actions.test_actions import Answers, actions, asks, bench, said, solved

__all__ = ["Answers", "actions", "asks", "bench", "said", "solved"]  # fixtures

NAMES = (
    "go.gap", "go.gap_back", "go.outlier", "fill.rigid", "fill.spline", "fill.linear", "fill.body", "tracks.delete",
    "tracks.cut", "tracks.exchange", "tracks.join", "tracks.put_back", "clean.accept_all", "clean.reject",
    "clean.reconsider", "edit.undo", "edit.redo", "no_range", "select.all",
)  # fmt: skip


@pytest.mark.parametrize("seed", [1])
def test_random_edits_keep_every_sample_in_one_place(
    actions: Actions, solved: Workbench, said: list[Said], seed: int
) -> None:
    rng, done = np.random.default_rng(seed), 0
    before = solved.board.settings["clean"]
    columns = len(solved.board.current["markers"].labels)
    for _ in range(90):
        kind = rng.integers(4)
        if kind == 0:
            solved.clock.seek_marker_frame(int(rng.integers(0, 101)))
        elif kind == 1:
            work = solved.working.now()
            assert work is not None
            count = work.edited.positions.shape[1]
            solved.selection.select_markers(rng.choice(count, int(rng.integers(0, 3)), replace=False).tolist())
        elif kind == 2:
            start = 2.0 + float(rng.uniform(0, 0.9))
            solved.clock.set_loop((start, start + 0.1))
        name = str(rng.choice(NAMES))
        done += actions.trigger(name if name in actions.table else f"play.{name}")
        settings = solved.board.settings["clean"]
        require_markers(settings, columns)
        assert from_table(CleaningSettings, to_table(settings)) == settings
        work = solved.working.now()
        assert work is not None and len(set(work.edited.labels)) == work.edited.positions.shape[1]
        for t in (0, 30, 60, 100):
            shown = work.sources[t][work.sources[t] != NOWHERE]
            assert len(set(shown.tolist())) == len(shown)
            seen = work.edited.present[t]
            places = work.raw.positions[t, work.sources[t][seen]]
            assert np.array_equal(places, work.edited.positions[t, seen])
    assert done > 25 and solved.board.settings["clean"] != before
    while actions.trigger("edit.undo"):
        pass
    assert solved.board.settings["clean"] == before and solved.board.state("fit") == "cached"
