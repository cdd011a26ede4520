"""Limbs whose markers allow a second answer."""

from __future__ import annotations

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence


def second_answers(seen: Evidence) -> tuple[Doubt, ...]:
    """Say of each limb that another pose of it costs next to nothing more, and how sure the first is.

    It speaks against that limb alone, so the confidence in the whole stays.
    """
    return tuple(
        Doubt("second answer", other.sentence, value=other.confidence, limit=other.LEAST_SURE)
        for other in seen.second
        if other.chosen or other.confidence < other.LEAST_SURE
    )
