"""What the cleaning proposes and what it cut: to be looked at, made true, or put back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, first, needs, or_without
from markerscope.app.actions.track_actions import no_tracks, work_of
from markerscope.app.models import clean_edits, track_edits
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.names import CLEAN

_needs_clean = needs("clean", "the markers have not been cleaned")


def _open(bench: Workbench) -> tuple[Proposal, ...]:
    """Proposals that are neither accepted nor rejected."""
    work = work_of(bench)
    return tuple(p for p in work.proposals if not work.accepted(p))


def _no_proposal(bench: Workbench) -> str:
    return "" if _open(bench) else "no edit of tracks is proposed"


def _go(forward: bool) -> Callable[[Workbench, Asks], object]:
    """Go to the next or previous proposal, and select its markers."""

    def run(bench: Workbench, asks: Asks) -> None:
        proposals, here = _open(bench), bench.clock.marker_frame or 0
        later = [p for p in proposals if p.frame > here]
        sooner = [p for p in proposals if p.frame < here]
        show(bench, (later or list(proposals))[0] if forward else (sooner or list(proposals))[-1])

    return run


def show(bench: Workbench, proposal: Proposal) -> None:
    """Go to a proposal, select its markers, and say it."""
    bench.walk.reach(frozenset(proposal.markers), proposal.frame)
    remedy = "make it true with Edit, Make the proposed edit"
    bench.say(Said("note", proposal.sentence.rstrip("."), "proposed", remedy))


def _meant(bench: Workbench) -> Proposal | None:
    """The open proposal of the two selected markers that is nearest to the clock's frame."""
    own = [p for p in _open(bench) if {*p.markers} == bench.selection.markers]
    here = bench.clock.marker_frame or 0
    return min(own, key=lambda proposal: abs(proposal.frame - here), default=None)


def _none_meant(bench: Workbench) -> str:
    return "" if _meant(bench) is not None else "no edit is proposed for the selected markers; go to the next one first"


def _accept(bench: Workbench, asks: Asks) -> None:
    proposal = _meant(bench)
    assert proposal is not None
    bench.document.apply(track_edits.accept(bench.document.session, [proposal]))


def _reject(bench: Workbench, asks: Asks) -> None:
    proposal = _meant(bench)
    assert proposal is not None
    bench.document.apply(track_edits.reject(bench.document.session, work_of(bench), [proposal]))


def _accept_all(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(track_edits.accept(bench.document.session, _open(bench)))


def _reconsider(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(track_edits.reconsider(bench.document.session))


def _none_rejected(bench: Workbench) -> str:
    return "" if work_of(bench).settings.rejected else "no proposal was rejected"


ACCEPT: ActionWith[tuple[Proposal, ...]] = ActionWith(
    "proposals.accept",
    "Accept proposed edits",
    lambda bench, asks, some: bench.document.apply(track_edits.accept(bench.document.session, some)),
    lambda bench, some: no_tracks(bench) or ("" if some else "no proposal is chosen"),
)
REJECT: ActionWith[tuple[Proposal, ...]] = ActionWith(
    "proposals.reject",
    "Reject proposed edits",
    lambda bench, asks, some: bench.document.apply(track_edits.reject(bench.document.session, work_of(bench), some)),
    lambda bench, some: no_tracks(bench) or ("" if some else "no proposal is chosen"),
)
SHOW: ActionWith[Proposal] = ActionWith(
    "proposals.show", "Go to a proposed edit", lambda bench, asks, one: show(bench, one), or_without(no_tracks)
)
CLEAN_WITH = (ACCEPT, REJECT, SHOW)


def _walk_cut(forward: bool) -> Callable[[Workbench, Asks], object]:
    """Go to the next or previous stretch that was cut as an outlier."""

    def run(bench: Workbench, asks: Asks) -> None:
        whose = "of the selected markers" if bench.walk.scope else "of any marker"
        if not bench.walk.go(work_of(bench).cut_stretches, forward):
            raise InputError(f"nothing {whose} was cut as an outlier", "outliers")

    return run


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
    labels = cleaned.markers.labels
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
        _go(True),
        "X",
        first(no_tracks, _no_proposal),
    ),
    Action(
        "clean.back",
        "Previous proposed edit of tracks",
        "Edit",
        "Go to the place before where two tracks seem to have been exchanged or broken, and select their markers.",
        _go(False),
        "Shift+X",
        first(no_tracks, _no_proposal),
    ),
    Action(
        "clean.accept",
        "Make the proposed edit",
        "Edit",
        "Exchange or join the tracks of the selected markers as the cleaning proposes it.",
        _accept,
        "Ctrl+Return",
        first(no_tracks, _none_meant),
    ),
    Action(
        "clean.reject",
        "Reject the proposed edit",
        "Edit",
        "Have the edit that is proposed for the selected markers not offered any more.",
        _reject,
        "Ctrl+Shift+Return",
        first(no_tracks, _none_meant),
    ),
    Action(
        "clean.accept_all",
        "Make all proposed edits",
        "Edit",
        "Make every edit of tracks that is proposed and not rejected; the next cleaning applies them together.",
        _accept_all,
        "",
        first(no_tracks, _no_proposal),
    ),
    Action(
        "clean.reconsider",
        "Offer rejected edits again",
        "Edit",
        "Have the proposals that were rejected among the others again.",
        _reconsider,
        "",
        first(no_tracks, _none_rejected),
    ),
    Action(
        "go.outlier",
        "Next outlier",
        "Play",
        "Go to the next stretch that was cut as an outlier, of a selected marker or of any, and select its marker.",
        _walk_cut(True),
        "U",
        no_tracks,
    ),
    Action(
        "go.outlier_back",
        "Previous outlier",
        "Play",
        "Go to the previous stretch that was cut as an outlier, of a selected marker or of any, and select its marker.",
        _walk_cut(False),
        "Shift+U",
        no_tracks,
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
