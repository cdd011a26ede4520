"""What ``markerscope label`` does: names of a marker set for the trajectories of a file, and what was mended."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.body.bones import load_body
from markerscope.solver.commands.clean import write_markers
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.c3d_keep import Original
from markerscope.solver.io.filled_list import filled_list_path
from markerscope.solver.io.together import together
from markerscope.solver.markerset.columns import CERTAIN, Ordered, contradictions, in_order
from markerscope.solver.markerset.label import Labelled, label
from markerscope.solver.markerset.marker_set import MarkerSet
from markerscope.solver.markerset.request import LabelRequest
from markerscope.solver.markerset.shipped import marker_set_of
from markerscope.solver.pipeline.source import Source

_MOST_SAID = 12


def label_file(request: LabelRequest, progress: Progress = silent) -> Outcome:
    """Read, name, mend, write, and say what was done.

    Raises
    ------
    InputError : the file cannot be read or written, the set is not there, or nobody with its markers is found
    """
    outcome, _, _ = label_into(request, progress)
    return outcome


def label_into(request: LabelRequest, progress: Progress = silent) -> tuple[Outcome, Markers, Labelled]:
    """The same, with the trajectories as they were written and what was found."""
    from markerscope.solver.io import load_markers
    from markerscope.solver.io.output_folder import check_output_folder

    marker_set = marker_set_of(request.marker_set)
    if not request.markers.exists():
        raise InputError("there is no such file", request.markers, "check the name and the folder")
    if request.out.exists() and request.out.samefile(request.markers):
        raise InputError("would be overwritten", request.out, "choose another name for the labelled file")
    check_output_folder(request.out.parent)
    progress(0.0, "reading")
    source = Source.file(request.markers)
    markers = load_markers(
        request.markers, up=request.up, units=request.units, subject=request.subject, rate=request.marker_rate
    ).between(*(request.range or (None, None)))
    found = label(load_body(), marker_set, markers, part_of(progress, 0.02, 0.95))
    ordered = in_order(markers, found)
    notes = (*markers.notes, *found.notes, *contradictions(markers, found))
    progress(0.96, "writing")
    source.require()
    listed, table = request.out.with_suffix(".labels.json"), request.out.with_suffix(".labels.csv")
    old = (filled_list_path(request.out).name,) if request.out.suffix.lower() == ".trc" else ()
    with together(request.out.parent, gone=old) as folder:
        original = Original(request.markers, request.units, request.subject)
        not_kept = write_markers(folder / request.out.name, ordered.markers, original)
        notes = (*notes, *not_kept)
        about = _about(request, marker_set, source, markers, found, ordered, notes)
        write_text_atomic(folder / listed.name, json_text(about) + "\n")
        write_text_atomic(folder / table.name, csv_of(markers, ordered))
    progress(1.0, "done")
    lines = (
        *_lines(markers, found, ordered),
        *(f"Note: {note}" for note in notes),
        f"Written to {request.out}; every name and its probability is in {table.name} and {listed.name} beside it.",
    )
    return Outcome(summary={"out": str(request.out), **about}, lines=lines), ordered.markers, found


def csv_of(markers: Markers, ordered: Ordered) -> str:
    """One row for each stretch of a trajectory: what it was, what it is, and how sure that is."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    head = "trajectory first_frame last_frame first_time last_time name probability what into".split()
    writer.writerow(head)
    for one in ordered.stretches:
        writer.writerow(
            [
                markers.labels[one.trajectory],
                one.first + 1,
                one.last + 1,
                f"{markers.time[one.first]:.6g}",
                f"{markers.time[one.last]:.6g}",
                one.name,
                "" if math.isnan(one.probability) else f"{one.probability:.4f}",
                one.what,
                ordered.markers.labels[one.into],
            ]
        )
    return text.getvalue()


def _about(
    request: LabelRequest,
    marker_set: MarkerSet,
    source: Source,
    markers: Markers,
    found: Labelled,
    ordered: Ordered,
    notes: Sequence[str],
) -> dict[str, Any]:
    """What the JSON beside the file says."""
    named = found.name >= 0
    sure = named & (np.nan_to_num(found.probability) >= CERTAIN)
    seen = int(markers.present.sum())
    return {
        "program": f"markerscope {__version__}",
        "input": {"file": request.markers.name, "sha256": source.content},
        "marker_set": {"name": marker_set.name, "origin": marker_set.origin, "source": marker_set.source},
        "frames": len(markers.positions),
        "first_frame_counts_as": 1,
        "same_person_as_the_set": found.same_person,
        "samples": {
            "seen": seen,
            "named": int(named.sum()),
            "certain": int(sure.sum()),
            "unlabelled": seen - int(named.sum()),
        },
        "certain_from": CERTAIN,
        "not_found": [name for u, name in enumerate(found.names) if not (found.name == u).any()],
        "trajectories_added": ordered.added,
        "trajectories_emptied": [markers.labels[c] for c in ordered.emptied],
        "stretches": [
            asdict(one)
            | {
                "trajectory": markers.labels[one.trajectory],
                "into": ordered.markers.labels[one.into],
                "first": one.first + 1,
                "last": one.last + 1,
                "probability": None if math.isnan(one.probability) else round(one.probability, 4),
            }
            for one in ordered.stretches
        ],
        "notes": list(notes),
    }


def _lines(markers: Markers, found: Labelled, ordered: Ordered) -> tuple[str, ...]:
    """What is told."""
    seen = max(int(markers.present.sum()), 1)
    named = found.name >= 0
    sure = named & (np.nan_to_num(found.probability) >= CERTAIN)
    there = [name for u, name in enumerate(found.names) if (found.name == u).any()]
    absent = [name for name in found.names if name not in there]
    person = "the person that the set was learnt on" if found.same_person else "another person than the set's"
    lines = [
        f"{len(there)} of the set's {len(found.names)} names were found, on {person}: {100 * named.sum() / seen:.1f} % "
        f"of the samples are named, {100 * sure.sum() / seen:.1f} % with a probability of at least {CERTAIN:g}."
    ]
    if absent:
        lines.append(f"Not found: {_some(absent)}.")
    for what, verb in (("joined", "Joined"), ("exchanged", "Exchanged back"), ("proposed", "Proposed, not done")):
        those = [one for one in ordered.stretches if one.what == what]
        for one in those[:_MOST_SAID]:
            lines.append(
                f"{verb}: {markers.labels[one.trajectory]} is {one.name} from {markers.time[one.first]:.3f} to "
                f"{markers.time[one.last]:.3f} s (probability {one.probability:.2f})."
            )
        if len(those) > _MOST_SAID:
            lines.append(f"{verb}: {len(those) - _MOST_SAID} more.")
    doubtful = sorted({one.name for one in ordered.stretches if one.what == "named" and one.probability < CERTAIN})
    if doubtful:
        lines.append(f"Not sure (look at these first): {_some(doubtful)}.")
    return tuple(lines)


def _some(names: Sequence[str], most: int = 10) -> str:
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")


def beside(out: Path) -> tuple[Path, Path]:
    """The table and the list that lie beside a labelled file."""
    return out.with_suffix(".labels.csv"), out.with_suffix(".labels.json")
