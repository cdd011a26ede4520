"""One solve from request to output folder: the session made or opened, the stages run, the results written."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Method, SolveOutcome, SolveRequest
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.doubts.doubt import Doubt
from markerscope.solver.fit.pull.results import summary as summary_of_pull
from markerscope.solver.fit.results import Candidate
from markerscope.solver.fit.second.results import LimbAnswer
from markerscope.solver.io.camera import camera_file
from markerscope.solver.io.export_angles import noise_of, standard_error
from markerscope.solver.io.output_folder import remove_if_empty
from markerscope.solver.pipeline.cleaning import BY_FRAME
from markerscope.solver.pipeline.doubts import assumptions, doubts
from markerscope.solver.pipeline.in_force import write_answers
from markerscope.solver.pipeline.look import look_at
from markerscope.solver.pipeline.methods import GRAPHS, graph_of, spelt_out, with_method
from markerscope.solver.pipeline.names import CHECK, CLEAN, ERRORS, FIT, ORIENT, SURFACE, SYNC
from markerscope.solver.pipeline.session import (
    InputFile,
    RunSettings,
    Session,
    load_session,
    save_session,
    session_folder,
)
from markerscope.solver.pipeline.session_file import FILE_NAME, edited_by_hand, require_state, state_of
from markerscope.solver.pipeline.settings import UNSET, overlay, without
from markerscope.solver.pipeline.source import contents
from markerscope.solver.pipeline.stage import GraphRun, OnEvent, ignore, run_graph, stage_keys
from markerscope.solver.pipeline.stages import POSED_BY, SOURCES
from markerscope.solver.report.outputs import FILES, SOMETIMES, write_outputs

_WORTH_KEEPING_S = 5.0
"""Work that took longer than this is kept where a later stage refuses an input: the next attempt begins there."""


def solve_session(request: SolveRequest, progress: Progress = silent, on_event: OnEvent | None = None) -> SolveOutcome:
    """Everything from markers and a video to angles; what is cached is not computed again.

    Parameters
    ----------
    progress : told the fraction done
    on_event : told when a stage begins, ends, fails, or was in the store

    Raises
    ------
    InputError : an input cannot be used; nothing half-written is left
    EditedOutside : somebody has changed the session file meanwhile; results stay, files are not written
    """
    if request.marker_set is not None:
        from markerscope.solver.commands.named import named_first

        request, said = named_first(request, part_of(progress, 0.0, 0.4))
        outcome = solve_session(request, part_of(progress, 0.4, 1.0), on_event)
        return replace(outcome, lines=(*said, *outcome.lines))
    loaded, folder = session_folder(request.markers), _folder(request)
    state = state_of(folder)
    if folder != loaded and edited_by_hand(folder):
        raise InputError(
            "was edited by hand and would be overwritten",
            folder / FILE_NAME,
            f"solve that session itself (markerscope solve {folder}), or choose another folder",
        )
    session = session_of(request)
    if not POSED_BY & set(session.inputs):
        raise InputError(
            "there is neither a video nor a pose prior",
            request.markers,
            "give one with --video or --prior, or a person known from another trial with --known",
        )
    with _tidy(session):
        stages = graph_of(session)
        sources, settings = session.sources(SOURCES), session.stage_settings(stages)
        session = spelt_out(session, contents(sources))
        if not session.store.has("landmarks", stage_keys(stages, sources, settings)["landmarks"]):
            look_at({name: source.value for name, source in sources.items()})  # before the video, which takes long
        graph = run_graph(
            stages, sources, settings, session.store, progress=part_of(progress, 0.0, 0.97), on_event=on_event or ignore
        )
        progress(0.97, "writing results")
        require_state(folder, state, "nothing that was computed is lost; solve again with what it says now")
        not_kept = write_outputs(session, graph)
        _save(session)
        write_answers(session.folder, graph.keys)
    progress(1.0, "done")
    return _outcome(session, graph, not_kept)


def session_of(request: SolveRequest) -> Session:
    """The session that a request makes or opens, with the request's inputs and options laid over its own.

    Raises
    ------
    InputError : a file is not there, or the session cannot be read
    """
    folder = session_folder(request.markers)
    out = None if request.out is None else _folder(request)
    if folder is not None:
        session = load_session(folder)
        session = session if out is None else replace(session, folder=out)
    elif request.markers.is_dir():
        raise InputError(
            "is a folder without a session in it", request.markers, "name a marker file, or a folder that solve wrote"
        )
    elif out is None:
        raise InputError("no folder for the results was named", remedy="add --out DIR")
    else:
        session = _with_input(_again(out, request), "marker_file", request.markers)
    for name in ("video", "prior", "camera", "body", "weights", "known"):
        path = getattr(request, name)
        if path is not None:
            session = _with_input(session, f"{name}_file", camera_file(path) if name == "camera" else path)
    session = _with_options(_with_neutral(session, request), request)
    known = folder or (out and session_folder(out))
    if known is not None:
        before = load_session(known)
        _require_frames(before, session)
        _require_markers(before, session)
    return session


def _require_frames(before: Session, after: Session) -> None:
    """Refuse where edits of tracks, which name frames of the range, would come to mean others."""
    starts = {session.stage_settings(graph_of(session))["markers"].start for session in (before, after)}
    if len(starts) > 1 and {*BY_FRAME} & set(after.edits.get("clean", {})):
        raise InputError(
            "counts frames from the start of the range, which would be another",
            f"{after.folder / FILE_NAME}, edits.clean",
            "keep the start of the range (--range), or take these edits out",
        )


def _require_markers(before: Session, after: Session) -> None:
    """Refuse where edits, which name markers by number, would come to mean others: the file holds something else."""
    known, now = before.inputs.get("marker_file"), after.inputs["marker_file"]
    numbered = [name for name in ("clean", "segment", "localize") if after.edits.get(name)]
    if known is None or not known.digest or known.path != now.path or not numbered or not now.path.exists():
        return
    if after.digests.digest(now.path) != known.digest:
        raise InputError(
            f"has changed since, and edits.{numbered[0]} of {after.folder / FILE_NAME} names its markers by number",
            now.path,
            "take these edits out, or, if the markers are the same ones in the same order, the marker file's sha256",
        )


def _folder(request: SolveRequest) -> Path:
    """Where the session will be."""
    return Path(os.path.abspath(request.out or session_folder(request.markers) or "."))


def _again(out: Path, request: SolveRequest) -> Session:
    """A session made from files: they and the options say everything anew.

    Where this folder has been solved into before, what the user decided by hand on the same marker file is kept.
    """
    method: Method = request.method or RunSettings().method
    run = RunSettings(method=method)
    if session_folder(out) is None:
        return Session(out, run=run)
    before = with_method(load_session(out), method)
    known = before.inputs.get("marker_file")
    same = known is not None and known.path == Path(os.path.abspath(request.markers))
    return Session(out, edits=before.edits if same else {}, run=run)


def _with_input(session: Session, name: str, path: Path) -> Session:
    if not path.exists():
        raise InputError(f"there is no such {name.removesuffix('_file')} file", path, "check the name and the folder")
    if path.is_dir():
        raise InputError(f"is a folder, not a {name.removesuffix('_file')} file", path, "name the file in it")
    path = Path(os.path.abspath(path))
    if path.parent == session.folder and path.name in (*FILES, *SOMETIMES):
        raise InputError("would be overwritten by the results", path, "choose another folder for them")
    return replace(session, inputs={**session.inputs, name: InputFile(path)})


def _with_neutral(session: Session, request: SolveRequest) -> Session:
    """The file of the neutral pose; a span of the trial, or the convention's own zero, takes its place."""
    if request.neutral is None:
        return session
    if isinstance(request.neutral, Path):
        return _with_input(session, "neutral_file", request.neutral)
    return replace(session, inputs={name: file for name, file in session.inputs.items() if name != "neutral_file"})


def _with_options(session: Session, request: SolveRequest) -> Session:
    """The request's options over the session's settings, and over its edits: what is said last counts."""
    session = with_method(session, _method(session, request))
    if request.weights is not None and session.run.method != "neural":
        raise InputError("weights are for --method neural alone", "--weights", "add --method neural, or leave it out")
    settings, edits = dict(session.settings), dict(session.edits)
    options = {**_said(request), **_capped(request, session.run.method), **_drawn(request, session.run.method)}
    for stage, said in options.items():
        settings[stage] = overlay(settings.get(stage, {}), said)
        edits[stage] = without(edits.get(stage, {}), {*said, *said.get(UNSET, ())})
    return replace(
        session,
        settings=settings,
        edits={stage: table for stage, table in edits.items() if table},
        run=session.run if request.seed is None else replace(session.run, seed=request.seed),
    )


def _method(session: Session, request: SolveRequest) -> Method:
    """The method asked for; a known person in a trial without a video is found by a method of its own."""
    if request.method is not None:
        method = request.method
    elif "known_file" in session.inputs and not {"video_file", "prior_file"} & set(session.inputs):
        method = "known"
    else:
        method = RunSettings().method if session.run.method == "known" else session.run.method
    if method == "known" and "known_file" not in session.inputs:
        raise InputError("no known person is named", "--method known", "add --known person.npz")
    if request.markers_moved is not None and method != "known":
        raise InputError(
            "is for a known person without a video alone", "--markers-moved", "add --known person.npz, or leave it out"
        )
    return method


def _said(request: SolveRequest) -> dict[str, dict[str, Any]]:
    """The options of a request as tables of settings; what it does not say is not in them."""
    options: dict[str, dict[str, Any]] = {
        "markers": {
            "up": request.up,
            "units": request.units,
            "subject": request.subject,
            "rate": request.marker_rate,
        },
        "sync": {"offset": request.offset, "rate_ratio": request.rate_ratio},
        **({} if request.markers_moved is None else {"orient": {"markers_moved": request.markers_moved}}),
        **({} if request.part_of_cloud is None else {"localize": {"part_of_cloud": request.part_of_cloud}}),
        "angles": {"convention": request.convention},
        "errors": {"columns": request.standard_errors},
    }
    said = {
        stage: {name: value for name, value in table.items() if value is not None} for stage, table in options.items()
    }
    if request.range is not None:  # says both ends: one that is left out is open
        ends = dict(zip(("start", "stop"), request.range))
        said["markers"] |= {name: end for name, end in ends.items() if end is not None}
        said["markers"][UNSET] = [name for name, end in ends.items() if end is None]
    if request.neutral is not None:
        span = request.neutral if isinstance(request.neutral, tuple) else (None, None)
        ends = dict(zip(("start", "stop"), span))
        said["neutral"] = {name: end for name, end in ends.items() if end is not None}
        said["neutral"][UNSET] = [name for name, end in ends.items() if end is None]
    return {stage: table for stage, table in said.items() if table}


def _capped(request: SolveRequest, method: Method) -> dict[str, dict[str, Any]]:
    """The cap on iterations, for every stage that has one."""
    if request.iterations is None:
        return {}
    capped = [stage.name for stage in GRAPHS[method] if hasattr(stage.settings, "iterations")]
    if not capped:
        raise InputError(f"method {method} has no such cap", "--iterations", "leave it out, or use --method paper")
    return {name: {"iterations": request.iterations} for name in capped}


def _drawn(request: SolveRequest, method: Method) -> dict[str, dict[str, Any]]:
    """Whether markers are drawn to bony landmarks, where the method can."""
    if request.landmark_pull is None:
        return {}
    fit = next(stage for stage in GRAPHS[method] if stage.name == "fit")
    if not hasattr(fit.settings, "landmark_pull"):
        raise InputError(f"method {method} draws no markers to landmarks", "--landmark-pull", "leave it out")
    return {"fit": {"landmark_pull": request.landmark_pull}}


def _save(session: Session) -> None:
    """Save the session, unless its file says the same already."""
    if session_folder(session.folder) is None or load_session(session.folder) != session:
        save_session(session)


@contextmanager
def _tidy(session: Session) -> Iterator[None]:
    """Where an input is refused, leave the folder as it was, but for work worth keeping."""
    store = session.store
    new_folder, new_store = not session.folder.exists(), not store.root.exists()
    try:
        yield
    except InputError:
        seconds = sum(float(entry.about.get("seconds", 0)) for entry in store.list())
        if new_store and seconds < _WORTH_KEEPING_S:
            shutil.rmtree(store.root, ignore_errors=True)
            if new_folder:
                remove_if_empty(session.folder)
        raise


def _outcome(session: Session, graph: GraphRun, not_kept: tuple[str, ...] = ()) -> SolveOutcome:
    motion, ranked, sync, surface = graph[FIT], graph[ORIENT], graph[SYNC], graph[SURFACE]
    markers, found, errors = graph[CLEAN].markers, graph[CHECK], graph[ERRORS]
    best = ranked.candidates[motion.chosen]
    summary = {
        "out": str(session.folder),
        "seconds": {name: round(event.seconds, 3) for name, event in graph.events.items()},
        "computed": list(graph.computed),
        "method": session.run.method,
        "frames": len(motion.time),
        "markers": len(markers.labels),
        "part": best.part,
        "energies": dict(best.energies),
        "energy": best.energy,
        "margin": ranked.margin if np.isfinite(ranked.margin) else None,
        "confidence": found.confidence,
        "runner_up": None if ranked.runner_up < 0 else _brief(ranked.candidates[ranked.runner_up]),
        "alternatives": [_brief(candidate) for candidate in ranked.candidates if candidate.refined],
        "sync": {"offset_s": sync.offset, "rate_ratio": sync.rate_ratio, "confidence": sync.confidence},
        "m2s_mm": 1000 * surface.mean,
        "residual_median_mm": float(1000 * np.nanmedian(motion.residual)),
        "standard_errors_deg": None if errors is None else {n: standard_error(errors, n) for n in errors.names},
        "noise": None if errors is None else noise_of(errors),
        "doubts": [_doubt(doubt, markers.labels) for doubt in found.doubts],
        "nobodys_markers": [markers.labels[m] for m in found.nobody],
        "suspect_markers": [markers.labels[m] for m in found.suspect],
        "second_answers": [_second(answer) for answer in motion.second],
        "landmark_pull": None if motion.pull is None else summary_of_pull(motion.pull, markers.labels),
    }
    said, doubted = (*assumptions(graph), *not_kept), doubts(graph)
    lines = (
        *(f"{name}: {event.text}." for name, event in graph.events.items() if event.text),
        *(f"Note: {note}" for note in said),
        f"Results are in {session.folder}.",
    )
    summary |= {"notes": list(said), "warnings": list(doubted)}
    return SolveOutcome(summary=summary, lines=lines, warnings=doubted, out=session.folder)


def _doubt(doubt: Doubt, labels: tuple[str, ...]) -> dict[str, Any]:
    """A doubt in plain JSON values."""
    return {
        "kind": doubt.kind,
        "sentence": doubt.sentence,
        "markers": [labels[m] for m in doubt.markers],
        "value": doubt.value if np.isfinite(doubt.value) else None,
        "limit": doubt.limit if np.isfinite(doubt.limit) else None,
    }


def _second(answer: LimbAnswer) -> dict[str, Any]:
    """Another answer for a limb in plain JSON values."""
    return {
        "limb": answer.limb,
        "joint": JOINTS[answer.joint],
        "joint_apart_mm": 1000 * answer.apart,
        "turn_deg": answer.turn_deg,
        "confidence_in_the_first": answer.confidence,
        "chosen": answer.chosen,
    }


def _brief(candidate: Candidate) -> dict[str, Any]:
    return {"part": candidate.part, "heading_deg": candidate.heading_deg, "energy": candidate.energy}
