"""Other answers than the fit, drawn over it: a candidate, a hypothesis, an iteration, results that are compared."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from markerscope.app.models.fits import CANDIDATE_COLOURS, colour_places
from markerscope.app.models.signal import Signal
from markerscope.app.models.workbench import Workbench
from markerscope.app.views import bodies
from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.candidates import chains_of, part_of_bones
from markerscope.app.views.colours import RGB, rgb
from markerscope.app.views.convergence import TracedCurve
from markerscope.app.window.shown import Shown
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.results import Localization
from markerscope.widgets import palette

NEUTRAL_COLOUR: RGB = (120, 130, 140)


@dataclass(frozen=True)
class Ghost:
    """A body to draw.

    Attributes
    ----------
    name : of its layer
    title : what it is, in words for the legend
    track, colour, opacity : see there
    bones : those that carry the markers, which stand out from the others; empty where all are alike
    """

    name: str
    title: str
    track: BodyTrack
    colour: tuple[int, int, int]
    opacity: float = 0.35
    bones: frozenset[int] = frozenset()


class Ghosts:
    """Which ghosts are to be drawn.

    Attributes
    ----------
    all : now
    replaces_body : whether the first of them stands in for the fitted body
    changed : emitted when they are others
    """

    def __init__(self, bench: Workbench, shown: Shown) -> None:
        self.bench, self.shown = bench, shown
        self.changed: Signal[[]] = Signal()
        self.all: tuple[Ghost, ...] = ()
        self.replaces_body = False
        self._iteration: tuple[TracedCurve, int] | None = None
        shown.changed.connect(self._results)
        shown.dated.connect(lambda stages: self._make())
        bench.selection.changed.connect(self._selected)

    def show_iteration(self, curve: TracedCurve | None, step: int = 0) -> None:
        """Have the body as it was at a row of a descent's trace; None shows the fit again."""
        self._iteration = None if curve is None or curve.trace is None else (curve, step)
        self._make()

    def _selected(self, what: object) -> None:
        names = set(what) if isinstance(what, frozenset | set | tuple | list) else set()
        if names == {"stage"}:
            self._make()
        elif names & {"candidate", "hypothesis"} or ("iteration" in names and self.bench.selection.iteration is None):
            self._iteration = None
            self._make()

    def _results(self, stages: frozenset[str]) -> None:
        if stages & {"localize", "orient", "solve", "clean", "markers", "compared", "fit", "prior", "sync", "neutral"}:
            if stages & {"localize", "orient", "solve"}:
                self._iteration = None
            self._make()

    def _make(self) -> None:
        found = []
        own = self._of_iteration() if self._iteration is not None else self._of_selection()
        found += [ghost for ghost in (own, self._of_neutral()) if ghost is not None]
        is_open = self.bench.document.is_open
        places = colour_places(self.bench.board) if is_open else {}
        for ref, motion in self.shown.compared("fit").items() if is_open else ():
            place = places.get(ref.key, CANDIDATE_COLOURS)
            name = f"compared {ref.key}"
            track = self.shown.once(name, (motion,), partial(bodies.of_motion, self.shown.body, motion))
            found.append(Ghost(name, self._said(ref.key), track, rgb(palette.categorical(place + 1)[place])))
        before = [(ghost.name, ghost.title, ghost.track, ghost.bones) for ghost in self.all]
        self.replaces_body = own is not None and self._iteration is not None
        self.all = tuple(found)
        if before != [(ghost.name, ghost.title, ghost.track, ghost.bones) for ghost in found]:
            self.changed.emit()

    def _said(self, key: str) -> str:
        """What a fit that is compared is, in words."""
        row = next((row for row in self.bench.board.card("fit").earlier if row.key == key), None)
        return "Compared fit" if row is None else f"Fit: {row.settings or row.when}"

    def _of_neutral(self) -> Ghost | None:
        """The neutral pose, where the fit has the person, while its stage is selected."""
        neutral, motion = self.shown.get("neutral"), self.shown.get("fit")
        if self.bench.selection.stage != "neutral" or motion is None or neutral is None or neutral.zero == "recorded":
            return None
        track = self.shown.once(
            "neutral", (neutral, motion), partial(bodies.of_neutral, self.shown.body, motion, neutral)
        )
        return Ghost("neutral", f"Neutral pose: {neutral.where}", track, NEUTRAL_COLOUR)

    def _of_iteration(self) -> Ghost | None:
        found, markers = self.shown.get("localize"), self.shown.markers
        assert self._iteration is not None
        curve, step = self._iteration
        if found is None or markers is None or curve.trace is None:
            return None
        vertex = curve.vertex if curve.vertex is not None else np.zeros(0, dtype=np.intp)
        track = bodies.of_iteration(self.shown.body, curve.trace, step, found, markers, vertex)
        title = f"Iteration of {curve.label}{self._dated('localize', 'orient', 'solve')}"
        return Ghost("iteration", title, track, curve.colour, 0.75)

    def _dated(self, *stages: str) -> str:
        """What to add to the title of a ghost that comes from these stages."""
        return ", out of date" if self.shown.out_of_date(stages) else ""

    def _of_selection(self) -> Ghost | None:
        track = self.candidate_track()
        if track is not None:
            chosen = self.bench.selection.candidate or 0
            title = f"Candidate {candidate_number(chosen)}: {self.shown.get('orient').candidates[chosen].part}"
            title += self._dated("localize", "orient")
            carrying = self.shown.get("orient").candidates[chosen].bone
            return Ghost("candidate", title, track, _colour(chosen), bones=_set(carrying))
        found, prior, sync = (self.shown.get(name) for name in ("localize", "prior", "sync"))
        row, markers = self.bench.selection.hypothesis, self.shown.markers
        if row is None or markers is None or found is None or prior is None or sync is None:
            return None
        if isinstance(found, Localization):
            if row >= len(found.start):
                return None
            bones = found.bone[row]
            track = bodies.of_hypothesis(self.shown.body, found, row, prior, sync, markers)
        else:
            chains = self.shown.once("chains", (found,), lambda: chains_of(found))
            if row >= len(chains):
                return None
            bones = np.array(sorted(chains[row]))
            track = bodies.of_chain(self.shown.body, found, row, prior, sync, markers)
            name = f"Chain {row + 1}: {part_of_bones(bones)}"
            title = name if row < len(found.candidates) else f"{name}, not laid over the markers"
            title += self._dated("localize", "prior", "sync")
            return Ghost("hypothesis", title, track, _colour(row), bones=_set(bones))
        title = f"Hypothesis: {part_of_bones(bones)}{self._dated('localize', 'prior', 'sync')}"
        return Ghost("hypothesis", title, track, _colour(row), bones=_set(bones))

    def candidate_track(self, row: int | None = None) -> BodyTrack | None:
        """The body of a candidate, the selected one by default."""
        ranked, found, markers = self.shown.get("orient"), self.shown.get("localize"), self.shown.markers
        row = self.bench.selection.candidate if row is None else row
        if row is None or ranked is None or found is None or markers is None or row >= len(ranked.candidates):
            return None
        own = ranked.candidates[row]
        if not bodies.belongs_to(own, found):
            return None  # the localization has been run anew, the orientation not yet
        return self.shown.once(
            f"candidate {row}", (own, found, markers), lambda: bodies.of_candidate(self.shown.body, own, found, markers)
        )


def _set(bones: np.ndarray) -> frozenset[int]:
    return frozenset(int(j) for j in bones if j >= 0)


def _colour(row: int) -> RGB:
    place = row % CANDIDATE_COLOURS
    return rgb(palette.categorical(CANDIDATE_COLOURS)[place])
