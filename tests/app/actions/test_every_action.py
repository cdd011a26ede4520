"""No action does nothing without a word: each has an effect, or says why it has none."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from markerscope.app.actions import ACTIONS, Actions
from markerscope.app.models.home import Home
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.pipeline.session import Session
from tests.app.actions.test_actions import Answers

IDS = [action.id for action in ACTIONS]


def everything(bench: Workbench, asks: Answers) -> tuple[object, ...]:
    """All that an action could have an effect on."""
    document, clock = bench.document, bench.clock
    return (
        document.is_open,
        (document.session, document.history.position, document.folder, document.dirty) if document.is_open else None,
        bench.selection.state(),
        str(bench.display.state()),
        (clock.time, clock.loop, clock.speed, clock.playing),
        bench.runner.running,
        list(asks.asked),
    )


def silent(bench: Workbench, names: list[str]) -> list[str]:
    """Actions that leave neither a message nor an effect; each is tried as the one before has left the session."""
    asks, said = Answers(), list[Said]()
    bench.said.connect(said.append)
    actions, found = Actions(ACTIONS, bench, asks), []
    for name in names:
        before, told = everything(bench, asks), len(said)
        actions.trigger(name)
        if everything(bench, asks) == before and len(said) == told:
            found.append(name)
        if bench.runner.running:
            bench.runner.cancel()
    return found


@pytest.fixture
def bench(tmp_path: Path) -> Workbench:
    return Workbench(Home(tmp_path / "config", tmp_path / "data"))


LASTING = [name for name in IDS if name not in ("session.example", "session.close", "window.quit")]
"""Those that leave the session open that was."""


def test_with_nothing_open_every_action_does_or_says_something(bench: Workbench) -> None:
    assert not silent(bench, LASTING)
    assert not silent(bench, ["session.example"])
    bench.close()
    assert not silent(bench, ["session.close", "window.quit"])


def opened(bench: Workbench, session: Session) -> Workbench:
    bench.open(session.folder)
    end = time.monotonic() + 60
    while not bench.clock.timing.frames:
        assert time.monotonic() < end, "it never opened"
        bench.tick()
        time.sleep(0.005)
    return bench


@pytest.mark.parametrize("frame", [0, 50, 10**6])
def test_in_a_solved_session_every_action_does_or_says_something(
    bench: Workbench, session: Session, frame: int
) -> None:
    """At the first frame, between, and at the last; twice, since the second time may find it done."""
    opened(bench, session)
    bench.clock.seek_marker_frame(frame)
    assert not silent(bench, [name for name in LASTING for _ in range(2) if not name.startswith("run.")])
    bench.close()


@pytest.mark.parametrize(("name", "frame"), [("range.from", 10**6), ("range.to", 0)])
def test_a_range_that_would_be_empty_is_refused_and_the_one_there_is_kept(
    bench: Workbench, session: Session, name: str, frame: int
) -> None:
    opened(bench, session)
    said: list[Said] = []
    bench.said.connect(said.append)
    bench.clock.set_loop((2.2, 2.6))
    before = bench.clock.loop
    bench.clock.seek_marker_frame(frame)
    assert not Actions(ACTIONS, bench, Answers()).trigger(name)
    assert bench.clock.loop == before
    assert "frame is shown" in said[-1].what
    bench.close()
