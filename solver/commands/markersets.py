"""What ``markerscope markerset`` does: sets listed, shown, and learnt from a labelled trial."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from pathlib import Path

from markerscope.solver.body.bones import load_body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Outcome, SolveOutcome, SolveRequest
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.solver.markerset.by_names import pose_by_names
from markerscope.solver.markerset.file import text_of, write_marker_set
from markerscope.solver.markerset.learn import learn_from_motion, learn_from_pose
from markerscope.solver.markerset.marker_set import MarkerSet
from markerscope.solver.markerset.request import LearnRequest
from markerscope.solver.markerset.shipped import marker_set_of, shipped, shipped_names
from markerscope.solver.pipeline.names import FIT, MARKERS
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import load_session, session_folder

Solve = Callable[[SolveRequest, Progress], SolveOutcome]


def list_marker_sets() -> Outcome:
    """What ships."""
    sets = [shipped(name) for name in shipped_names()]
    lines = tuple(f"{one.name}: {len(one.markers)} markers. {one.source}." for one in sets)
    return Outcome(
        summary={"marker_sets": [{"name": s.name, "markers": len(s.markers), "source": s.source} for s in sets]},
        lines=lines,
    )


def show_marker_set(named: str) -> Outcome:
    """One set, as its file says it."""
    one = marker_set_of(named)
    rows = [
        {
            "name": m.name,
            "bone": BONES[JOINTS[m.bone]],
            "place_mm": [round(1000 * v, 1) for v in m.place],
            "spread_mm": round(1000 * m.spread, 1),
            "plate": m.plate,
            "landmark": m.landmark,
        }
        for m in one.markers
    ]
    about = {"name": one.name, "origin": one.origin, "source": one.source, "notes": list(one.notes), "markers": rows}
    return Outcome(summary=about, lines=tuple(text_of(one).rstrip().splitlines()))


def learn_marker_set(request: LearnRequest, progress: Progress = silent) -> Outcome:
    """Learn a set and write it.

    Raises
    ------
    InputError : the trial cannot be read or fitted, or the file not be written
    """
    from markerscope.solver.io.output_folder import check_output_folder

    if not request.markers.exists():
        raise InputError("there is no such file", request.markers, "check the name and the folder")
    check_output_folder(request.out.parent)
    learnt, how = _learnt(request, progress)
    write_marker_set(request.out, learnt)
    plates = sorted({marker.plate for marker in learnt.markers if marker.plate})
    lines = (
        f"{len(learnt.markers)} names were learnt, {how}.",
        *((f"Markers that move as a rigid plate: {len(plates)} plates.",) if plates else ()),
        *(f"Note: {note}" for note in learnt.notes),
        f"Written to {request.out}.",
    )
    summary = {
        "out": str(request.out),
        "name": learnt.name,
        "markers": len(learnt.markers),
        "plates": len(plates),
        "how": how,
        "notes": list(learnt.notes),
    }
    return Outcome(summary=summary, lines=lines)


def _learnt(request: LearnRequest, progress: Progress) -> tuple[MarkerSet, str]:
    """The set, and what told where the body is."""
    from markerscope.solver.io import load_markers

    folder = session_folder(request.markers)
    if folder is not None:
        name = request.name or folder.name
        return _from_session(folder, name, progress), "from the solved session"
    if request.markers.is_dir():
        raise InputError("is a folder without a session in it", request.markers, "name a labelled marker file")
    name = request.name or request.markers.stem
    if request.video is not None or request.prior is not None:
        from markerscope.solver.commands.solve import solve_session

        with tempfile.TemporaryDirectory(prefix="markerscope-") as work:
            solve_session(
                SolveRequest(
                    markers=request.markers, out=Path(work), video=request.video, prior=request.prior, up=request.up,
                    units=request.units, subject=request.subject, marker_rate=request.marker_rate, range=request.range,
                ),
                part_of(progress, 0.0, 0.9),
            )  # fmt: skip
            learnt = _from_session(Path(work), name, silent)
        return learnt, "from the trial solved with its video or prior"
    markers = load_markers(
        request.markers, up=request.up, units=request.units, subject=request.subject, rate=request.marker_rate
    ).between(*(request.range or (None, None)))
    body = load_body()
    found = pose_by_names(body, markers, part_of(progress, 0.0, 0.9))
    learnt = learn_from_pose(body, markers, found.pose, name, request.markers.name, found.notes)
    return learnt, f"the body found by {found.used} names that the shipped set {found.known} has too"


def _from_session(folder: Path, name: str, progress: Progress) -> MarkerSet:
    """The set of a session's own solve."""
    session = load_session(folder)
    if "body_file" in session.inputs:
        raise InputError(
            "was solved with a body of its own, and marker sets lie on the embedded one",
            folder,
            "solve it once without --body",
        )
    run = run_stages(session, (FIT, MARKERS), progress)
    return learn_from_motion(load_body(), run[MARKERS], run[FIT], name, session.inputs["marker_file"].path.name)
