"""Events of a C3D: read as several programs write them, written so that others read them, all else left as it was."""

from __future__ import annotations

from pathlib import Path

import ezc3d
import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.events.event import Event
from markerscope.solver.events.recorded import from_file, to_file
from markerscope.solver.io.c3d_events import FileEvent, events_of, with_events
from markerscope.solver.io.c3d_format import decode_c3d
from tests.io.c3d_bytes import c3d_bytes

POINTS = np.random.default_rng(0).normal(0, 500, (30, 4, 3))


def file_with(contexts: list[str], labels: list[str], times: list[float]) -> bytes:
    pairs = np.array([[t // 60, t % 60] for t in times])
    stored = pairs.reshape(2, -1)  # minutes and seconds in turns, of dimensions (2, N) as the format counts them
    group = {"USED": np.array(len(times)), "CONTEXTS": contexts, "LABELS": labels, "TIMES": stored}
    return c3d_bytes(POINTS, groups={"EVENT": group})


@pytest.mark.parametrize(
    ("context", "label", "side", "kind"),
    [
        ("Left", "Foot Strike", "left", "foot_strike"),
        ("Right", "Foot Off", "right", "foot_off"),
        ("LHS", "", "left", "foot_strike"),
        ("RTO", "", "right", "foot_off"),
        ("", "Right Heel Strike", "right", "foot_strike"),
        ("", "left_toe_off", "left", "foot_off"),
        ("General", "LTO", "left", "foot_off"),
        ("General", "Foot Strike", "general", "other"),
        ("General", "Seating5", "general", "other"),
        ("Left", "Heel Off", "left", "other"),
        ("Right", "Reached", "right", "other"),
    ],
)
def test_every_dialect_says_whose_foot_and_what(context: str, label: str, side: str, kind: str) -> None:
    (event,) = from_file([FileEvent(1.0, context, label)])
    assert (event.side, event.kind) == (side, kind)


def test_minutes_count(tmp_path: Path) -> None:
    data = file_with(["Left", "Right"], ["Foot Strike", "Foot Off"], [61.5, 2.25])
    found = events_of(decode_c3d(data, "x.c3d"))
    assert [round(event.time, 4) for event in found] == [61.5, 2.25]


@pytest.mark.parametrize("before", [c3d_bytes(POINTS), c3d_bytes(POINTS, more_blocks=3)])
@pytest.mark.parametrize("count", [0, 1, 3, 200])
def test_another_reader_finds_what_was_written(before: bytes, count: int, tmp_path: Path) -> None:
    rng = np.random.default_rng(count)
    events = tuple(
        Event(float(t), ("left", "right")[i % 2], ("foot_strike", "foot_off")[i // 2 % 2], "markers")  # type: ignore[arg-type]
        for i, t in enumerate(np.sort(rng.uniform(0, 0.3, count)))
    )
    path = tmp_path / "a.c3d"
    path.write_bytes(with_events(before, "a.c3d", to_file(events)))
    read = ezc3d.c3d(str(path))
    assert np.allclose(read["data"]["points"][:3].transpose(2, 1, 0), POINTS, atol=1e-3)
    section = read["parameters"]["EVENT"]
    assert section["USED"]["value"][0] == count
    if count:
        assert np.allclose(section["TIMES"]["value"][1], [e.time for e in events], atol=1e-6)
        assert section["CONTEXTS"]["value"] == [e.side.capitalize() for e in events]
    again = from_file(events_of(decode_c3d(path.read_bytes(), path)))
    assert [(e.side, e.kind) for e in again] == [(e.side, e.kind) for e in events]


def test_a_second_writing_takes_the_place_of_the_first() -> None:
    once = with_events(c3d_bytes(POINTS), "a.c3d", [FileEvent(0.1, "Left", "Foot Strike")] * 5)
    twice = with_events(once, "a.c3d", [FileEvent(0.2, "Right", "Foot Off")])
    (event,) = events_of(decode_c3d(twice, "a.c3d"))
    assert (round(event.time, 5), event.context, event.label) == (0.2, "Right", "Foot Off")


def test_more_events_than_the_section_holds_are_refused() -> None:
    with pytest.raises(InputError, match="256 events do not fit"):
        with_events(c3d_bytes(POINTS), "a.c3d", [FileEvent(0.1, "Left", "Foot Strike")] * 256)


def test_a_laboratory_file_keeps_all_else(shared_data: Path, tmp_path: Path) -> None:
    path = shared_data / "gait" / "HC031A06.c3d"
    if not path.is_file():
        pytest.skip("the walks are not there")
    made = tmp_path / "a.c3d"
    old = path.read_bytes()
    made.write_bytes(with_events(old, path, [FileEvent(1.9, "Left", "Foot Strike")]))
    before, after = ezc3d.c3d(str(path)), ezc3d.c3d(str(made))
    assert np.array_equal(before["data"]["analogs"], after["data"]["analogs"])
    assert np.array_equal(before["data"]["points"], after["data"]["points"], equal_nan=True)
    assert set(before["parameters"]) == set(after["parameters"])
    assert len(from_file(events_of(decode_c3d(old, path)))) == 8
