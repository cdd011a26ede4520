"""What the cleaning cut and proposed: looked at, put back, made true, and undone. Without a window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.app.actions import Actions
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.cleaning.clean import Cut
from markerscope.solver.cleaning.swaps import Proposal
from tests.app.actions.test_actions import Answers, actions, asks, bench, said, solved

__all__ = ["Answers", "actions", "asks", "bench", "said", "solved"]  # fixtures

SWAP = Proposal("swap", 40, 100, (3, 7), 0.02, "c and g exchange from frame 40 on.")
JOIN = Proposal("join", 60, 80, (5, 9), 0.01, "e goes on as i in frames 60 to 80.")


@pytest.fixture
def cleaned(solved: Workbench) -> Workbench:
    """The session's cleaning as if it had cut frames 10 to 12 and 50 of marker 4, and proposed two edits."""
    board = solved.board
    key, value = board.keys["clean"], board.current["clean"]
    about = dict(board.results.entry("clean", key).about)  # type: ignore[union-attr]
    frames = np.array([10, 11, 12, 50])
    cut = Cut(frames, np.full(4, 4), np.zeros((4, 3)), np.zeros(4, bool))
    board.results.store.discard("clean", key)
    board.results.store.put("clean", key, replace(value, outliers=cut, proposals=(JOIN, SWAP)), about)
    board.results.forget("clean", key)
    board.refresh()
    return solved


def test_proposals_are_gone_through_and_made_true(actions: Actions, cleaned: Workbench, said: list[Said]) -> None:
    assert "no edit is proposed for the selected markers" in actions.why_not("clean.accept")
    assert actions.trigger("clean.next")
    assert (cleaned.clock.marker_frame, cleaned.selection.markers) == (40, {3, 7})
    assert said[-1].what == "c and g exchange from frame 40 on" and said[-1].remedy
    assert actions.trigger("clean.next")
    assert (cleaned.clock.marker_frame, cleaned.selection.markers) == (60, {5, 9})
    assert actions.trigger("clean.next")
    assert cleaned.clock.marker_frame == 40, "it begins again"
    assert actions.trigger("clean.accept")
    assert cleaned.board.settings["clean"].swaps == ((3, 7, 40),)
    assert cleaned.board.state("clean") != "cached", "it has to be cleaned anew"
    assert actions.trigger("edit.undo")
    assert cleaned.board.settings["clean"].swaps == () and cleaned.board.state("clean") == "cached"


def test_what_was_cut_is_put_back(actions: Actions, cleaned: Workbench) -> None:
    assert actions.why_not("clean.keep") == "no marker is selected"
    cleaned.selection.select_markers([1])
    assert "nothing was cut" in actions.why_not("clean.keep")
    cleaned.selection.select_markers([1, 4])
    cleaned.clock.seek_marker_frame(14)
    assert actions.trigger("clean.keep")
    assert cleaned.board.settings["clean"].keep == ((4, 10, 12),), "the stretch next to the clock"
    assert actions.trigger("edit.undo")
    first = cleaned.clock.timing.first
    cleaned.clock.set_loop((first, first + 0.9))
    assert actions.trigger("clean.keep")
    assert cleaned.board.settings["clean"].keep == ((4, 10, 50),), "all of the range"
    assert actions.trigger("edit.undo")
    assert cleaned.board.settings["clean"].keep == ()


def test_without_proposals_it_says_so(actions: Actions, solved: Workbench) -> None:
    if solved.board.current["clean"].proposals:
        pytest.skip("the embedded session has some")
    assert actions.why_not("clean.next") == "no edit of tracks is proposed"
