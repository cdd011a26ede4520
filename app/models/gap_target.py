"""What an edit of trajectories is made on: the range, or the gap that the clock is in."""

from __future__ import annotations

from collections.abc import Collection

from markerscope.app.models.clock import Clock
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.gaps import Gap


def span_of(clock: Clock) -> tuple[int, int] | None:
    """First and last frame of the range, None without one."""
    if clock.loop is None:
        return None
    timing = clock.timing
    first, last = (round((end - timing.first) * timing.rate) for end in clock.loop)
    return max(first, 0), min(last, timing.frames - 1)


def target_gaps(work: Working, clock: Clock, markers: Collection[int]) -> tuple[Gap, ...]:
    """The gaps of some markers that are meant: those in the range while the clock is in it, else the one it is in."""
    here, span = clock.marker_frame or 0, span_of(clock)
    if span is not None and span[0] <= here <= span[1]:
        first, last = span
    else:
        first = last = here
    return tuple(gap for m in sorted(markers) for gap in work.gaps_of(m, first, last))
