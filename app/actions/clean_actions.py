"""What the cleaning proposes and what it cut: to be looked at, made true, or put back."""

from __future__ import annotations

import numpy as np

from markerscope.app.actions.action import Action, Asks, first, needs
from markerscope.app.models import clean_edits
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.names import CLEAN, MARKERS

_needs_clean = needs("clean", "the markers have not been cleaned")


def _no_proposal(bench: Workbench) -> str:
    return "" if bench.board.current[CLEAN].proposals else "no edit of tracks is proposed"


def _next(bench: Workbench, asks: Asks) -> None:
    """Go to the next proposal after the clock's frame, and select its markers."""
    proposals = sorted(bench.board.current[CLEAN].proposals, key=lambda proposal: proposal.frame)
    here = bench.clock.marker_frame or 0
    chosen = next((p for p in proposals if p.frame > here), proposals[0])
    bench.selection.select_markers(chosen.markers)
    bench.clock.seek_marker_frame(chosen.frame)
    bench.say(Said("note", chosen.sentence.rstrip("."), "proposed", "make it true with Edit, Make the proposed edit"))


def _meant(bench: Workbench) -> Proposal | None:
    """The proposal of the two selected markers that is nearest to the clock's frame."""
    own = [p for p in bench.board.current[CLEAN].proposals if {*p.markers} == bench.selection.markers]
    here = bench.clock.marker_frame or 0
    return min(own, key=lambda proposal: abs(proposal.frame - here), default=None)


def _none_meant(bench: Workbench) -> str:
    return "" if _meant(bench) is not None else "no edit is proposed for the selected markers; go to the next one first"


def _accept(bench: Workbench, asks: Asks) -> None:
    proposal = _meant(bench)
    assert proposal is not None
    bench.document.apply(clean_edits.accept(bench.document.session, proposal))


def _keep(bench: Workbench, asks: Asks) -> None:
    """Put back what was cut of the selected markers: in the range, or else the stretch at or next to this frame."""
    cleaned = bench.board.current[CLEAN]
    mask = cleaned.outliers.mask(cleaned.markers.positions.shape[:2])
    stretches = {
        marker: found
        for marker in sorted(bench.selection.markers)
        if (found := _stretch(bench, np.flatnonzero(mask[:, marker]))) is not None
    }
    if not stretches:
        raise InputError("nothing was cut of the selected markers there", "what was cut", "click on a cut frame first")
    labels = bench.board.current[MARKERS].labels
    bench.document.apply(clean_edits.keep_samples(bench.document.session, stretches, labels))


def _stretch(bench: Workbench, cut: np.ndarray) -> tuple[int, int] | None:
    """First and last of the frames (n,) that are meant, None where none is."""
    timing = bench.clock.timing
    if bench.clock.loop is not None:
        start, stop = ((end - timing.first) * timing.rate for end in bench.clock.loop)
        cut = cut[(cut >= start - 0.5) & (cut <= stop + 0.5)]
        return (int(cut[0]), int(cut[-1])) if len(cut) else None
    if not len(cut):
        return None
    here = bench.clock.marker_frame or 0
    runs = np.split(cut, np.flatnonzero(np.diff(cut) > 1) + 1)
    nearest = min(runs, key=lambda run: max(run[0] - here, here - run[-1], 0))
    return int(nearest[0]), int(nearest[-1])


def _nothing_cut(bench: Workbench) -> str:
    if not bench.selection.markers:
        return "no marker is selected"
    cut = set(bench.board.current[CLEAN].outliers.marker.tolist())
    return "" if cut & bench.selection.markers else "nothing was cut of the selected markers"


CLEAN_ACTIONS = (
    Action(
        "clean.next",
        "Next proposed edit of tracks",
        "Edit",
        "Go to the next place where two tracks seem to have been exchanged or broken, and select their markers.",
        _next,
        "Shift+N",
        first(_needs_clean, _no_proposal),
    ),
    Action(
        "clean.accept",
        "Make the proposed edit",
        "Edit",
        "Exchange or join the tracks of the selected markers as the cleaning proposes it.",
        _accept,
        "Ctrl+Return",
        first(_needs_clean, _none_meant),
    ),
    Action(
        "clean.keep",
        "Put back what was cut",
        "Edit",
        "Keep samples of the selected markers that were taken for outliers: in the range, else nearest to this frame.",
        _keep,
        "Ctrl+Shift+K",
        first(_needs_clean, _nothing_cut),
    ),
)
