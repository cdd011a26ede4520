"""All rules, as data, and the verdict they come to together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from markerscope.solver.fit.doubts.agreement import disagreement
from markerscope.solver.fit.doubts.clouds import several
from markerscope.solver.fit.doubts.doubt import CAP, Doubt, Evidence
from markerscope.solver.fit.doubts.far import far, suspects
from markerscope.solver.fit.doubts.mirror import mirrored
from markerscope.solver.fit.doubts.misfit import off_the_skin, off_their_places
from markerscope.solver.fit.doubts.offset import lone_limb, sure_of_offset
from markerscope.solver.fit.doubts.picture import off_the_picture
from markerscope.solver.fit.doubts.rigid import one_group
from markerscope.solver.fit.doubts.second import second_answers
from markerscope.solver.fit.doubts.still import still
from markerscope.solver.fit.doubts.turn import turning_camera

RULES: tuple[Callable[[Evidence], Doubt | None], ...] = (
    several,
    still,
    far,
    one_group,
    off_the_skin,
    off_their_places,
    mirrored,
    off_the_picture,
    disagreement,
    turning_camera,
    lone_limb,
)
"""In the order in which they are said."""


@dataclass(frozen=True, eq=False)
class Verdict:
    """What a solve is worth.

    Attributes
    ----------
    confidence : 0..1, that of the ranking, less where it rests on an offset that is not sure; 0.6 where
        a rule speaks against it and it was more
    doubts : what the rules found, then the limbs that have a second answer, which leave the confidence in the whole
    nobody : columns of the markers that were left out because they stand still, form another cloud or fit no place
    suspect : columns of the markers in use that are over 20 mm from their place, most of them on a wrong bone
    """

    confidence: float
    doubts: tuple[Doubt, ...]
    nobody: tuple[int, ...]
    suspect: tuple[int, ...]


def verdict(seen: Evidence, confidence: float) -> Verdict:
    """Ask every rule; ``confidence`` is what the ranking of the answers says."""
    found = tuple(doubt for rule in RULES if (doubt := rule(seen)) is not None)
    confidence = sure_of_offset(seen, confidence)
    others = [m for m, c in enumerate(seen.cloud) if c >= 0 and c != seen.taken]
    nobody = sorted({*(int(m) for m in seen.still), *others, *(int(m) for m in seen.far)})
    return Verdict(
        min(confidence, CAP) if found else confidence,
        (*found, *second_answers(seen)),
        tuple(nobody),
        tuple(int(m) for m in suspects(seen.residual)),
    )
