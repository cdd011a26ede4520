"""Where the markers may sit: every way that was thought of, and how far each one got."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.colours import bone_name
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import JOINTS, subtrees
from markerscope.solver.fit.confidence import same_answer
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.parts import part_name
from markerscope.solver.fit.published.results import PaperLocalization
from markerscope.solver.fit.results import Localization, Orientation
from markerscope.widgets.tables.candidate_data import CandidateRecord, SearchStep

Fate = Literal["found", "too alike", "kept", "left behind", "merged", "scored", "refined"]
"""How far a way got: see ``FATES``."""

FATES: dict[Fate, str] = {
    "found": "laid over the markers, not yet relaxed",
    "too alike": "left out: it shares nearly all its bones with one that was kept",
    "kept": "not yet laid over the markers",
    "left behind": "relaxed on a few keyframes, then others were better",
    "merged": "ran into a better one while it was refined",
    "scored": "laid over the markers and compared",
    "refined": "refined to the end",
}

ENERGY, CHAMFER = ("Energy", "per frame"), ("Chamfer", "mm²")
"""What each method ranks the candidates by, and its unit."""
MEANING = {
    "Energy": "Energy per frame by which the answers are ranked, the least first; only those of one state compare",
    "Chamfer": "Mean squared distance between markers and skin, both ways (of solved yaws from the markers alone)",
}
"""What the scores mean."""


@dataclass(frozen=True, kw_only=True)
class CandidateRow(CandidateRecord):
    """A row of the table, and what it is a row of.

    Attributes
    ----------
    pool : its row in the localization: a hypothesis, or a chain (see ``chains_of``); -1 for an answer that has none of
        its own
    candidate : its row in the orientation, by which it is pinned; -1 if it is not there
    can_pin : whether the fit can be told to go on from it
    """

    pool: int = -1
    candidate: int = -1
    can_pin: bool = False


@dataclass(frozen=True)
class CandidateTable:
    """All rows, the steps that narrow them down, and what the score is.

    Attributes
    ----------
    rows : best first
    steps : from the pool to the refined
    score, unit : what the candidates are ranked by
    meaning : of the score, one sentence
    """

    rows: tuple[CandidateRow, ...]
    steps: tuple[SearchStep, ...]
    score: str
    unit: str
    meaning: str = ""


def candidate_table(
    found: Localization | PaperLocalization,
    ranked: Orientation | None = None,
    in_use: int | None = None,
    covered: dict[int, float] | None = None,
) -> CandidateTable:
    """The candidates as far as they are known.

    Parameters
    ----------
    found : where the search stands
    ranked : the orientation, once it is there
    in_use : row of the candidate that the fit goes on from
    covered : share of the markers covered, by row of the orientation
    """
    if isinstance(found, PaperLocalization):
        rows, steps = _of_chains(found, ranked)
        score, unit = CHAMFER
    else:
        rows, steps = _of_hypotheses(found, ranked)
        score, unit = ENERGY
    covered = covered or {}
    marked = tuple(
        replace(row, in_use=row.candidate == in_use, covered=covered.get(row.candidate, float("nan")))
        if row.candidate >= 0
        else row
        for row in rows
    )
    return CandidateTable(told_apart(marked), steps, score, unit, MEANING[score])


def coverage(points: np.ndarray, markers: np.ndarray, within: float = 0.03) -> float:
    """Share 0..1 of the markers that are near their places in at least half of the frames that show them.

    Parameters
    ----------
    points : (N, U, 3) m, where each marker belongs
    markers : (N, U, 3) m, NaN = lost
    within : m
    """
    distance = np.linalg.norm(points - markers, axis=2)
    seen = np.isfinite(distance).sum(axis=0)
    near = (np.nan_to_num(distance, nan=np.inf) <= within).sum(axis=0)
    return float((near[seen > 0] >= 0.5 * seen[seen > 0]).mean()) if (seen > 0).any() else float("nan")


def covered_by(track: BodyTrack, markers: Markers, most: int = 12) -> float:
    """Share of a ghost's markers that are near their places, looked at in some of its keyframes."""
    some = np.unique(np.linspace(0, len(track.times) - 1, min(len(track.times), most)).round().astype(int))
    times = track.times[some]
    frames = np.round((times - markers.first_time) * markers.rate).astype(int)
    return coverage(track.places_over(times), markers.positions[frames][:, track.markers])


def bone_names(bones: Sequence[int] | np.ndarray) -> tuple[str, ...]:
    """Names of the bones that occur, from the pelvis outwards."""
    return tuple(bone_name(int(j)) for j in np.unique(bones) if j >= 0)


def part_of_bones(bones: np.ndarray) -> str:
    """The part of the body that they make up, in words."""
    return part_name(bones)


def _of_hypotheses(
    found: Localization, ranked: Orientation | None
) -> tuple[tuple[CandidateRow, ...], tuple[SearchStep, ...]]:
    place = {} if ranked is None else {c.hypothesis: i for i, c in enumerate(ranked.candidates)}
    rows = []
    for h in range(len(found.start)):
        view = found.R_lab_cam[h, :, 2]
        row = CandidateRow(
            pool=h,
            candidate=place.get(h, -1),
            number=_number(place.get(h, -1)),
            fate="found" if ranked is None else "merged",
            part=part_of_bones(found.bone[h]),
            bones=bone_names(found.bone[h]),
            yaw_deg=float(found.yaw_deg[h]),
            heading_deg=float(np.degrees(np.arctan2(view[1], view[0]))),
            distance=float(found.cost_mm[h]),
        )
        rows.append(row if ranked is None or h not in place else _relaxed(row, ranked))
    if ranked is not None:
        last = len(rows)
        rows.sort(key=lambda row: row.candidate if row.candidate >= 0 else last)
    relaxed = [i for i, row in enumerate(rows) if row.fate != "found"]
    refined = [i for i in relaxed if rows[i].fate in ("refined", "merged")]
    ends = [i for i in refined if rows[i].fate == "refined"]
    steps = (
        SearchStep("Pool", "Ways to put the markers on the video's body, found without changing its pose.", _all(rows)),
        SearchStep("Scored", "Relaxed on a few keyframes, markers on whole vertices.", tuple(relaxed)),
        SearchStep("Kept", "The best, no more than two alike: relaxed on all keyframes, markers free.", tuple(refined)),
        SearchStep("Refined", "What did not run into a better one, to the end.", tuple(ends)),
    )
    return tuple(rows), steps


def _number(candidate: int) -> int:
    """The number by which every view calls a row of the orientation; 0 for one that is not there."""
    return candidate_number(candidate) if candidate >= 0 else 0


def _relaxed(row: CandidateRow, ranked: Orientation) -> CandidateRow:
    """The row of a candidate as the orientation has it."""
    own = ranked.candidates[row.candidate]
    best = ranked.candidates[0]
    comparable = own.refined == best.refined
    return replace(
        row,
        fate="refined" if own.refined else "left behind",
        part=own.part,
        bones=bone_names(own.bone),
        heading_deg=own.heading_deg,
        score=own.energy,
        margin=own.energy / max(best.energy, 1e-12) if comparable else float("nan"),
        can_pin=True,
        same_as_first=row.candidate > 0 and own.refined and same_answer(ranked.candidates[0], own),
    )


def _of_chains(
    found: PaperLocalization, ranked: Orientation | None
) -> tuple[tuple[CandidateRow, ...], tuple[SearchStep, ...]]:
    answers = _yaws(ranked)
    chains = _chains(found, ranked)
    rows = (*answers, *chains)
    first = len(answers)
    pool = tuple(range(first, len(rows)))
    kept = tuple(i for i in pool if rows[i].fate != "too alike")
    scored = tuple(i for i in kept if rows[i].fate == "scored")
    size = found.pruned.shape[1] if found.pruned.ndim == 2 and len(found.pruned) else found.groups
    steps = (
        SearchStep("Pool", f"All connected chains of {size} bones, one for each group of markers.", pool),
        SearchStep("Pruned", "Less those that nearly repeat another.", kept),
        SearchStep("Scored", _said_scored(found), scored),
        SearchStep("Refined", "Every yaw solved in five stages.", tuple(range(first))),
    )
    return rows, steps


def _said_scored(found: PaperLocalization) -> str:
    if found.whole_body and not found.candidates:
        share = f"the markers' box is {100 * found.box:.0f} % of the body's"
        return f"Not searched: the whole body was taken, since {share}."
    return "Each laid over the markers by one yaw, a shift in every frame, and shape."


def _yaws(ranked: Orientation | None) -> tuple[CandidateRow, ...]:
    if ranked is None:
        return ()
    rows = []
    for i, own in enumerate(ranked.candidates):
        if own.refined:
            row = CandidateRow(
                candidate=i, number=_number(i), fate="refined", part=own.part, bones=bone_names(own.bone)
            )
            rows.append(_relaxed(row, ranked))
    return tuple(rows)


def _chains(found: PaperLocalization, ranked: Orientation | None) -> tuple[CandidateRow, ...]:
    """Scored chains, best first, then those not scored, then those that were pruned."""
    place = {} if ranked is None else {c.hypothesis: i for i, c in enumerate(ranked.candidates) if not c.refined}
    order = np.argsort([fit.chamfer for fit in found.candidates], kind="stable")
    rows = []
    for row in order:
        fit = found.candidates[row]
        rows.append(
            CandidateRow(
                pool=int(row),
                candidate=place.get(int(row), -1),
                number=_number(place.get(int(row), -1)),
                fate="scored",
                part=part_of_bones(fit.bones),
                bones=bone_names(fit.bones),
                yaw_deg=fit.yaw_deg,
                distance=1000 * fit.one_way**0.5,
                score=1e6 * fit.chamfer,
                margin=fit.chamfer / max(found.candidates[order[0]].chamfer, 1e-12),
                chain=int(row) + 1,
                energy=fit.descent.energy,
            )
        )
    first, last = len(found.candidates), len(found.pruned)
    chains = chains_of(found)
    like = _most_alike(chains[last:], chains[:last])
    for i, chain in enumerate(chains[first:], first):
        bones = np.array(sorted(chain))
        rows.append(
            CandidateRow(
                pool=i,
                fate="kept" if i < last else "too alike",
                part=part_of_bones(bones),
                bones=bone_names(bones),
                chain=i + 1,
                repeats=like[i - last] if i >= last else 0,
            )
        )
    return tuple(rows)


def chains_of(found: PaperLocalization) -> tuple[frozenset[int], ...]:
    """The bones of every chain: those that were kept, as the localization has them, then those that repeat one."""
    kept = tuple(frozenset(int(j) for j in chain) for chain in found.pruned)
    size = found.pruned.shape[1] if found.pruned.ndim == 2 else 0
    known = set(kept)
    return (*kept, *(chain for chain in subtrees(size) if chain not in known)) if size else kept


def told_apart(rows: Sequence[CandidateRow]) -> tuple[CandidateRow, ...]:
    """The rows with the bones that tell them apart: those that not every row has, of the fewest rows first."""
    count = Counter(bone for row in rows for bone in row.bones)
    return tuple(
        replace(row, differs=tuple(sorted((b for b in row.bones if count[b] < len(rows)), key=lambda b: count[b])))
        for row in rows
    )


def _most_alike(chains: Sequence[frozenset[int]], kept: Sequence[frozenset[int]]) -> tuple[int, ...]:
    """Of each chain, the number of the kept one that it shares most bones with; 0 where none was kept."""
    if not kept or not chains:
        return (0,) * len(chains)
    shared = _member(chains) @ _member(kept).T
    return tuple(int(row) + 1 for row in shared.argmax(axis=1))


def _member(chains: Sequence[frozenset[int]]) -> np.ndarray:
    """(C, 24) 1 where a bone is in a chain."""
    table = np.zeros((len(chains), len(JOINTS)), dtype=int)
    for row, chain in enumerate(chains):
        table[row, list(chain)] = 1
    return table


def _all(rows: Sequence[CandidateRow]) -> tuple[int, ...]:
    return tuple(range(len(rows)))
