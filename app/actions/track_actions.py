"""Trajectories edited by hand: gaps filled, samples deleted, trajectories cut, exchanged, joined, and all put back."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from markerscope.app.actions.action import Action, ActionWith, Asks, Reason, first, needs_session
from markerscope.app.models import track_edits
from markerscope.app.models.gap_previews import BODY, WAYS, Preview, best, preview
from markerscope.app.models.gap_target import span_of, target_gaps
from markerscope.app.models.workbench import Workbench
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.fill_by_hand import PlacedFill
from markerscope.solver.cleaning.gaps import Gap
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.names import FIT

WAY_TITLES = {
    "regression": "Regression on the neighbours",
    "rigid": "Rigid body of the neighbours",
    "edm": "Distances to the neighbours",
    "pattern": "Pattern of one neighbour",
    "spline": "Spline",
    "linear": "Straight line",
    BODY: "Fitted body",
}


def no_tracks(bench: Workbench) -> str:
    """Why there are no trajectories to work on."""
    if reason := needs_session(bench):
        return reason
    return "" if bench.working.now() is not None else "the markers have not been read"


def work_of(bench: Workbench) -> Working:
    """The trajectories, which are known to be there."""
    work = bench.working.now()
    assert work is not None
    return work


def chosen_of(bench: Workbench) -> list[int]:
    """The selected markers that there are."""
    count = work_of(bench).edited.positions.shape[1]
    return sorted(m for m in bench.selection.markers if m < count)


def no_marker(bench: Workbench) -> str:
    """Whether no marker is selected."""
    return no_tracks(bench) or ("" if chosen_of(bench) else "no marker is selected")


def targets(bench: Workbench) -> tuple[Gap, ...]:
    """The gaps that are meant."""
    return target_gaps(work_of(bench), bench.clock, chosen_of(bench))


def _no_gap(bench: Workbench) -> str:
    if targets(bench):
        return ""
    return "no gap of the selected markers is at this frame; go to the next one (N), or mark a range over it"


def placed_of(bench: Workbench) -> np.ndarray | None:
    """(T, M, 3) m, where the fit in force has the markers; None without one."""
    return bench.board.current[FIT].placed if "fit" in bench.board.keys and "fit" in bench.board.current else None


def _no_fit(bench: Workbench) -> str:
    placed = placed_of(bench)
    if placed is not None and placed.shape == work_of(bench).measured.positions.shape:
        return ""
    return "there is no fit of these trajectories in force; run it first"


def _preview(bench: Workbench, gap: Gap, way: str) -> Preview:
    """What is shown already, else made now."""
    shown = next((p for p in bench.previews.found if p.way == way), None) if bench.previews.gap == gap else None
    return shown or preview(work_of(bench), placed_of(bench), gap, way)


def _able(bench: Workbench, way: str) -> list[tuple[Gap, Preview]]:
    """The gaps that are meant, as a way fills them.

    Raises
    ------
    InputError : it can fill none
    """
    found = [(gap, _preview(bench, gap, way)) for gap in targets(bench)]
    able = [(gap, made) for gap, made in found if made.values is not None]
    if not able:
        raise InputError(found[0][1].why_not, WAY_TITLES[way], "fill it in another way")
    return able


def _fill(way: str) -> Callable[[Workbench, Asks], object]:
    def run(bench: Workbench, asks: Asks) -> None:
        able = _able(bench, way)
        work, session = work_of(bench), bench.document.session
        if way == BODY:
            fills = [_placed(gap, made) for gap, made in able]
            bench.document.apply(track_edits.place_fills(session, work, fills))
        else:
            bench.document.apply(track_edits.fill_gaps(session, work, [gap for gap, _ in able], way))  # type: ignore[arg-type]

    return run


def _placed(gap: Gap, made: Preview) -> PlacedFill:
    assert made.values is not None
    places = tuple((float(x), float(y), float(z)) for x, y, z in np.round(made.values, 6))
    return PlacedFill(gap.marker, gap.first, places, float(made.error))


def _fill_best(bench: Workbench, asks: Asks) -> None:
    """Fill each gap that is meant in the way of least expected error."""
    session, work = bench.document.session, work_of(bench)
    edit = None
    for gap in targets(bench):
        chosen = best(tuple(_preview(bench, gap, way) for way in WAYS))
        if chosen is None:
            continue
        if chosen.way == BODY:
            edit = track_edits.place_fills(session, work, [_placed(gap, chosen)])
        else:
            edit = track_edits.fill_gaps(session, work, [gap], chosen.way)  # type: ignore[arg-type]
        session = edit.session
    if edit is None:
        raise InputError("no way can fill it", "the gap", "delete what is wrong beside it, or leave it lost")
    bench.document.apply(edit)


def _no_span(bench: Workbench) -> str:
    return "" if bench.clock.loop is not None else "no range is marked; drag over the frames in the curves"


def _nothing_seen(bench: Workbench) -> str:
    span, work = span_of(bench.clock), work_of(bench)
    assert span is not None
    seen = work.edited.present[span[0] : span[1] + 1, chosen_of(bench)].any()
    return "" if seen else "nothing is seen of the selected markers in the range"


def _delete(bench: Workbench, asks: Asks) -> None:
    span = span_of(bench.clock)
    assert span is not None
    bench.document.apply(track_edits.delete_span(bench.document.session, work_of(bench), chosen_of(bench), *span))


def _not_one(bench: Workbench) -> str:
    return "" if len(chosen_of(bench)) == 1 else "one marker has to be selected"


def _not_two(bench: Workbench) -> str:
    return "" if len(chosen_of(bench)) == 2 else "two markers have to be selected"


def _no_cut(bench: Workbench) -> str:
    return track_edits.why_no_cut(work_of(bench), chosen_of(bench)[0], bench.clock.marker_frame or 0)


def _cut(bench: Workbench, asks: Asks) -> None:
    (marker,), frame = chosen_of(bench), bench.clock.marker_frame or 0
    bench.document.apply(track_edits.cut_at(bench.document.session, work_of(bench), marker, frame))


def _exchange(bench: Workbench, asks: Asks) -> None:
    a, b = chosen_of(bench)
    frame = bench.clock.marker_frame or 0
    bench.document.apply(track_edits.exchange_from(bench.document.session, work_of(bench), a, b, frame))


def _no_join(bench: Workbench) -> str:
    return track_edits.why_no_join(work_of(bench), *chosen_of(bench))


def _join(bench: Workbench, asks: Asks) -> None:
    bench.document.apply(track_edits.join(bench.document.session, work_of(bench), *chosen_of(bench)))


def _put_back(bench: Workbench, asks: Asks) -> None:
    """Of the range, else of the gap or the stretch that the clock is in."""
    work, chosen, here = work_of(bench), chosen_of(bench), bench.clock.marker_frame or 0
    span = span_of(bench.clock)
    if span is None:
        stretches = [gap for m in chosen for gap in work.gaps_of(m, here, here)]
        span = min([g.first for g in stretches] or [here]), max([g.last for g in stretches] or [here])
    bench.document.apply(track_edits.put_back(bench.document.session, work, chosen, *span))


def _clean(bench: Workbench, asks: Asks) -> None:
    bench.runner.run(["clean"])


def _is_clean(bench: Workbench) -> str:
    if bench.runner.running:
        return "stages are running; wait for them, or stop them"
    return "the cleaning is up to date" if "clean" in bench.board.current else ""


def _action(
    id: str, title: str, help: str, run: Callable[[Workbench, Asks], object], key: str, *checks: Reason
) -> Action:
    return Action(id, title, "Edit", help, run, key, first(*checks))


SELECT_AT: ActionWith[tuple[int, int]] = ActionWith(
    "curves.at",
    "Go to a marker's frame",
    lambda bench, asks, given: bench.walk.reach(frozenset({given[0]}), given[1]),
)
TRACKS_WITH = (SELECT_AT,)

TRACK_ACTIONS = (
    _action(
        "fill.best",
        "Fill the gap as expected best",
        "Fill the gap at this frame, or those in the range, in the way whose expected error is least.",
        _fill_best,
        "Ctrl+G",
        no_marker,
        _no_gap,
    ),
    *(
        _action(
            f"fill.{way}",
            WAY_TITLES[way],
            f"Fill the gap at this frame, or those in the range: {WAY_TITLES[way][0].lower()}{WAY_TITLES[way][1:]}.",
            _fill(way),
            "",
            *(no_marker, _no_gap, *((_no_fit,) if way == BODY else ())),
        )
        for way in WAYS
    ),
    _action(
        "tracks.delete",
        "Delete samples in the range",
        "Take the samples of the selected markers in the range out; they can be put back.",
        _delete,
        "Ctrl+Del",
        no_marker,
        _no_span,
        _nothing_seen,
    ),
    _action(
        "tracks.cut",
        "Cut the trajectory in two here",
        "What the selected marker shows from this frame on becomes a trajectory of its own.",
        _cut,
        "Ctrl+Shift+X",
        no_marker,
        _not_one,
        _no_cut,
    ),
    _action(
        "tracks.exchange",
        "Exchange the two trajectories from here",
        "The two selected markers exchange their trajectories from this frame on.",
        _exchange,
        "Ctrl+Shift+J",
        no_marker,
        _not_two,
    ),
    _action(
        "tracks.join",
        "Join the two trajectories",
        "The samples of one selected marker go to the other, where both are never seen together.",
        _join,
        "Ctrl+J",
        no_marker,
        _not_two,
        _no_join,
    ),
    _action(
        "tracks.put_back",
        "Put back",
        "Take back what was filled, deleted or cut by hand, and outliers that were cut: in the range, else here.",
        _put_back,
        "Ctrl+Backspace",
        no_marker,
    ),
    Action(
        "clean.run",
        "Run the cleaning",
        "Run",
        "Apply every edit of trajectories that was decided, together; what stands on the cleaning goes out of date.",
        _clean,
        "F7",
        first(no_tracks, _is_clean),
    ),
)
