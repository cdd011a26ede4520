"""A lone limb whose side rests on the video alone, with clocks that may be wrong."""

from __future__ import annotations

from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

LEAST_SYNC = 0.3
LEAST_LEAD = 4.6
"""Nats by which the offset must be ahead of every other, where the sync is not sure of it."""


def sure_of_side(seen: Evidence, confidence: float) -> float:
    """0..1, of a confidence that holds if the offset is right; if not, a lone limb is as likely the other side's."""
    if len(_sides(seen)) != 1:
        return confidence
    return seen.sync_confidence * confidence + (1 - seen.sync_confidence) * min(confidence, 0.5)


def _sides(seen: Evidence) -> set[str]:
    return {JOINTS[j].split("_")[0] for j in seen.joint if j >= 0 and "_" in JOINTS[j]}


def lone_limb(seen: Evidence) -> Doubt | None:
    """Say that left and right cannot be told apart where another offset is as good: half a cycle swaps the legs."""
    sides = _sides(seen)
    if len(sides) != 1 or seen.sync_confidence >= LEAST_SYNC or not seen.sync_lead < LEAST_LEAD:
        return None
    side = sides.pop()
    return Doubt(
        "lone limb",
        f"Only the {side} side carries markers, and which side it is rests on the video, whose offset is uncertain "
        f"(confidence {seen.sync_confidence:.2f}, at least {LEAST_SYNC} is needed): give the offset, or the camera of "
        "a full-body trial, or check the side.",
        value=seen.sync_confidence,
        limit=LEAST_SYNC,
    )
