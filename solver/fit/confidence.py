"""How sure the first answer is, and what stands against it, in words."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import JOINTS, PARENTS, mirror_index
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.doubts.turn import holds_pelvis
from markerscope.solver.fit.results import Candidate, Orientation

_SAME_BONES = 0.8
_SAME_TURN_DEG = 35.0
_STILL_DEG = 12.0
_PER_JUDGED, _MOST_JUDGED = 6, 2
_TIE = 1.15
_WHOLE_BONES, _CLEAR = 10, 1.3
"""Markers on more bones than this lie on a person as on no other part: a clear answer needs no movement then, if it is
clear beside that of the mirrored video as well. Of eleven whole bodies that hardly moved all were right, their margins
1.05 to 2.6; of ten parts one was wrong, with 1.65.
"""
_STEEPNESS = 8.5
"""Told from 400 synthetic sessions of ``markerscope bench``: with it, which were right was likeliest."""
STEEPNESS_OF_LIMBS = 4.0
"""Where nothing holds the pelvis, so side and heading rest on the video alone. Likeliest is 3.75 (95 %: 2.25 to 5.75):
of 68 synthetic sessions with markers on limbs alone (``benchmarks/traps.py``) 13 were wrong, up to 1.9.
"""
UNRIVALLED = 0.95
"""Where no other answer was found, or all that were followed ran into the best, nothing says how far the next is. Of 67
synthetic sessions of that kind (``benchmarks/traps.py``) 66 were right."""


def judge(
    candidates: tuple[Candidate, ...], used: np.ndarray | None = None, mirror: float = float("nan")
) -> Orientation:
    """Rank is given; find the best different answer, and say what is ambiguous.

    Parameters
    ----------
    used : (U,) False for markers that count for nothing; None uses all
    mirror : times the energy that the best costs of what it does with the video mirrored; NaN where not tried
    """
    best = candidates[0]
    rivals = [i for i, c in enumerate(candidates) if c.refined and i and not same_answer(best, c)]
    rivals += [i for i, c in enumerate(candidates) if not c.refined and np.isfinite(c.behind)]
    runner_up = rivals[0] if rivals else -1
    margin = _times(best, candidates[runner_up]) if rivals else float("inf")
    bone = best.bone if used is None else best.bone[used]
    told_by_shape = is_whole(bone) and margin >= _CLEAR and mirror * _CLEAR <= 1
    still = () if told_by_shape else stillness(best.rotations, bone)
    warnings = list(still)
    if rivals and margin < _TIE:
        warnings.append(_tie(best, candidates[runner_up], margin))
    steepness = steepness_of(bone)
    confidence = _sure(margin, steepness) if rivals else UNRIVALLED
    if still:
        confidence = min(confidence, 0.6)
    return Orientation(candidates, float(margin), runner_up, confidence, tuple(warnings), mirror=mirror)


def chosen_by_hand(ranked: Orientation, row: int, steepness: float) -> tuple[float, tuple[str, ...]]:
    """What the ranking says of a candidate that was pinned: a decision is no evidence, so it makes nothing surer.

    Parameters
    ----------
    row : the candidate, in the ranking
    steepness : of the method's confidence over the margin, as ``steepness_of``

    Returns
    -------
    Its confidence, 0..1, and the ranking's warnings after a sentence that says who chose.
    """
    best, chosen = ranked.candidates[0], ranked.candidates[row]
    if row == 0 or same_answer(best, chosen):
        confidence = ranked.confidence
    else:
        times = _times(best, chosen)
        confidence = _sure(1 / times, steepness) if np.isfinite(times) and times > 0 else 1 - UNRIVALLED
    said = (
        f"Candidate {candidate_number(row)} was pinned by hand; the confidence stays the ranking's own of this "
        f"candidate, {100 * confidence:.0f} %."
    )
    return confidence, (said, *ranked.warnings)


def steepness_of(bone: np.ndarray) -> float:
    """How steeply the confidence rises with the margin, for markers on these bones (U,)."""
    return _STEEPNESS if holds_pelvis(bone) or is_whole(bone) else STEEPNESS_OF_LIMBS


def is_whole(bone: np.ndarray) -> bool:
    """Whether markers (U,), by their bones, cover a body and not only a part of it."""
    return len(set(bone[bone >= 0].tolist())) > _WHOLE_BONES


def _times(best: Candidate, other: Candidate) -> float:
    """How many times the best answer's energy another costs, as far as both were followed."""
    return other.energy / max(best.energy, 1e-9) if other.refined else other.behind


def stillness(rotations: np.ndarray, bone: np.ndarray) -> tuple[str, ...]:
    """What to say where the marked limbs bend too little for markers to be told apart; nothing otherwise.

    Parameters
    ----------
    rotations : (N, 24, 3, 3) of the keyframes, as fitted
    bone : (U,) bone of each marker
    """
    marked = np.zeros(len(JOINTS), dtype=bool)
    marked[bone[bone >= 0]] = True
    inner = [j for j in range(1, len(JOINTS)) if marked[j] and marked[PARENTS[j]]]
    moved = movement_deg(rotations, inner)
    if not inner or moved >= _STILL_DEG:  # one bone alone is said elsewhere: it moves as one piece
        return ()
    return (
        f"The person hardly moves where the markers are (joints turn by {moved:.0f} degrees), so markers cannot be "
        "told apart by their motion: check which bones they were given to.",
    )


def _sure(margin: float, steepness: float) -> float:
    """0..1 from how much more the next different answer costs: 0.5 for a tie.

    Of whole bodies and legs 0.77 at 1.15 and 0.99 at 1.7, of limbs alone 0.64 and 0.89.
    """
    return float(1 / (1 + max(margin, 1e-9) ** -steepness))


def same_answer(one: Candidate, other: Candidate) -> bool:
    """Whether two candidates give the markers to the same bones and stand the body the same way."""
    return alike(one.bone, other.bone, one.camera.R_lab_cam, other.camera.R_lab_cam)


def alike(bones: np.ndarray, others: np.ndarray, turn: np.ndarray, other_turn: np.ndarray) -> bool:
    """Whether two answers (bone of each marker, camera to lab) are one."""
    between = np.degrees(np.linalg.norm(log_so3(turn.T @ other_turn)))
    return bool(_bone_agreement(bones, others) >= _SAME_BONES and between <= _SAME_TURN_DEG)


def _bone_agreement(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.mean(one == other))


def movement_deg(rotations: np.ndarray, joints: list[int]) -> float:
    """How far joints turn, degrees; 0 of none.

    On a limb (fewer than six joints) the largest range counts: one joint that bends tells the bones on its two sides
    apart. The more joints there are, the more of them have to: of six the second largest, from twelve on the third.
    """
    if not joints:
        return 0.0
    some = rotations[:: max(1, len(rotations) // 400)][:, joints]
    turns = np.degrees(log_so3(np.swapaxes(rotations[len(rotations) // 2][joints], -1, -2) @ some))
    spread = np.linalg.norm(np.percentile(turns, 95, axis=0) - np.percentile(turns, 5, axis=0), axis=-1)
    return float(np.sort(spread)[::-1][min(_MOST_JUDGED, len(joints) // _PER_JUDGED)])


def _tie(best: Candidate, rival: Candidate, margin: float) -> str:
    mirrored = mirror_index()
    is_mirror = _bone_agreement(mirrored[best.bone], rival.bone) >= 0.6
    excess = (margin - 1) * 100
    if is_mirror and any(JOINTS[b].startswith(("left", "right")) for b in best.bone):
        return (
            f"Left and right can hardly be told apart: the markers may as well sit on the {rival.part} as on the "
            f"{best.part} (energy only {excess:.0f} % higher). Give the camera of a full-body trial, or pin the "
            "candidate."
        )
    return (
        f"A second answer is nearly as good ({rival.part}, camera looking towards {rival.heading_deg:.0f} degrees; "
        f"energy only {excess:.0f} % higher): compare the candidates and pin the right one."
    )
