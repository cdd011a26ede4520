"""What an offset between the clocks that may be wrong takes from a result: the side of a lone limb above all."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

LEAST_SYNC = 0.3
"""Where no other offset could be compared, its own confidence must be this."""
LEAST_LEAD = 12.0
"""Nats by which the offset must be ahead of every other. Of 49 synthetic limbs of seeds of their own 7 were ahead by
less, 5 of these over 0.25 s off; of the other 42 two."""
_EVEN_LEAD, _STEEPNESS = 8.0, 2.5
"""Odds that the offset is not grossly wrong (0.25 s), against the nats by which it is ahead: of 26 synthetic whole
bodies the two that were wrong were ahead by 0.4 and 9.6, the others by 12 and more. Few, so it is flatter than the
likeliest (9.8; 3.5)."""


def sure_of_offset(seen: Evidence, confidence: float) -> float:
    """0..1, of a confidence that holds if the offset is right; if it is wrong, the answer is no better than a guess.

    A lone limb is as likely the other side's then. Where both sides carry markers only an offset that is grossly wrong
    matters, which is rarer than one that is off by 0.05 s.
    """
    held = seen.sync_confidence if len(_sides(seen)) == 1 else _not_gross(seen)
    return held * confidence + (1 - held) * min(confidence, 0.5)


def lone_limb(seen: Evidence) -> Doubt | None:
    """Say that left and right cannot be told apart where another offset is as good: half a cycle swaps the legs.

    The mutual information of the two velocities repeats with the movement, and a limb alone has the other side's
    velocities half a period later: of a walk seen by one leg the second peak comes within 2 % of the first.
    """
    sides = _sides(seen)
    if len(sides) != 1:
        return None
    compared = bool(np.isfinite(seen.sync_lead))
    if seen.sync_lead >= LEAST_LEAD if compared else seen.sync_confidence >= LEAST_SYNC:
        return None
    side = sides.pop()
    rival = f": {seen.sync_rival:+.2f} s is nearly as good" if np.isfinite(seen.sync_rival) else ""
    return Doubt(
        "lone limb",
        f"Only the {side} side carries markers, and which side it is rests on the video, whose offset is uncertain"
        f"{rival}. Where a movement repeats itself, the offset may be a period or half of one off, and the markers may "
        "then sit on the other side: give the offset, or the camera of a full-body trial, or check the side.",
        value=seen.sync_lead if compared else seen.sync_confidence,
        limit=LEAST_LEAD if compared else LEAST_SYNC,
    )


def _sides(seen: Evidence) -> set[str]:
    return {JOINTS[j].split("_")[0] for j in seen.joint if j >= 0 and "_" in JOINTS[j]}


def _not_gross(seen: Evidence) -> float:
    """0..1, that the offset is right to 0.25 s; its own confidence where it was given or none could be compared."""
    if not np.isfinite(seen.sync_lead):
        return seen.sync_confidence
    lead = max(seen.sync_lead, 0.0) ** _STEEPNESS
    return float(lead / (lead + _EVEN_LEAD**_STEEPNESS))
