"""From doubt to doubt along the clock: of the selected markers, or of all, each selected as it is reached."""

from __future__ import annotations

from collections.abc import Iterable

from markerscope.app.models.clock import Clock
from markerscope.app.models.selection import Selection
from markerscope.solver.cleaning.gaps import Gap


class Walk:
    """Where a walk goes on.

    A marker that was selected only because the walk came to it does not keep it to that marker.
    """

    def __init__(self, selection: Selection, clock: Clock) -> None:
        self._selection, self._clock = selection, clock
        self._scope: frozenset[int] = frozenset()
        self._reached: frozenset[int] = frozenset()

    @property
    def scope(self) -> frozenset[int]:
        """The markers that are walked through, empty for all."""
        chosen = self._selection.markers
        return self._scope if chosen and chosen == self._reached else chosen

    def go(self, stretches: Iterable[Gap], forward: bool) -> tuple[Gap, ...]:
        """Go to the next or previous frame at which stretches begin, round the ends, and select their markers.

        Returns the stretches that begin there; empty where there is none at all.
        """
        scope = self.scope
        wanted = [s for s in stretches if not scope or s.marker in scope]
        frames = sorted({s.first for s in wanted})
        if not frames:
            return ()
        here = self._clock.marker_frame or 0
        later, sooner = [f for f in frames if f > here], [f for f in frames if f < here]
        frame = (later or frames)[0] if forward else (sooner or frames)[-1]
        reached = tuple(s for s in wanted if s.first == frame)
        self.reach(frozenset(s.marker for s in reached), frame)
        return reached

    def reach(self, markers: frozenset[int], frame: int) -> None:
        """Select markers and go to a frame; the walk goes on as before from there."""
        self._scope = self.scope
        self._reached = markers
        self._selection.select_markers(markers)
        self._clock.seek_marker_frame(frame)
