"""Windows of a dataset as sessions that ``solve`` takes, and the list of them."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome, SolveRequest
from markerscope.solver.datasets.film import timing, write_stretch
from markerscope.solver.datasets.kitchen import KITCHEN
from markerscope.solver.datasets.moyo import MOYO
from markerscope.solver.datasets.recording import RATE, Dataset, Recording
from markerscope.solver.datasets.reference import write_reference
from markerscope.solver.datasets.request import DatasetName, DatasetRequest, Options
from markerscope.solver.datasets.umpm import UMPM
from markerscope.solver.datasets.windows import cut, from_zero, starts
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.io.together import together

DATASETS: dict[DatasetName, Dataset] = {"umpm": UMPM, "kitchen": KITCHEN, "moyo": MOYO}
MANIFEST = "sessions.json"
_PRIORS = (".pkl", ".pt", ".npy", ".npz")
_AROUND_S = 5.0
"""What is shown of the video on either side of a window whose offset is not known."""
_FEWEST = 3


def write_sessions(request: DatasetRequest, progress: Progress = silent) -> Outcome:
    """Cut a dataset into sessions, one folder each, and list them in ``sessions.json``: all of them or none.

    Raises
    ------
    InputError : the folder is not laid out as expected, or something in it cannot be read
    """
    dataset = DATASETS[request.dataset]
    _check(request, dataset)
    recordings = dataset.find(request.folder, request.options)
    offsets = _offsets(request.offsets, {recording.name for recording in recordings})
    made: list[dict[str, Any]] = []
    notes: list[str] = []
    # Beside the folder and as deep, since a session names its files from where it lies.
    staging = request.out.absolute().with_name(f".tmp-{os.getpid()}-{secrets.token_hex(4)}")
    with together(request.out, staging=staging) as place:
        for i, recording in enumerate(recordings):
            progress(i / len(recordings), recording.name)
            for entry, note in _of_recording(replace(request, out=place), dataset, recording, offsets):
                made += [entry] if entry else []
                notes += [note] if note else []
        if not made:
            raise InputError(
                f"no window of {dataset.window_s:g} s could be cut from its {len(recordings)} recordings",
                request.folder,
                notes[0].removesuffix(".") if notes else "use longer recordings",
            )
        content = {
            "program": f"markerscope {__version__}",
            "dataset": dataset.title,
            "rate": RATE,
            "window_s": dataset.window_s,
            "sessions": made,
            "notes": notes,
        }
        write_text_atomic(place / MANIFEST, json_text(content) + "\n")
    line = f"{len(made)} sessions of {len(recordings)} recordings are listed in {request.out / MANIFEST}."
    summary = {"sessions": len(made), "recordings": len(recordings), "out": str(request.out), "notes": notes}
    return Outcome(summary=summary, lines=(line,), warnings=tuple(notes))


def _check(request: DatasetRequest, dataset: Dataset) -> None:
    for path, what in ((request.folder, "folder"), (request.priors, "folder of priors")):
        if path is not None and not path.is_dir():
            raise InputError(f"is no {what}", path, "check the name")
    if request.windows is not None and request.windows < 1:
        raise InputError(f"{request.windows} is not possible", "--windows", "give 1 or more")
    for part in request.parts:
        if part not in dataset.parts:
            raise InputError(f'"{part}" is no part of {dataset.title}', "--parts", f"use {', '.join(dataset.parts)}")


def _offsets(path: Path | None, names: set[str]) -> dict[str, float]:
    if path is None:
        return {}
    from markerscope.solver.io.text import decode, read_bytes

    remedy = 'give a JSON object from recordings to seconds, such as {"s1_salad": -2.4}'
    try:
        data = json.loads(decode(read_bytes(path), path))
    except (ValueError, RecursionError) as error:
        raise InputError("is not JSON", path, remedy) from error
    fits = isinstance(data, dict) and all(
        isinstance(value, int | float) and not isinstance(value, bool) and np.isfinite(value) for value in data.values()
    )
    if not fits:
        raise InputError("holds no offsets", path, remedy)
    unknown = sorted(set(data) - names)
    if unknown:
        known = ", ".join(sorted(names)[:4])
        raise InputError(f'names "{unknown[0]}", which is no recording here', path, f"use names such as {known}")
    return {name: float(value) for name, value in data.items()}


def _of_recording(
    request: DatasetRequest, dataset: Dataset, recording: Recording, offsets: Mapping[str, float]
) -> Iterator[tuple[dict[str, Any] | None, str]]:
    """What was made of a recording, window by window; a sentence for what was not."""
    markers = from_zero(_named(load_markers(recording.markers, subject=recording.subject), dataset, request.options))
    length = len(markers.positions) / markers.rate
    prior = _prior(request.priors, recording)
    if recording.film is not None:
        rate, frames = timing(recording.film)
        length = min(length, frames / rate) if frames else length
    elif prior is None:
        yield None, f"{recording.name} has no video of the paper's camera and no prior."
        return
    times = starts(length, dataset.window_s, dataset.padding_s)[: request.windows]
    if not times:
        yield None, f"{recording.name} lasts only {length:.1f} s."
    offset = offsets.get(recording.name, 0.0 if recording.synchronised else None)
    for start in times:
        window = cut(markers, start, dataset.window_s)
        name = f"{recording.name}_{round(start * RATE):08d}"
        for part in request.parts or ("",):
            own = window if not part else _part(window, dataset.parts[part])
            session = f"{name}_{part}" if part else name
            if (own.present.sum(axis=1) == 0).any() or own.present.any(axis=0).sum() < _FEWEST:
                yield None, f"{session} was left out: there are frames without any marker, or fewer than 3 markers."
                continue
            yield _write(request, recording, session, own, part, prior, offset), ""


def _named(markers: Markers, dataset: Dataset, options: Options) -> Markers:
    """Only the dataset's markers, by their own names."""
    names = [dataset.label(raw, options) for raw in markers.labels]
    keep = [i for i, name in enumerate(names) if name is not None]
    if len(keep) < _FEWEST:
        some = ", ".join(markers.labels[:5])
        raise InputError(
            f"holds {len(keep)} markers with names of {dataset.title} ({some}...)",
            markers.source,
            "use the files as they were distributed",
        )
    chosen = markers.select(markers=np.array(keep))
    return replace(chosen, labels=tuple(str(names[i]) for i in keep))


def _part(markers: Markers, labels: Sequence[str]) -> Markers:
    return markers.select(markers=np.array([i for i, name in enumerate(markers.labels) if name in labels], dtype=int))


def _prior(folder: Path | None, recording: Recording) -> Path | None:
    if folder is None:
        return None
    names = {recording.name, recording.markers.stem}
    if recording.film is not None:
        names |= {recording.film.path.stem, f"demo_{recording.film.path.stem}"}
    for name in sorted(names, key=lambda name: name != recording.name):
        for suffix in _PRIORS:
            if (folder / f"{name}{suffix}").is_file():
                return folder / f"{name}{suffix}"
    raise InputError(f"holds no prior for {recording.name}", folder, f"name it {recording.name}.pkl")


def _write(
    request: DatasetRequest,
    recording: Recording,
    name: str,
    markers: Markers,
    part: str,
    prior: Path | None,
    offset: float | None,
) -> dict[str, Any]:
    """One session's folder: markers under meaningless names, their true names apart, video and settings."""
    from markerscope.solver.commands.solve import session_of
    from markerscope.solver.pipeline.session import save_session

    folder = make_folder(request.out / name)
    order = np.random.default_rng(sum(name.encode())).permutation(len(markers.labels))
    plain = tuple(f"M{i + 1:02d}" for i in range(len(order)))
    truth = {label: markers.labels[m] for label, m in zip(plain, order, strict=True)}
    path = folder / "markers.c3d"
    write_c3d(path, replace(markers.select(markers=order), labels=plain, R_lab_internal=np.eye(3)), up="z")
    write_text_atomic(folder / "labels.json", json_text(truth) + "\n")
    video = None
    start, stop = float(markers.time[0]), float(markers.time[-1]) + 1 / markers.rate
    if prior is None and recording.film is not None:
        video = folder / "video.mp4"
        around = _AROUND_S if offset is None else 0.0
        known = offset or 0.0
        first = write_stretch(recording.film, start - known - around, stop - known + around, video)
        offset = None if offset is None else offset + first
    made = session_of(SolveRequest(path, out=folder, video=video, prior=prior, offset=offset, up="z"))
    if prior is not None and recording.film is not None:
        made = replace(made, settings={**made.settings, "prior": {"rate": timing(recording.film)[0]}})
    save_session(made)
    reference, note = write_reference(folder / "reference.npz", recording.reference, markers)
    return {
        "session": name,
        "recording": recording.name,
        "part": part or "whole body",
        "start_s": start,
        "stop_s": stop,
        "markers": f"{name}/markers.c3d",
        "labels": f"{name}/labels.json",
        "video": f"{name}/video.mp4" if video else None,
        "prior": None if prior is None else str(prior.absolute()),
        "reference": f"{name}/reference.npz" if reference else None,
        "offset_s": offset,
        **({"note": note} if note else {}),
    }
