"""Networks that read the poses of a session off its markers, of whichever kind the weights are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.neural.layout_free import agnostic_solve, agnostic_trust
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Ready, Solved, held, solve_frames
from markerscope.solver.neural.places import check_places, columns_of
from markerscope.solver.neural.weights import Card, read_card

if TYPE_CHECKING:
    from markerscope.solver.neural.per_layout.named import Solver

_WINDOWS, _WINDOW = 8, 64
"""Spans of made motion that a network of one layout is tried on, and frames of each."""
_PLACE_M = 6e-3
"""m, standard deviation of how far a marker is from where a solve believes it on the resting body."""


class PoseNetwork(Protocol):
    """A network ready for one session: its body and its markers are known to it."""

    @property
    def about(self) -> str:
        """Which weights, in words."""

    def poses(self, markers: np.ndarray, rate: float, progress: Progress = silent) -> Solved:
        """Poses of every frame of markers (T, M, 3) m in the lab, NaN = lost, at ``rate`` Hz."""

    def expected_errors(self) -> np.ndarray:
        """(24, 3, 3) rad2 to be expected at each joint about its own axes, as ``agnostic_trust.blended`` takes it."""

    def tuned(self, steps: int, progress: Progress = silent) -> PoseNetwork:
        """The same after some steps of training on made motions of this body with these markers."""


@dataclass(frozen=True, eq=False)
class AnyLayout:
    """The layout-agnostic network, told where the markers are on the person."""

    ready: Ready
    body: Body
    person: Marked
    name: str

    @property
    def about(self) -> str:
        """Which weights, in words."""
        return _about(self.name, self.ready.card)

    def poses(self, markers: np.ndarray, rate: float, progress: Progress = silent) -> Solved:
        """Each frame by itself."""
        return solve_frames(self.ready, markers, self.person, progress)

    def expected_errors(self) -> np.ndarray:
        """What it gets wrong with these very markers."""
        return agnostic_trust.expected_errors(self.ready, self.body, self.person)

    def tuned(self, steps: int, progress: Progress = silent) -> AnyLayout:
        """Trained a little further."""
        from markerscope.solver.neural.layout_free.finetune import Ground, tuned

        return replace(self, ready=tuned(self.ready, Ground(self.body, person=self.person), steps, progress))


@dataclass(frozen=True, eq=False)
class OneLayout:
    """A solver of one layout, its L markers found among the session's.

    Attributes
    ----------
    columns : (L,) which of the session's markers each is, -1 for one that there is none of: it counts as lost
    """

    solver: Solver
    card: Card
    columns: np.ndarray
    body: Body
    person: Marked
    path: Path

    @property
    def about(self) -> str:
        """Which weights, and how many of their markers there are, in words."""
        there = f"{(self.columns >= 0).sum()} of its {len(self.columns)} markers are there"
        return f"{_about(self.path.name, self.card)}, {there}"

    def poses(self, markers: np.ndarray, rate: float, progress: Progress = silent) -> Solved:
        """What is lost is filled first; the bones it says are left aside, those of the person are known better."""
        from markerscope.solver.neural.per_layout.named import solve

        progress(0.0, "the network solves")
        given = np.where((self.columns >= 0)[:, None], markers[:, self.columns], np.nan)
        found = solve(self.solver, given, rate, self.body)
        seen = np.isfinite(given).all(axis=2).sum(axis=1) >= 3
        return held(Solved(found.rotations, found.joints[:, 0] - self.person.joints[0], seen))

    def expected_errors(self) -> np.ndarray:
        """What it gets wrong on made motions of this body with these very markers, those missing that are."""
        from markerscope.solver.neural.layout_free.agnostic_examples import Spoiling, one_person
        from markerscope.solver.neural.training.examples import generator
        from markerscope.solver.neural.training.library import RATE

        motions = agnostic_trust.made_poses(self.body)
        spoiling = Spoiling(slide=5e-3, lost=0.05, far=0.0, place=0.0, joint=0.0)
        found, true = [], []
        for i in range(_WINDOWS):
            off = _PLACE_M / np.sqrt(3) * np.random.default_rng(i).standard_normal(self.person.rest.shape)
            person = replace(self.person, rest=self.person.rest + off)
            task = one_person(motions, person, _WINDOW, generator(0, i), spoiling, _WINDOW)
            seen = task.frames.seen.numpy()[..., None] > 0
            markers = np.where(seen, task.frames.markers.numpy().astype(float), np.nan)
            found.append(self.poses(markers, RATE).rotations)
            true.append(task.local.numpy().astype(float))
        return agnostic_trust.spread_of_errors(np.concatenate(found), np.concatenate(true))

    def tuned(self, steps: int, progress: Progress = silent) -> OneLayout:
        """It cannot be.

        Raises
        ------
        InputError : always
        """
        what = "holds a network of one layout, which cannot be tuned to a session before it solves"
        raise InputError(what, self.path, "set tune_steps to 0, and train it further with train --start")


def pose_network(path: Path | None, body: Body, person: Marked, vertex: np.ndarray) -> PoseNetwork:
    """A network for a session, of the kind that its card says.

    Parameters
    ----------
    path : of the weights; None takes those that ship
    body : of the session
    person : its markers and joints at rest, as they were found
    vertex : (M,) vertices below the markers

    Raises
    ------
    InputError : the file holds no weights of a network that solves, or those for another layout or body
    """
    from markerscope.solver.neural.per_layout import named

    if path is not None and read_card(path).network == named.KIND:
        solver, card = named.load_solver(path)
        columns = columns_of(body, vertex, solver.layout, path)
        layout = replace(solver.layout, columns=np.arange(len(columns)))
        return OneLayout(replace(solver, layout=layout), card, columns, body, person, path)
    ready = agnostic_solve.load(path)
    check_places(ready.card, body, vertex, path)
    return AnyLayout(ready, body, person, "shipped" if path is None else path.name)


def _about(name: str, card: Card) -> str:
    return f"{name}, {card.steps} steps, {card.date[:10]}"
