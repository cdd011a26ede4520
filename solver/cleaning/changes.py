"""Every change of a cleaning, as plain values and as lines of a table."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any

import numpy as np

from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.cleaning.gaps import Gap, find_gaps


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
            | {"method": fill.method, "confidence": round(fill.confidence, 4), "expected_error_m": _known(fill.error)}
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


TITLES = ("marker", "rows", "seconds", "what", "how", "confidence", "expected error (mm)")


def lines_of(changes: dict[str, Any]) -> tuple[str, ...]:
    """The same for a person: a table of all that was done, then what is left and what is proposed."""
    table = [
        (
            row["marker"],
            f"{row['first_row']}-{row['last_row']}",
            f"{row['first_s']:.3f}-{row['last_s']:.3f}",
            row["what"],
            row.get("method", ""),
            f"{row['confidence']:.2f}" if "confidence" in row else "",
            _in_mm(row["expected_error_m"]) if "expected_error_m" in row else "",
        )
        for row in _by_marker(changes)
    ]
    return (
        *changes["notes"],
        *(aligned([TITLES, *table]) if table else ()),
        *(f"{name} is never seen and stays lost." for name in changes["never_seen"]),
        *(f"Proposed edit {edit['number']}: {edit['sentence']}" for edit in changes["proposals"]),
    )


def csv_of(changes: dict[str, Any]) -> str:
    """The same for a spreadsheet: a line for each span cut, filled or left, and each edit made or proposed."""
    names = ("what", "marker", "other", "first_row", "last_row", "first_s", "last_s", "method", "confidence")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*names, "expected_error_m", "sentence"])
    for row in _by_marker(changes):
        writer.writerow([*(row.get(name, "") for name in names), row.get("expected_error_m", ""), ""])
    for name in changes["never_seen"]:
        writer.writerow(["never seen", name, *[""] * 9])
    for sentence in changes.get("edits_made", ()):
        writer.writerow(["edit made", *[""] * 9, sentence])
    for edit in changes["proposals"]:
        span = (edit["first_row"], edit["last_row"])
        writer.writerow(["edit proposed", *edit["markers"], *span, "", "", edit["kind"], "", "", edit["sentence"]])
    for sentence in changes["notes"]:
        writer.writerow(["note", *[""] * 9, sentence])
    return text.getvalue()


def _by_marker(changes: dict[str, Any]) -> list[dict[str, Any]]:
    """Every span that was cut, filled or left, by marker, then by row."""
    kinds = (
        ("outliers", {"what": "cut", "method": "outlier"}),
        ("fills", {"what": "filled"}),
        ("left", {"what": "left"}),
    )
    rows = [row | said for name, said in kinds for row in changes[name]]
    return sorted(rows, key=lambda row: (row["index"], row["first_row"]))


def aligned(rows: Sequence[Sequence[str]]) -> tuple[str, ...]:
    """Rows as lines, columns under each other."""
    widths = [max(map(len, column)) for column in zip(*rows)]
    return tuple("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)


def _known(error: float) -> float | None:
    """An expected error, m; None where the method has none for such a gap."""
    return round(float(error), 6) if np.isfinite(error) else None


def _in_mm(error: float | None) -> str:
    return "not known" if error is None else f"{1000 * error:.1f}"


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
