"""Which of several accounts of the same steps is believed."""

from __future__ import annotations

from collections.abc import Sequence

from markerscope.solver.events.event import OFF, STRIKE, Event, in_order

SAME_S = 0.15
"""Two events of one foot and kind that lie closer together are the same one."""


def merged(*accounts: Sequence[Event]) -> tuple[Event, ...]:
    """All events, the best account first: where two accounts have the same step, the earlier account's stays."""
    kept: list[Event] = []
    for account in accounts:
        kept += [event for event in account if not any(same(event, other) for other in kept)]
    return in_order(kept)


def same(one: Event, other: Event) -> bool:
    """Whether two accounts mean one step."""
    if one.side != other.side or one.kind != other.kind or one.kind not in (STRIKE, OFF):
        return False
    return abs(one.time - other.time) < SAME_S
