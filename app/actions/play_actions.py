"""The clock: playing, stepping, ranges, and jumps to frames that matter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.actions.action import Action, Asks, first, needs
from markerscope.app.models.clock import Clock
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.names import FIT, MARKERS


def _empty(bench: Workbench) -> str:
    return "" if bench.clock.timing.frames else "there are no frames yet"


def _clock(act: Callable[[Clock], object]) -> Callable[[Workbench, Asks], object]:
    return lambda bench, asks: act(bench.clock)


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


def _next_gap(bench: Workbench, asks: Asks) -> None:
    """Go to the next frame from which one of the selected markers, or of all, is lost; beyond the last, to the first.

    Every marker's gaps count by themselves: in a real recording there is hardly a frame that shows them all.
    """
    markers = bench.board.current[MARKERS]
    chosen = sorted(m for m in bench.selection.markers if m < len(markers.labels)) or list(range(len(markers.labels)))
    lost = ~markers.present[:, chosen]
    begins = lost & ~np.concatenate([np.zeros((1, len(chosen)), bool), lost[:-1]])
    starts = np.flatnonzero(begins.any(axis=1))
    if not len(starts):
        whose = "the selected markers are" if bench.selection.markers else "every marker is"
        raise InputError(f"{whose} seen in every frame", "the next gap")
    here = bench.clock.marker_frame or 0
    later = starts[starts > here]
    frame = int(later[0] if len(later) else starts[0])
    if frame == here:
        bench.say(Said("note", "This is the only gap", "the next gap"))
    bench.clock.seek_marker_frame(frame)


def _action(id: str, title: str, help: str, act: Callable[[Clock], object], shortcut: str) -> Action:
    return Action(f"play.{id}", title, "Play", help, _clock(act), shortcut, _empty)


PLAY_ACTIONS = (
    Action(
        "play.toggle",
        "Play or stop",
        "Play",
        "Play by the clock; frames are dropped where drawing takes too long.",
        _clock(lambda clock: clock.toggle()),
        "Space",
        _empty,
        lambda bench: bench.clock.playing,
    ),
    _action("forward", "Step forward", "One marker frame on.", lambda clock: clock.step(1), "Right"),
    _action("back", "Step back", "One marker frame back.", lambda clock: clock.step(-1), "Left"),
    _action("forward_10", "Ten forward", "Ten marker frames on.", lambda clock: clock.step(10), "Shift+Right"),
    _action("back_10", "Ten back", "Ten marker frames back.", lambda clock: clock.step(-10), "Shift+Left"),
    _action("home", "Go to the start", "Of the range, else of the recording.", lambda clock: clock.home(), "Home"),
    _action("end", "Go to the end", "Of the range, else of the recording.", lambda clock: clock.end(), "End"),
    _action("slower", "Slower", "The next speed below.", lambda clock: clock.slower(), ","),
    _action("faster", "Faster", "The next speed above.", lambda clock: clock.faster(), "."),
    Action("range.from", "Range from here", "Play", "The range begins at this frame.", _from_here, "[", _empty),
    Action("range.to", "Range to here", "Play", "The range ends at this frame.", _to_here, "]", _empty),
    _action("no_range", "No range", "Play the whole recording.", lambda clock: clock.set_loop(None), "\\"),
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
        "Go to the next frame from which a selected marker, or any where none is selected, is lost.",
        _next_gap,
        "N",
        first(_empty, needs("markers", "the markers have not been read")),
    ),
)
