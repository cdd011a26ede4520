"""The bar that plays: the clock's state and both readouts."""

from __future__ import annotations

from markerscope.app.actions import Actions
from markerscope.app.actions.play_actions import SET_RANGE, SET_SPEED
from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.transport import Readout, Transport

_BUTTONS = {
    "to_start": "play.home", "back": "play.back", "play": "play.toggle", "forward": "play.forward",
    "to_end": "play.end",
}  # fmt: skip
"""The action that each button does."""


class TransportBinder:
    """Shows the clock, and moves it."""

    def __init__(self, widget: Transport, bench: Workbench, table: Actions) -> None:
        self.widget, self.bench, self.table = widget, bench, table
        clock = bench.clock
        clock.moved.connect(lambda time: self.read())
        clock.changed.connect(self.read)
        widget.play_toggled.connect(lambda: table.trigger("play.toggle"))
        widget.stepped.connect(lambda frames: table.trigger("play.forward" if frames > 0 else "play.back"))
        widget.start_wanted.connect(lambda: table.trigger("play.home"))
        widget.end_wanted.connect(lambda: table.trigger("play.end"))
        widget.speed_chosen.connect(lambda speed: table.do(SET_SPEED, speed))
        widget.loop_toggled.connect(self._loop)
        self._loop_before: tuple[float, float] | None = None
        self.read()

    def read(self) -> None:
        """Say where the clock is."""
        clock = self.bench.clock
        timing, shown = clock.timing, clock.video_frame
        self.widget.set_state(clock.playing, clock.speed, clock.loop is not None)
        self.widget.set_reasons({name: self.table.why_not(action) for name, action in _BUTTONS.items()})
        self.widget.set_readouts(
            Readout(clock.marker_frame, timing.frames, clock.time),
            Readout(shown, len(timing.video), clock.video_time if shown is None else float(timing.video[shown])),
        )

    def _loop(self, on: bool) -> None:
        clock = self.bench.clock
        if on:
            self.table.do(SET_RANGE, self._loop_before or clock.span)
        else:
            self._loop_before = clock.loop
            self.table.do(SET_RANGE, None)
        self.read()
