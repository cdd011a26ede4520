"""Every change of a cleaning, as plain values and as lines of a table."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from solver.clean.clean import Cleaned
from solver.clean.gaps import Gap, find_gaps


def changes_of(cleaned: Cleaned) -> dict[str, Any]:
    """What was cut, filled, left and proposed: lists of rows with names, rows of the file from 1, and seconds."""
    markers, cut = cleaned.markers, cleaned.outliers
    taken = cut.mask(markers.present.shape)
    values = np.full((*taken.shape, 3), np.nan)
    values[cut.frame, cut.marker] = cut.values
    spans = find_gaps(~taken)  # what is lost to the complement is what was cut
    whole = [Gap(m, 0, len(taken) - 1) for m in np.flatnonzero(taken.all(axis=0)).tolist()]
    ever = np.asarray(markers.present.any(axis=0))
    never = [label for label, seen in zip(markers.labels, ever) if not seen]
    return {
        "outliers": [
            _row(cleaned, span) | {"measured_m": values[span.first : span.last + 1, span.marker].tolist()}
            for span in [*spans, *whole]
        ],
        "fills": [
            _row(cleaned, Gap(fill.marker, fill.first, fill.last))
            | {"method": fill.method, "confidence": round(fill.confidence, 4), "expected_error_m": round(fill.error, 6)}
            for fill in cleaned.fills
        ],
        "left": [_row(cleaned, gap) for gap in find_gaps(markers.present)],
        "never_seen": never,
        "proposals": [
            {
                "number": number,
                "kind": edit.kind,
                "markers": [markers.labels[m] for m in edit.markers],
                "first_row": edit.frame + 1,
                "last_row": edit.last + 1,
                "evidence_m": round(edit.evidence, 6),
                "sentence": edit.sentence,
            }
            for number, edit in enumerate(cleaned.proposals, start=1)
        ],
        "notes": list(cleaned.notes),
    }


def lines_of(changes: dict[str, Any]) -> tuple[str, ...]:
    """The same for a person: a table of all that was done, then what is left and what is proposed."""
    rows = [
        *((row, "cut", "outlier", "", "") for row in changes["outliers"]),
        *(
            (row, "filled", row["method"], f"{row['confidence']:.2f}", f"{1000 * row['expected_error_m']:.1f}")
            for row in changes["fills"]
        ),
        *((row, "left", "", "", "") for row in changes["left"]),
    ]
    table = [
        (
            row["marker"],
            f"{row['first_row']}-{row['last_row']}",
            f"{row['first_s']:.3f}-{row['last_s']:.3f}",
            what,
            how,
            sure,
            error,
        )
        for row, what, how, sure, error in sorted(rows, key=lambda one: (one[0]["index"], one[0]["first_row"]))
    ]
    titles = ("marker", "rows", "seconds", "what", "how", "confidence", "expected error (mm)")
    return (
        *(aligned([titles, *table]) if table else ()),
        *(f"{name} is never seen and stays lost." for name in changes["never_seen"]),
        *(f"Proposed edit {edit['number']}: {edit['sentence']}" for edit in changes["proposals"]),
        *changes["notes"],
    )


def aligned(rows: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Rows as lines, columns under each other."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return tuple("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)


def _row(cleaned: Cleaned, span: Gap) -> dict[str, Any]:
    time = cleaned.markers.time
    return {
        "marker": cleaned.markers.labels[span.marker],
        "index": span.marker,
        "first_row": span.first + 1,
        "last_row": span.last + 1,
        "first_s": round(float(time[span.first]), 6),
        "last_s": round(float(time[span.last]), 6),
    }
