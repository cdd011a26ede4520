"""One selection: markers and what they share, told once, brought back as it was."""

from __future__ import annotations

import json

import numpy as np
import pytest

from markerscope.app.models.selection import Selection

CLUSTERS = np.array([0, 0, 1, 1, 1, -1])
BONES = np.array([4, 4, 4, 7, 7, -1])


@pytest.fixture
def selection() -> Selection:
    selection = Selection()
    selection.set_groups(CLUSTERS, BONES)
    return selection


def heard_by(selection: Selection) -> list[set[str]]:
    heard: list[set[str]] = []
    selection.changed.connect(lambda names: heard.append(set(names)))
    return heard


def test_markers_say_what_they_share(selection: Selection) -> None:
    selection.select_markers([0, 1])
    assert (selection.cluster, selection.bone, selection.pair) == (0, 4, (0, 1))
    selection.select_markers([2], "add")
    assert (selection.cluster, selection.bone, selection.pair) == (None, 4, None)
    selection.select_markers([5])
    assert (selection.cluster, selection.bone) == (None, None)


def test_ways_to_select(selection: Selection) -> None:
    selection.select_markers(np.array([0, 2]))
    selection.select_markers([2, 3], "toggle")
    assert selection.markers == {0, 3}
    selection.select_markers([3], "remove")
    assert selection.markers == {0}


def test_a_cluster_and_a_bone_select_their_markers(selection: Selection) -> None:
    selection.select_cluster(1)
    assert selection.markers == {2, 3, 4}
    selection.select_bone(4)
    assert selection.markers == {0, 1, 2}
    selection.select_bone(9)
    assert (selection.markers, selection.bone) == (frozenset(), 9)


def test_each_change_is_told_once_with_its_names(selection: Selection) -> None:
    heard = heard_by(selection)
    selection.select_markers([0, 1])
    selection.select_markers([1, 0])
    selection.select(candidate=2, stage="fit")
    selection.select(candidate=2)
    assert heard == [{"markers", "cluster", "pair", "bone"}, {"candidate", "stage"}]


def test_other_clusters_are_told_if_they_change_what_is_shared(selection: Selection) -> None:
    selection.select_markers([2, 3])
    heard = heard_by(selection)
    selection.set_groups(np.array([0, 0, 1, 2, 2, -1]), BONES)
    selection.set_groups(np.array([0, 0, 1, 2, 2, 3]), BONES)
    assert heard == [{"cluster"}]


def test_it_is_brought_back_as_it_was(selection: Selection) -> None:
    selection.select_markers([0, 4])
    selection.select(candidate=1, hypothesis=3, stage="orient")
    again = Selection()
    again.set_groups(CLUSTERS, BONES)
    again.restore(json.loads(json.dumps(selection.state())))
    assert again.state() == selection.state()


@pytest.mark.parametrize("state", [{}, {"markers": "x"}, {"markers": [1.5, -1, None]}, {"stage": 3, "bone": "hip"}])
def test_a_damaged_state_selects_nothing(selection: Selection, state: dict) -> None:
    selection.restore(state)
    assert (selection.markers, selection.stage, selection.bone) == (frozenset(), None, None)


def test_unknown_things_cannot_be_selected(selection: Selection) -> None:
    with pytest.raises(TypeError, match="nothing to select is called colour"):
        selection.select(colour=1)


def test_markers_that_are_gone_are_forgotten(selection: Selection) -> None:
    selection.select_markers([1, 5])
    selection.keep_within(3)
    assert selection.markers == {1}
