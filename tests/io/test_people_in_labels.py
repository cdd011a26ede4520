"""A colon in a label is not a person yet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from markerscope.solver.core.markers import Markers
from markerscope.solver.io import list_subjects, load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.labels import subjects_of


@pytest.mark.parametrize(
    ("labels", "people"),
    [
        (["Anna:KNE", "Anna:TOE", "Anna:C7", "Unlabeled:1000", "Unlabeled:1001"], ("Anna",)),
        (["Anna:KNE", "Anna:TOE", "unlabelled marker:1", "Unidentified:2", "unknown:KNE"], ("Anna",)),
        (["RB0:Marker0", "RB0:Marker1", "RB1:Marker0", "RB1:Marker1"], ()),
        (["pelvis:1", "pelvis:2", "thigh:1", "thigh:2"], ()),
        (["L:KNE", "L:TOE", "R:KNE", "R:TOE"], ()),
        (["Left:KNE", "Left:TOE", "Left:ANK", "Left:HEE", "Right:KNE"], ()),
        (["arm:elbow", "arm:wrist", "leg:knee"], ()),
        (["Anna:KNE", "Anna:TOE", "Bob:KNE", "Bob:ANK"], ("Anna", "Bob")),
        (["Anna:A", "Anna:B", "Anna:C", "Anna:D", "box:E", "box:F", "box:G", "box:H"], ("Anna", "box")),
        (["*12:30", "C7", "T10"], ()),
    ],
)
def test_who_is_a_person(
    labels: list[str], people: tuple[str, ...], tmp_path: Path, recording: Callable[..., Markers]
) -> None:
    assert subjects_of(labels, ()) == people
    write_trc(tmp_path / "a.trc", recording(1, count=len(labels), labels=labels, lost=0))
    assert list_subjects(tmp_path / "a.trc") == people
    markers = load_markers(tmp_path / "a.trc")
    if len(people) < 2:
        assert len(markers.labels) == len(labels)
        kept = [label for label in labels if label.partition(":")[0] not in people]
        assert {label.replace(" ", "_") for label in kept} <= set(markers.labels)


def test_what_the_file_lists_counts() -> None:
    labels = ["1:1", "1:2", "2:1", "2:2"]
    assert subjects_of(labels, ()) == ()
    assert subjects_of(labels, ("1", "2")) == ("1", "2")
    assert subjects_of(["RB:A", "RB:B", "RB:C", "RB:D", "Anna:A"], (), ("RB",)) == ("Anna",)
