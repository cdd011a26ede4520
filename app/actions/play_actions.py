"""The clock: playing, stepping, ranges, and jumps to frames that matter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, Reason, first, needs
from markerscope.app.models.clock import SPEEDS, Clock
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.names import FIT


def _empty(bench: Workbench) -> str:
    return "" if bench.clock.timing.frames else "there are no frames yet"


def _clock(act: Callable[[Clock], object]) -> Callable[[Workbench, Asks], object]:
    return lambda bench, asks: act(bench.clock)


def _still_at(frame: Callable[[Clock], int | None], said: str) -> Reason:
    """A frame is shown already, and nothing plays."""

    def why_not(bench: Workbench) -> str:
        clock = bench.clock
        return said if not clock.playing and clock.marker_frame == frame(clock) else ""

    return first(_empty, why_not)


def _first(clock: Clock) -> int | None:
    return 0


def _last(clock: Clock) -> int | None:
    return clock.timing.frames - 1


def _home(clock: Clock) -> int | None:
    return clock.timing.marker_frame(clock.loop[0] if clock.loop else clock.span[0])


def _end(clock: Clock) -> int | None:
    return clock.timing.marker_frame(clock.loop[1] if clock.loop else clock.span[1])


_AT_FIRST = _still_at(_first, "the first frame is shown")
_AT_LAST = _still_at(_last, "the last frame is shown")


def _one_frame(bench: Workbench) -> str:
    return "" if bench.clock.timing.frames > 1 else "there is but one frame"


def _nothing_after(bench: Workbench) -> str:
    clock = bench.clock
    if clock.marker_frame == _last(clock):
        return "the last frame is shown, and a range needs a frame after its first"
    return "the range begins here already" if clock.loop is not None and clock.loop[0] == clock.time else ""


def _nothing_before(bench: Workbench) -> str:
    clock = bench.clock
    if clock.marker_frame == _first(clock):
        return "the first frame is shown, and a range needs a frame before its last"
    return "the range ends here already" if clock.loop is not None and clock.loop[1] == clock.time else ""


def _slowest(bench: Workbench) -> str:
    return "this is the slowest" if bench.clock.speed <= SPEEDS[0] else ""


def _fastest(bench: Workbench) -> str:
    return "this is the fastest" if bench.clock.speed >= SPEEDS[-1] else ""


def _no_range(bench: Workbench) -> str:
    return "" if bench.clock.loop is not None else "no range is set"


def _too_short(bench: Workbench, ends: tuple[float, float] | None) -> str:
    if reason := _empty(bench):
        return reason
    clock = bench.clock
    if ends is None:
        return ""
    start, stop = (min(max(end, clock.span[0]), clock.span[1]) for end in sorted(ends))
    return "" if stop - start >= 1 / clock.timing.rate else "the range is shorter than a frame"


SET_RANGE: ActionWith[tuple[float, float] | None] = ActionWith(
    "range.set", "Range", lambda bench, asks, ends: bench.clock.set_loop(ends), _too_short
)
SET_SPEED: ActionWith[float] = ActionWith(
    "play.speed", "Speed", lambda bench, asks, speed: bench.clock.set_speed(speed)
)
PLAY_WITH = (SET_RANGE, SET_SPEED)


def _from_here(bench: Workbench, asks: Asks) -> None:
    clock = bench.clock
    clock.set_loop((clock.time, clock.loop[1] if clock.loop and clock.loop[1] > clock.time else clock.span[1]))


def _to_here(bench: Workbench, asks: Asks) -> None:
    clock = bench.clock
    clock.set_loop((clock.loop[0] if clock.loop and clock.loop[0] < clock.time else clock.span[0], clock.time))


def _worst(bench: Workbench, asks: Asks) -> None:
    """Go to the frame in which the selected markers, or all, are furthest from their places."""
    residual = bench.board.current[FIT].residual
    chosen = sorted(bench.selection.markers) or slice(None)
    known = np.nan_to_num(residual[:, chosen], nan=-1.0)
    if known.size == 0 or known.max() < 0:
        raise InputError("the selected markers have no residual", "the worst frame", "select others")
    bench.clock.seek_marker_frame(int(np.argmax(known.max(axis=1))))


def _walk_gaps(forward: bool) -> Callable[[Workbench, Asks], object]:
    """Go to the next or previous frame from which one of the selected markers, or of all, is lost, round the ends.

    Every marker's gaps count by themselves: in a real recording there is hardly a frame that shows them all.
    """

    def run(bench: Workbench, asks: Asks) -> None:
        work, here = bench.working.now(), bench.clock.marker_frame or 0
        assert work is not None
        which = "the next gap" if forward else "the previous gap"
        whose = "the selected markers are" if bench.walk.scope else "every marker is"
        if not bench.walk.go(work.gaps, forward):
            raise InputError(f"{whose} seen in every frame", which)
        if bench.clock.marker_frame == here:
            bench.say(Said("note", "This is the only gap", which))

    return run


def _no_tracks(bench: Workbench) -> str:
    return "" if bench.working.now() is not None else "the markers have not been read"


def _action(
    id: str, title: str, help: str, act: Callable[[Clock], object], shortcut: str, why_not: Reason = _empty
) -> Action:
    return Action(f"play.{id}", title, "Play", help, _clock(act), shortcut, why_not)


PLAY_ACTIONS = (
    Action(
        "play.toggle",
        "Play or stop",
        "Play",
        "Play by the clock; frames are dropped where drawing takes too long.",
        _clock(lambda clock: clock.toggle()),
        "Space",
        first(_empty, _one_frame),
        lambda bench: bench.clock.playing,
    ),
    _action("forward", "Step forward", "One marker frame on.", lambda clock: clock.step(1), "Right", _AT_LAST),
    _action("back", "Step back", "One marker frame back.", lambda clock: clock.step(-1), "Left", _AT_FIRST),
    _action(
        "forward_10", "Ten forward", "Ten marker frames on.", lambda clock: clock.step(10), "Shift+Right", _AT_LAST
    ),
    _action("back_10", "Ten back", "Ten marker frames back.", lambda clock: clock.step(-10), "Shift+Left", _AT_FIRST),
    _action(
        "home",
        "Go to the start",
        "Of the range, else of the recording.",
        lambda clock: clock.home(),
        "Home",
        _still_at(_home, "the start is shown"),
    ),
    _action(
        "end",
        "Go to the end",
        "Of the range, else of the recording.",
        lambda clock: clock.end(),
        "End",
        _still_at(_end, "the end is shown"),
    ),
    _action("slower", "Slower", "The next speed below.", lambda clock: clock.slower(), ",", first(_empty, _slowest)),
    _action("faster", "Faster", "The next speed above.", lambda clock: clock.faster(), ".", first(_empty, _fastest)),
    Action(
        "range.from",
        "Range from here",
        "Play",
        "The range begins at this frame.",
        _from_here,
        "[",
        first(_empty, _nothing_after),
    ),
    Action(
        "range.to",
        "Range to here",
        "Play",
        "The range ends at this frame.",
        _to_here,
        "]",
        first(_empty, _nothing_before),
    ),
    _action(
        "no_range",
        "No range",
        "Play the whole recording.",
        lambda clock: clock.set_loop(None),
        "\\",
        first(_empty, _no_range),
    ),
    Action(
        "go.worst",
        "Worst frame",
        "Play",
        "Go to where the selected markers, or all, are furthest from where the body puts them.",
        _worst,
        "W",
        first(_empty, needs("fit", "there is no fit")),
    ),
    Action(
        "go.gap",
        "Next gap",
        "Play",
        "Go to the next frame from which a selected marker, or any where none is selected, is lost, and select it.",
        _walk_gaps(True),
        "N",
        first(_empty, _no_tracks),
    ),
    Action(
        "go.gap_back",
        "Previous gap",
        "Play",
        "Go to the previous frame from which a selected marker, or any where none is selected, is lost, and select it.",
        _walk_gaps(False),
        "Shift+N",
        first(_empty, _no_tracks),
    ),
)
