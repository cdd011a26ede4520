"""The bar that plays: the clock's state and both readouts."""

from __future__ import annotations

from markerscope.app.models.workbench import Workbench
from markerscope.widgets.panels.transport import Readout, Transport


class TransportBinder:
    """Shows the clock, and moves it."""

    def __init__(self, widget: Transport, bench: Workbench) -> None:
        self.widget, self.bench = widget, bench
        clock = bench.clock
        clock.moved.connect(lambda time: self.read())
        clock.changed.connect(self.read)
        widget.play_toggled.connect(clock.toggle)
        widget.stepped.connect(clock.step)
        widget.start_wanted.connect(clock.home)
        widget.end_wanted.connect(clock.end)
        widget.speed_chosen.connect(clock.set_speed)
        widget.loop_toggled.connect(self._loop)
        self._loop_before: tuple[float, float] | None = None
        self.read()

    def read(self) -> None:
        """Say where the clock is."""
        clock = self.bench.clock
        timing, shown = clock.timing, clock.video_frame
        self.widget.set_state(clock.playing, clock.speed, clock.loop is not None)
        self.widget.set_readouts(
            Readout(clock.marker_frame, timing.frames, clock.time),
            Readout(shown, len(timing.video), clock.video_time if shown is None else float(timing.video[shown])),
        )

    def _loop(self, on: bool) -> None:
        clock = self.bench.clock
        if on:
            clock.set_loop(self._loop_before or clock.span)
        else:
            self._loop_before = clock.loop
            clock.set_loop(None)
        self.read()
