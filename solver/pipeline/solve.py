"""One solve from request to output folder: the session made or opened, the stages run, the results written."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from solver.errors import InputError
from solver.io.camera import camera_file
from solver.pipeline.request import SolveOutcome, SolveRequest
from solver.pipeline.session import InputFile, Session, load_session, save_session, session_folder
from solver.pipeline.stage import GraphRun, run_graph, stage_keys
from solver.pipeline.stages import GRAPH, SOURCES
from solver.progress import Progress, part_of


def solve_session(request: SolveRequest, progress: Progress) -> SolveOutcome:
    """Everything from markers and a video to angles; what is cached is not computed again.

    Raises
    ------
    InputError : an input cannot be used; nothing half-written is left
    """
    session = session_of(request)
    sources = session.sources(SOURCES)
    if sources["video_file"].value is None and sources["prior_file"].value is None:
        raise InputError(
            "there is neither a video nor a pose prior", request.markers, "give one with --video or --prior"
        )
    settings = session.stage_settings(GRAPH)
    graph = run_graph(GRAPH, sources, settings, session.store, progress=part_of(progress, 0.0, 0.97))
    session = replace(
        session,
        inputs={name: replace(file, digest=sources[name].digest) for name, file in session.inputs.items()},
    ).with_settings(settings)
    save_session(session)
    progress(0.97, "writing results")
    from solver.outputs import write_outputs

    write_outputs(session, graph)
    progress(1.0, "done")
    return _outcome(session, graph)


def session_of(request: SolveRequest) -> Session:
    """The session that a request makes or opens, with the request's options laid over its settings."""
    folder = session_folder(request.markers)
    if folder is not None:
        session = load_session(folder)
        if request.out is not None:
            session = replace(session, folder=Path(request.out).absolute())
    else:
        assert request.out is not None
        out = Path(request.out).absolute()
        # The command line says everything again; what the user decided by hand in this folder is kept.
        edits = _edits_for(load_session(out), request) if session_folder(out) is not None else {}
        session = _with_input(Session(out, edits=edits), "marker_file", request.markers)
    for name, path in (
        ("video_file", request.video),
        ("prior_file", request.prior),
        ("camera_file", None if request.camera is None else camera_file(request.camera)),
        ("body_file", request.body),
    ):
        if path is not None:
            session = _with_input(session, name, path)
    return _with_options(session, request)


def _edits_for(session: Session, request: SolveRequest) -> Mapping[str, Mapping[str, Any]]:
    """Decisions by hand belong to the marker file they were made on."""
    before = session.inputs.get("marker_file")
    same = before is not None and before.path.absolute() == Path(request.markers).absolute()
    return session.edits if same else {}


def _with_input(session: Session, name: str, path: Path) -> Session:
    return replace(session, inputs={**session.inputs, name: InputFile(Path(path).absolute())})


def _with_options(session: Session, request: SolveRequest) -> Session:
    """The request's options over the session's settings."""
    start, stop = request.range or (None, None)
    options: dict[str, dict[str, Any]] = {
        "markers": {
            "up": request.up,
            "units": request.units,
            "subject": request.subject,
            "rate": request.marker_rate,
            "start": start,
            "stop": stop,
        },
        "sync": {"offset": request.offset, "rate_ratio": request.rate_ratio},
        "angles": {"convention": request.convention},
    }
    settings = {name: dict(table) for name, table in session.settings.items()}
    for stage, table in options.items():
        chosen = {name: value for name, value in table.items() if value is not None}
        if chosen:
            merged = {**settings.get(stage, {}), **chosen}
            unset = [name for name in merged.get("unset", []) if name not in chosen]
            settings[stage] = {k: v for k, v in merged.items() if k != "unset"} | ({"unset": unset} if unset else {})
    return replace(session, settings=settings)


def current_keys(session: Session) -> dict[str, str]:
    """Key of every stage as the session stands."""
    return stage_keys(GRAPH, session.sources(SOURCES), session.stage_settings(GRAPH))


def _outcome(session: Session, graph: GraphRun) -> SolveOutcome:
    motion, ranked, sync, surface = graph["fit"], graph["orient"], graph["sync"], graph["surface"]
    markers = graph["markers"]
    best = ranked.candidates[motion.chosen]
    seconds = {name: round(event.seconds, 3) for name, event in graph.events.items()}
    summary = {
        "out": str(session.folder),
        "seconds": seconds,
        "computed": list(graph.computed),
        "frames": len(motion.time),
        "markers": len(markers.labels),
        "part": best.part,
        "energies": dict(best.energies),
        "energy": best.energy,
        "margin": ranked.margin if np.isfinite(ranked.margin) else None,
        "confidence": motion.confidence,
        "alternatives": [
            {"part": c.part, "heading_deg": c.heading_deg, "energy": c.energy} for c in ranked.candidates if c.refined
        ],
        "sync": {"offset_s": sync.offset, "rate_ratio": sync.rate_ratio, "confidence": sync.confidence},
        "m2s_mm": 1000 * surface.mean,
        "residual_median_mm": float(1000 * np.nanmedian(motion.residual)),
    }
    lines = [f"{name}: {graph.events[name].text}." for name in graph.events if graph.events[name].text]
    lines.append(f"Results are in {session.folder}.")
    warnings = (*markers.notes, *sync.notes, *graph["prior"].notes, *motion.warnings)
    return SolveOutcome(summary=summary, lines=tuple(lines), warnings=tuple(warnings), out=session.folder)
