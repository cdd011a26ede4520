"""Hand edits of trajectories as decisions: delete, cut, exchange, join, fill, put back; accept and reject proposals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from markerscope.app.models import clean_edits
from markerscope.app.models.edits import Edit, decide
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.by_hand import NOWHERE, sources
from markerscope.solver.cleaning.fill_by_hand import PlacedFill
from markerscope.solver.cleaning.gaps import Gap
from markerscope.solver.cleaning.request import Method
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.cleaning import CleaningSettings
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.settings import to_table

MOST_PLACES = 3000
"""Places of the body that one fill may hold: they stand in the session's file."""
Rows = Mapping[str, Iterable[Any]]


def delete_span(session: Session, work: Working, markers: Sequence[int], first: int, last: int) -> Edit:
    """Take samples of some markers out."""
    found = [row for marker in markers for row in work.seen_sources(marker, first, last)]
    if not found:
        raise InputError("nothing is seen there", _names(work, markers), "choose frames in which the marker is seen")
    rows = {"deletes": [*_of(session).deletes, *found]}
    return Edit(f"{_names(work, markers)} deleted {_frames(first, last)}", _decided(session, rows))


def cut_at(session: Session, work: Working, marker: int, frame: int) -> Edit:
    """Let what a marker shows from a frame on be a trajectory of its own."""
    if why := why_no_cut(work, marker, frame):
        raise InputError(why, _names(work, [marker]), "choose a frame with samples before and after it")
    number = _of(session).tracks.count(len(work.raw.labels))
    found = work.seen_sources(marker, frame, len(work.raw.positions) - 1)
    rows = {"cuts": [*_of(session).cuts, *((*row, number) for row in found)]}
    return Edit(f"{_names(work, [marker])} cut in two at frame {frame}", _decided(session, rows))


def why_no_cut(work: Working, marker: int, frame: int) -> str:
    """Why a trajectory cannot be cut at a frame; empty if it can."""
    seen = np.flatnonzero(work.edited.present[:, marker])
    if not len(seen):
        return "it is never seen"
    if frame <= seen[0]:
        return "nothing is seen before this frame"
    return "nothing is seen from this frame on" if frame > seen[-1] else ""


def exchange_from(session: Session, work: Working, a: int, b: int, frame: int) -> Edit:
    """Exchange two trajectories from a frame on."""
    row = (min(a, b), max(a, b), frame)
    swaps = [*_of(session).swaps]
    if row in swaps:  # exchanging twice is no exchange
        swaps.remove(row)
    else:
        swaps.append(row)
    said = f"{_names(work, [a])} and {_names(work, [b])} exchanged from frame {frame} on"
    return Edit(said, _decided(session, {"swaps": swaps}))


def join(session: Session, work: Working, a: int, b: int) -> Edit:
    """Let two trajectories be one: the samples of the later go to the one that is seen first.

    Raises
    ------
    InputError : both are seen in some frame
    """
    both = work.edited.present[:, [a, b]]
    if why := why_no_join(work, a, b):
        raise InputError(why, f"{_names(work, [a])} and {_names(work, [b])}", "delete one of them there, or cut it")
    begins = both.argmax(axis=0)
    goes_on, other = (a, b) if begins[0] <= begins[1] else (b, a)
    seen = np.flatnonzero(work.edited.present[:, other])
    stretches = np.split(seen, np.flatnonzero(np.diff(seen) > 1) + 1)
    rows = [*_of(session).joins, *((goes_on, other, int(s[0]), int(s[-1])) for s in stretches)]
    said = f"{_names(work, [other])} joined to {_names(work, [goes_on])}"
    return Edit(said, _decided(session, {"joins": rows}))


def why_no_join(work: Working, a: int, b: int) -> str:
    """Why two trajectories cannot be one; empty if they can."""
    both = work.edited.present[:, [a, b]]
    if not both.any(axis=0).all():
        return "one of them is never seen"
    together = int(both.all(axis=1).sum())
    return f"both are seen in {together} frame{'s' * (together != 1)}" if together else ""


def fill_gaps(session: Session, work: Working, gaps: Sequence[Gap], method: Method) -> Edit:
    """Fill gaps by a method."""
    rows = _without_fills(session, gaps)
    rows["fills"] = [*rows["fills"], *((gap.marker, gap.first, gap.last, method) for gap in gaps)]
    return Edit(f"{_gaps(work, gaps)} filled by {method}", _decided(session, rows))


def place_fills(session: Session, work: Working, fills: Sequence[PlacedFill]) -> Edit:
    """Fill gaps by places of the fitted body.

    Raises
    ------
    InputError : they are more than a session's file is to hold
    """
    if any(len(fill.places) > MOST_PLACES for fill in fills):
        raise InputError(
            f"the gap is longer than {MOST_PLACES} frames", "filling by the body", "fill it by one of the other methods"
        )
    gaps = [Gap(fill.marker, fill.first, fill.last) for fill in fills]
    rows = _without_fills(session, gaps)
    rows["placed"] = [*rows["placed"], *fills]
    return Edit(f"{_gaps(work, gaps)} filled by the fitted body", _decided(session, rows))


def put_back(session: Session, work: Working, markers: Sequence[int], first: int, last: int) -> Edit:
    """Take back what was decided by hand about markers in a span of frames, and what was cut there as an outlier.

    Raises
    ------
    InputError : there is nothing to put back
    """
    settings, rows = _of(session), dict[str, list[Any]]()
    own = {source for marker in markers for source in _own_sources(work, marker)}
    deletes = [part for row in settings.deletes for part in (_outside(row, first, last) if row[0] in own else [row])]
    if deletes != [*settings.deletes]:
        rows["deletes"] = deletes
    gaps = [Gap(marker, first, last) for marker in markers]
    rows |= {
        name: kept for name, kept in _without_fills(session, gaps).items() if len(kept) < len(getattr(settings, name))
    }
    cut = [stretch for stretch in work.cut_stretches if stretch.marker in markers]
    keep = [
        (stretch.marker, max(stretch.first, first), min(stretch.last, last))
        for stretch in cut
        if stretch.first <= last and stretch.last >= first
    ]
    if keep:
        rows["keep"] = [*settings.keep, *keep]
    rows |= _uncut(session, markers, first, last)
    if not rows:
        raise InputError(
            "nothing was deleted, cut or filled there by hand, and no outlier was cut",
            _names(work, markers),
            "choose the frames where something was",
        )
    return Edit(f"{_names(work, markers)} put back {_frames(first, last)}", _decided(session, rows))


def accept(session: Session, proposals: Sequence[Proposal]) -> Edit:
    """Make proposed edits; the next cleaning applies them together."""
    after = session
    for proposal in proposals:
        after = clean_edits.accept(after, proposal).session
    chosen = {(p.kind, *p.markers, p.frame) for p in proposals}
    rejected = _of(session).rejected
    if chosen & set(rejected):
        after = _decided(after, {"rejected": [row for row in rejected if row not in chosen]})
    said = proposals[0].sentence.rstrip(".") if len(proposals) == 1 else f"{len(proposals)} proposed edits made"
    return Edit(said, after)


def reject(session: Session, work: Working, proposals: Sequence[Proposal]) -> Edit:
    """Have proposed edits not offered any more; one that had been accepted is taken back."""
    rows: dict[str, list[Any]] = {"rejected": [*_of(session).rejected]}
    for proposal in proposals:
        row = (proposal.kind, *(int(marker) for marker in proposal.markers), int(proposal.frame))
        if row not in rows["rejected"]:
            rows["rejected"].append(row)
    taken = [proposal for proposal in proposals if work.accepted(proposal)]
    if taken:
        own = {(*p.markers, p.frame) for p in taken if p.kind == "swap"}
        rows["swaps"] = [row for row in _of(session).swaps if row not in own]
        own_joins = {(*p.markers, p.frame, p.last) for p in taken if p.kind == "join"}
        rows["joins"] = [row for row in _of(session).joins if row not in own_joins]
    names = " and ".join(work.edited.labels[m] for m in proposals[0].markers)
    said = f"the {proposals[0].kind} of {names}" if len(proposals) == 1 else f"{len(proposals)} proposed edits"
    return Edit(f"Rejected: {said}", _decided(session, rows))


def reconsider(session: Session) -> Edit:
    """Offer again what was rejected."""
    return Edit("Rejected proposals are offered again", _decided(session, {"rejected": []}))


def _of(session: Session) -> CleaningSettings:
    settings = session.stage_settings(graph_of(session))["clean"]
    assert isinstance(settings, CleaningSettings)
    return settings


def _decided(session: Session, rows: Rows) -> Session:
    return decide(session, "clean", {name: [_plain(row) for row in some] for name, some in rows.items()})


def _plain(row: Any) -> Any:
    if isinstance(row, PlacedFill):
        return to_table(row)
    return [value if isinstance(value, str) else int(value) for value in row]


def _without_fills(session: Session, gaps: Sequence[Gap]) -> dict[str, list[Any]]:
    """The fills that were decided, less those that touch some gaps."""

    def touched(marker: int, first: int, last: int) -> bool:
        return any(g.marker == marker and g.first <= last and g.last >= first for g in gaps)

    return {
        "fills": [row for row in _of(session).fills if not touched(*row[:3])],
        "placed": [row for row in _of(session).placed if not touched(row.marker, row.first, row.last)],
    }


def _outside(row: tuple[int, int, int], first: int, last: int) -> list[tuple[int, int, int]]:
    """What of a deleted stretch lies outside of a span."""
    marker, begins, ends = row
    if ends < first or begins > last:
        return [row]
    parts = [(marker, begins, first - 1), (marker, last + 1, ends)]
    return [part for part in parts if part[1] <= part[2]]


def _own_sources(work: Working, marker: int) -> set[int]:
    """The file's trajectories that a marker shows at some time, deletions taken for undone."""
    tracks = replace(work.settings.tracks, deletes=())
    found = sources(tracks, *work.raw.positions.shape[:2])[:, marker]
    return {int(source) for source in np.unique(found) if source != NOWHERE}


def _uncut(session: Session, markers: Sequence[int], first: int, last: int) -> dict[str, list[Any]]:
    """The cuts less the last one, where it was made in these frames of a marker and nothing stands on its number."""
    settings = _of(session)
    if not settings.cuts:
        return {}
    number = settings.cuts[-1][3]
    own = [row for row in settings.cuts if row[3] == number]
    begins = min(row[1] for row in own)
    moved = {m for a, b, *_ in (*settings.swaps, *settings.joins) for m in (a, b)}
    moved |= {row[0] for row in settings.keep} | {row[0] for row in settings.fills}
    moved |= {row.marker for row in settings.placed}
    meant = {number, *(row[0] for row in own)} & {*markers}
    if not meant or not first <= begins <= last or number in moved:
        return {}
    return {"cuts": [row for row in settings.cuts if row[3] != number]}


def _names(work: Working, markers: Sequence[int]) -> str:
    if len(markers) > 3:
        return f"{len(markers)} markers"
    return ", ".join(work.edited.labels[m] for m in markers)


def _gaps(work: Working, gaps: Sequence[Gap]) -> str:
    if len(gaps) == 1:
        return f"{_names(work, [gaps[0].marker])} {_frames(gaps[0].first, gaps[0].last)}"
    return f"{len(gaps)} gaps"


def _frames(first: int, last: int) -> str:
    return f"in frame {first}" if first == last else f"in frames {first} to {last}"
