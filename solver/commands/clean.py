"""What ``markerscope clean`` does: a marker file to a cleaned one, and a list of every change beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from markerscope.solver import __version__
from markerscope.solver.cleaning.changes import changes_of, csv_of, lines_of
from markerscope.solver.cleaning.clean import Cleaned, CleanSettings, clean
from markerscope.solver.cleaning.request import CleanRequest
from markerscope.solver.cleaning.swaps import apply_proposals
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.c3d_keep import Original
from markerscope.solver.io.filled_list import filled_list_path
from markerscope.solver.io.together import together
from markerscope.solver.neural.per_layout.fill_by_weights import fill_by_weights
from markerscope.solver.pipeline.source import Source


def clean_file(request: CleanRequest, progress: Progress = silent) -> Outcome:
    """Read, clean, write, and say every change.

    Raises
    ------
    InputError : the file cannot be read or written, or an edit is to be made that was not proposed
    """
    from markerscope.solver.io import load_markers
    from markerscope.solver.io.output_folder import check_output_folder

    if not request.markers.exists():
        raise InputError("there is no such file", request.markers, "check the name and the folder")
    if request.out.exists() and request.out.samefile(request.markers):
        raise InputError("would be overwritten", request.out, "choose another name for the cleaned file")
    check_output_folder(request.out.parent)
    progress(0.0, "reading")
    watch = _watched(request)
    markers = load_markers(
        request.markers,
        up=request.up,
        units=request.units,
        subject=request.subject,
        rate=request.marker_rate,
    ).between(*(request.range or (None, None)))
    settings = settings_of(request)
    fill_by = None if request.weights is None else fill_by_weights(request.weights, markers)
    about = _about(request, settings, watch)
    made: list[str] = []
    if request.apply:
        markers, made = _edited(markers, settings, request.apply)
    cleaned = clean(markers, settings, part_of(progress, 0.1, 0.9), fill_by)
    progress(0.9, "writing")
    old = (filled_list_path(request.out).name,) if request.out.suffix.lower() == ".trc" else ()
    listed, table = request.out.with_suffix(".changes.json"), request.out.with_suffix(".changes.csv")
    with together(request.out.parent, gone=old) as folder:
        original = Original(request.markers, request.units, request.subject)
        not_kept = write_markers(folder / request.out.name, cleaned.markers, original)
        changes = changes_of(cleaned) | {"edits_made": made}
        changes["notes"] = [*markers.notes, *not_kept, *changes["notes"]]
        write_text_atomic(folder / listed.name, json_text(about | changes) + "\n")
        write_text_atomic(folder / table.name, csv_of(changes))
    lines = (
        *(f"Edit made: {sentence}" for sentence in made),
        *lines_of(changes),
        f"Written to {request.out}; every change is in {listed.name} and {table.name} beside it.",
    )
    return Outcome(summary={"out": str(request.out), **_totals(cleaned), **changes}, lines=lines)


def _watched(request: CleanRequest) -> dict[str, Source]:
    """The files that are read, as they are before."""
    given = {"input": request.markers, "weights": request.weights}
    return {name: Source.file(path) for name, path in given.items() if path is not None}


def _about(request: CleanRequest, settings: CleanSettings, read: Mapping[str, Source]) -> dict[str, Any]:
    """What is cleaned from what, once all is read.

    Raises
    ------
    InputError : a file has changed meanwhile
    """
    for source in read.values():
        source.require()
    files = {name: {"file": source.value.name, "sha256": source.content} for name, source in read.items()}
    return {"program": f"markerscope {__version__}", **files, "settings": asdict(settings)}


def settings_of(request: CleanRequest) -> CleanSettings:
    """The settings that a request means."""
    settings = CleanSettings()
    fill, outliers = settings.fill, settings.outliers
    if request.fill is not None and request.fill != "none" and request.fill != "network":
        fill = replace(fill, method=request.fill)
    if request.max_gap is not None:
        fill = replace(fill, max_gap=None if math.isinf(request.max_gap) else request.max_gap)
    if request.min_confidence is not None:
        fill = replace(fill, min_confidence=request.min_confidence)
    if request.outliers is not None:
        outliers = replace(outliers, method=request.outliers)
    return replace(settings, fill=fill, outliers=outliers, fill_gaps=request.fill != "none")


def write_markers(path: Path, markers: Markers, original: Original | None = None) -> tuple[str, ...]:
    """Write in the format that the name's ending says; tell what of the original C3D, if any, was not kept in a C3D."""
    from markerscope.solver.io.c3d_keep import kept_or_plain
    from markerscope.solver.io.export_csv import write_markers_csv
    from markerscope.solver.io.export_trc import write_trc

    suffix = path.suffix.lower()
    if suffix == ".c3d":
        return kept_or_plain(path, markers, original)
    if suffix == ".trc":
        write_trc(path, markers)
    else:
        write_markers_csv(path, markers)
    return ()


def _edited(markers: Markers, settings: CleanSettings, numbers: tuple[int, ...]) -> tuple[Markers, list[str]]:
    """The markers with those of the proposed edits made that were asked for."""
    proposed = clean(markers, replace(settings, fill_gaps=False, tracks=True)).proposals
    unknown = [number for number in numbers if number > len(proposed)]
    if unknown:
        what = f"there is no proposed edit {unknown[0]}, there are {len(proposed)}"
        raise InputError(what, "--apply", "run it without, and choose from what is proposed")
    chosen = [proposed[number - 1] for number in sorted(set(numbers))]
    return apply_proposals(markers, chosen), [edit.sentence for edit in chosen]


def _totals(cleaned: Cleaned) -> dict[str, object]:
    markers = cleaned.markers
    return {
        "frames": len(markers.positions),
        "markers": len(markers.labels),
        "samples_cut": len(cleaned.outliers.frame),
        "samples_filled": int(cleaned.filled.sum()),
        "samples_lost": int((~markers.present).sum()),
    }
