"""Pieces of one person's track that a tracker gave different numbers: joined where they never overlap."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from markerscope.solver.core.rotations import log_so3

K = TypeVar("K", bound=Hashable)
"""A track number, as the program that tracked writes it."""


@dataclass(frozen=True)
class Piece:
    """What one track number covers.

    Attributes
    ----------
    frames : (N,) video frames, ascending
    rotations : (N, 24, 3, 3) body poses, NaN where they are none
    """

    frames: np.ndarray
    rotations: np.ndarray


def one_person(pieces: Mapping[K, Piece]) -> tuple[list[K], tuple[str, ...]]:
    """Numbers of the pieces that make up the person seen longest, in time's order, and what to tell the user.

    A number is no person: trackers give a new one after every loss. Starting from the longest piece, those are added
    that share no frame with it; where several people could go on, the one whose pose is nearest at the join.
    """
    chain = [max(pieces, key=lambda key: len(pieces[key].frames))]
    while True:
        taken = np.concatenate([pieces[key].frames for key in chain])
        free = [key for key in pieces if key not in chain and not np.isin(pieces[key].frames, taken).any()]
        if not free:
            break
        chain.append(min(free, key=lambda key: _distance(pieces, chain, key)))
    chain.sort(key=lambda key: int(pieces[key].frames[0]))
    return chain, _notes(pieces, chain)


def _distance(pieces: Mapping[K, Piece], chain: list[K], key: K) -> tuple[float, int]:
    """How far a piece is from the chain: the gap and the turn of the joints across it; longer pieces first."""
    piece = pieces[key]
    best = np.inf
    for other in chain:
        held = pieces[other]
        for a, b in ((held, piece), (piece, held)):
            gap = int(b.frames[0]) - int(a.frames[-1])
            if gap > 0:
                turn = log_so3(np.swapaxes(a.rotations[-1], -1, -2) @ b.rotations[0])
                far = float(np.linalg.norm(turn, axis=-1).mean())
                best = min(best, far + 0.01 * gap if np.isfinite(far) else 1 + 0.01 * gap)
    return best, -len(piece.frames)


def _notes(pieces: Mapping[K, Piece], chain: list[K]) -> tuple[str, ...]:
    frames = sum(len(pieces[key].frames) for key in chain)
    notes: tuple[str, ...] = ()
    if len(chain) > 1:
        listed = ", ".join(map(str, chain))
        notes = (f"The tracks {listed} never overlap and were taken for one person ({frames} frames).",)
    others = [key for key in pieces if key not in chain]
    if others:
        most = int(np.unique(np.concatenate([piece.frames for piece in pieces.values()]), return_counts=True)[1].max())
        kept = f"id {chain[0]}" if len(chain) == 1 else f"{len(chain)} tracks"
        notes += (f"{most} people were tracked at once; the one tracked longest is used ({kept}, {frames} frames).",)
    return notes


def joined(pieces: Mapping[K, Piece], chain: list[K]) -> Piece:
    """The pieces of a chain as one, frames ascending."""
    frames = np.concatenate([pieces[key].frames for key in chain])
    rotations = np.concatenate([pieces[key].rotations for key in chain])
    order = np.argsort(frames, kind="stable")
    return Piece(frames[order], rotations[order])
