"""What a stage has found so far, from the notes that it sends while it runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from markerscope.app.views.candidates import (
    CHAMFER,
    MEANING,
    CandidateRow,
    CandidateTable,
    bone_names,
    candidate_table,
    part_of_bones,
    told_apart,
)
from markerscope.app.views.colours import rgb
from markerscope.app.views.convergence import TracedCurve
from markerscope.solver.core.progress import Found
from markerscope.solver.fit.results import Localization
from markerscope.widgets import palette
from markerscope.widgets.tables.candidate_data import SearchStep


def candidates_so_far(notes: Sequence[Found], found: Localization | None = None) -> CandidateTable | None:
    """The table of candidates while it fills, best first; None where the notes tell of none.

    Nothing in it can be pinned yet.

    Parameters
    ----------
    notes : in the order they came; the last word on a candidate counts
    found : the hypotheses that the default method is ranking
    """
    latest = {(note.kind, note.index): note for note in notes}
    chains = [note for (kind, _), note in latest.items() if kind == "chain"]
    if chains:
        rows = sorted((_of_chain(note) for note in chains), key=lambda row: row.score)
        wanted = int(chains[0].values["of"])
        step = SearchStep("Scored", f"{len(chains)} of {wanted} chains laid over the markers so far.", _all(rows))
        return CandidateTable(told_apart(_with_margin(rows)), (step,), *CHAMFER, MEANING[CHAMFER[0]])
    ranked = {index: note for (kind, index), note in latest.items() if kind == "candidate"}
    if not ranked or found is None:
        return None
    plain = candidate_table(found)
    rows = [_scored(row, ranked.get(row.pool)) for row in plain.rows]
    rows.sort(key=lambda row: (row.fate != "refined", not np.isfinite(row.score), row.score))
    scored = tuple(i for i, row in enumerate(rows) if np.isfinite(row.score))
    refined = tuple(i for i in scored if rows[i].fate == "refined")
    steps = (
        replace(plain.steps[0], rows=_all(rows)),
        replace(plain.steps[1], rows=scored),
        replace(plain.steps[3], rows=refined),
    )
    return CandidateTable(told_apart(_with_margin(rows)), steps, plain.score, plain.unit, plain.meaning)


def curves_so_far(notes: Sequence[Found]) -> tuple[TracedCurve, ...]:
    """The descents so far, one for each optimisation in the order they began."""
    paths: dict[str, list[Found]] = {}
    for note in notes:
        if note.kind == "iteration":
            paths.setdefault(str(note.values["text"]), []).append(note)
    colours = palette.categorical(len(paths))
    return tuple(
        TracedCurve(
            stage="running",
            label=text,
            candidate=-1,
            iteration=np.array([note.index for note in path]),
            energy=np.array([float(note.values["energy"]) for note in path]),
            colour=rgb(colours[i]),
        )
        for i, (text, path) in enumerate(paths.items())
    )


def _of_chain(note: Found) -> CandidateRow:
    bones = np.asarray(note.values["bones"])
    return CandidateRow(
        pool=note.index,
        candidate=-1,
        fate="scored",
        part=part_of_bones(bones),
        bones=bone_names(bones),
        yaw_deg=float(note.values["yaw_deg"]),
        distance=1000 * float(note.values["one_way"]) ** 0.5,
        score=1e6 * float(note.values["chamfer"]),
        chain=note.index + 1,
        energy=float(note.values.get("energy", np.nan)),
    )


def _scored(row: CandidateRow, note: Found | None) -> CandidateRow:
    if note is None:
        return row
    return replace(row, fate="refined" if note.values["refined"] else "scored", score=float(note.values["energy"]))


def _with_margin(rows: Sequence[CandidateRow]) -> tuple[CandidateRow, ...]:
    """The rows with their scores over the best of the same fate."""
    best: dict[str, float] = {}
    for row in rows:
        if np.isfinite(row.score):
            best[row.fate] = min(row.score, best.get(row.fate, np.inf))
    return tuple(
        replace(row, margin=row.score / max(best[row.fate], 1e-12)) if np.isfinite(row.score) else row for row in rows
    )


def _all(rows: Sequence[CandidateRow]) -> tuple[int, ...]:
    return tuple(range(len(rows)))
