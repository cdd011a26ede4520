"""Names given to fragments one to one: each at any time to one fragment, each fragment one name throughout."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from markerscope.solver.markerset.fragments import SOFT, START, Fragments

_OVERLAP = 2
"""Frames that two fragments of one name may share where a break was tracked twice."""
NOBODY = 0.6
"""What a sample without a name costs; one as far from its place as it may be costs 1."""
_STAY = {SOFT: 12.0, START: 0.0}
_LEAVES = 2.0
"""Samples at full cost that a change of name must be worth, where nothing but a close neighbour speaks for it, and at a
jump or a gap."""
_SECOND = 0.5


@dataclass(frozen=True, eq=False)
class Pieces:
    """Fragments that follow each other in a trajectory and are taken for one marker.

    Attributes
    ----------
    of_fragment : (F,) piece of each fragment
    first, last : (P,) frames, both inclusive
    column : (P,) trajectory
    samples : (P,) how many it holds
    cost : (P, U) mean cost of a sample under each name, 0..1; NaN where it was never looked at
    """

    of_fragment: np.ndarray
    first: np.ndarray
    last: np.ndarray
    column: np.ndarray
    samples: np.ndarray
    cost: np.ndarray

    def __len__(self) -> int:
        return len(self.first)


def pieces_of(fragments: Fragments, cost: np.ndarray, nobody: float = NOBODY) -> Pieces:
    """Fragments joined along each trajectory unless another name fits clearly better behind a cut (Viterbi).

    Parameters
    ----------
    cost : (F, U) mean cost of a sample of each fragment under each name, 0..1
    """
    piece = np.zeros(len(fragments), int)
    number = -1
    for own in _sequences(fragments):
        path = _path(cost[own], fragments.length[own], fragments.cut[own], nobody)
        for i, f in enumerate(own):
            number += i == 0 or path[i] != path[i - 1]
            piece[f] = number
    count = number + 1
    first, last = np.full(count, np.iinfo(int).max), np.full(count, -1)
    np.minimum.at(first, piece, fragments.first)
    np.maximum.at(last, piece, fragments.last)
    columns = np.zeros(count, int)
    columns[piece] = fragments.column
    samples = np.bincount(piece, fragments.length, count)
    total = np.zeros((count, cost.shape[1]))
    np.add.at(total, piece, cost * fragments.length[:, None])
    return Pieces(piece, first, last, columns, samples, total / np.maximum(samples, 1)[:, None])


def _sequences(fragments: Fragments) -> list[np.ndarray]:
    """Fragments that go on from each other, in order of time; each is in one of them."""
    after = {int(b): f for f, b in enumerate(fragments.before) if b >= 0}
    found = []
    for f in np.flatnonzero(fragments.before < 0):
        own = [int(f)]
        while own[-1] in after:
            own.append(after[own[-1]])
        found.append(np.array(own))
    return found


def _path(cost: np.ndarray, length: np.ndarray, cut: np.ndarray, nobody: float) -> np.ndarray:
    """(F,) cheapest names along one trajectory, U where it is nobody's."""
    table = np.concatenate([cost, np.full((len(cost), 1), nobody)], axis=1) * length[:, None]
    total, back = table[0], []
    for i in range(1, len(table)):
        leave = total.min() + _STAY.get(int(cut[i]), _LEAVES)
        back.append(np.where(total <= leave, np.arange(len(total)), int(total.argmin())))
        total = np.minimum(total, leave) + table[i]
    path = [int(total.argmin())]
    for step in reversed(back):
        path.append(int(step[path[-1]]))
    return np.array(path[::-1])


def assign(pieces: Pieces, nobody: float = NOBODY) -> np.ndarray:
    """(P,) name of each piece, -1 for nobody's: Hungarian between every two ends of pieces, the longest stretch counts.

    Where two pieces of one name still overlap, the one that it suits less takes its next best free name or none.
    """
    count, names = pieces.cost.shape
    won = np.zeros((count, names + 1))
    for start, stop, active in stretches(pieces):
        columns = _matched(pieces.cost[active], pieces.samples[active], nobody)
        won[active, columns] += stop - start + 1
    won[:, names] *= 1 - 1e-9
    chosen = np.where(won.sum(axis=1) > 0, won.argmax(axis=1), names)
    chosen[chosen == names] = -1
    return _one_to_one(pieces, chosen, nobody)


def stretches(pieces: Pieces) -> list[tuple[int, int, np.ndarray]]:
    """First and last frame between two ends of pieces, and the pieces that are there; an overlap of two frames is
    none.
    """
    first = pieces.first + np.where(pieces.last - pieces.first >= 2 * _OVERLAP, _OVERLAP // 2, 0)
    last = pieces.last - np.where(pieces.last - pieces.first >= 2 * _OVERLAP, _OVERLAP // 2, 0)
    marks = np.unique(np.concatenate([first, last + 1]))
    found = []
    for start, stop in zip(marks[:-1], marks[1:] - 1):
        active = np.flatnonzero((first <= start) & (last >= stop))
        if len(active):
            found.append((int(start), int(stop), active))
    return found


def _matched(cost: np.ndarray, weight: np.ndarray, nobody: float) -> np.ndarray:
    """(A,) the name of each of A pieces, U for none."""
    pieces, names = cost.shape
    table = np.full((pieces, names + pieces), nobody)
    table[:, :names] = cost
    _, columns = linear_sum_assignment(table * weight[:, None])
    return np.minimum(columns, names)


def _one_to_one(pieces: Pieces, chosen: np.ndarray, nobody: float) -> np.ndarray:
    """Names without overlaps."""
    out = np.full(len(chosen), -1)
    taken: dict[int, list[int]] = {}

    def free(p: int, name: int) -> bool:
        return all(
            min(pieces.last[p], pieces.last[q]) - max(pieces.first[p], pieces.first[q]) + 1 <= _OVERLAP
            for q in taken.get(name, [])
        )

    worth = pieces.samples * (nobody - pieces.cost[np.arange(len(chosen)), np.maximum(chosen, 0)])
    for p in np.argsort(-worth, kind="stable"):
        if chosen[p] < 0:
            continue
        for name in (int(chosen[p]), *np.argsort(pieces.cost[p])[:3].tolist()):
            if free(int(p), name) and (name == chosen[p] or pieces.cost[p, name] < _SECOND):
                out[p] = name
                taken.setdefault(name, []).append(int(p))
                break
    return out


def margins(pieces: Pieces, names: np.ndarray, evidence: np.ndarray, nobody: np.ndarray) -> np.ndarray:
    """(P,) how much dearer an assignment is in which a piece has another name or none: the min-marginals, over
    exchanges of two and of three.

    Longer chains are left out: they are dearer, and where the names were given by another measure than the evidence, a
    chain elsewhere that gains would be charged to all.

    Parameters
    ----------
    names : (P,) as assigned, -1 for nobody's
    evidence : (P, U) minus the logarithm of how likely each piece is under each name
    nobody : (P,) the same for none
    """
    best = np.full(len(pieces), np.inf)
    longest = np.zeros(len(pieces), int)
    for start, stop, active in stretches(pieces):
        take = stop - start + 1 > longest[active]
        if take.any():
            margin = _exchanges(evidence[active], names[active], nobody[active])
            best[active[take]] = margin[take]
            longest[active[take]] = stop - start + 1
    return best


def _exchanges(evidence: np.ndarray, names: np.ndarray, nobody: np.ndarray) -> np.ndarray:
    """(A,) cost of the cheapest exchange that takes a piece's name from it."""
    pieces, count = evidence.shape
    held = np.maximum(names, 0)
    has = names >= 0
    own = np.where(has, evidence[np.arange(pieces), held], nobody)
    # gain[i, j]: what piece i pays for the name of piece j instead of its own
    gain = np.where(has[None], evidence[:, held], nobody[:, None]) - own[:, None]
    np.fill_diagonal(gain, np.inf)
    alone = nobody - own
    free = np.setdiff1d(np.arange(count), names[has])
    if len(free):
        alone = np.minimum(alone, (evidence[:, free] - own[:, None]).min(axis=1))
    alone = np.where(has, alone, np.inf if not len(free) else (evidence[:, free] - own[:, None]).min(axis=1))
    # one takes a free name or none; or it takes another's, who takes a free name or none, or this one's, or a third's
    leaves = np.where(has, alone, 0.0)
    two = np.minimum(gain + leaves[None], gain + gain.T).min(axis=1)
    through = np.min(gain[:, :, None] + gain[None], axis=1)  # (i, k) by way of another
    three = np.minimum(through + leaves[None], through + gain.T)
    np.fill_diagonal(three, np.inf)
    return np.maximum(np.minimum(np.minimum(alone, two), three.min(axis=1)), 0.0)
