"""What scripts do with markers and videos; every function raises the program's own errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal

from markerscope.solver.api.result import Result
from markerscope.solver.cleaning.clean import Cleaned, CleanSettings
from markerscope.solver.cleaning.clean import clean as clean_recording
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import (
    Convention,
    EvaluateRequest,
    LandmarkPull,
    Method,
    SolveRequest,
    Units,
    Up,
    check_inputs,
)
from markerscope.solver.io.markers_in import load_markers as read_markers
from markerscope.solver.synth.session import SynthSession

FileName = str | Path
_MARKERS = "markers_given.csv"


def load_markers(
    path: FileName,
    *,
    up: Up | None = None,
    units: Units | None = None,
    subject: str | None = None,
    rate: float | None = None,
) -> Markers:
    """Marker trajectories from C3D, TRC, CSV or TSV.

    Parameters
    ----------
    path : the file
    up : its vertical axis, where it does not say or says it wrongly
    units : its unit of length, likewise
    subject : whose markers to take where it holds several people's
    rate : Hz, where it does not say or says it wrongly

    Returns
    -------
    Markers
        ``positions`` (T, M, 3) m, z up, NaN = lost; ``labels``, ``rate``, ``time``; ``notes`` say what was assumed.

    Raises
    ------
    InputError : the file cannot be read or does not say enough
    """
    return read_markers(Path(path), up=up, units=units, subject=subject, rate=rate)


def clean(markers: Markers | FileName, settings: CleanSettings | None = None, progress: Progress = silent) -> Cleaned:
    """Cut outliers, fill gaps, and point out exchanged and broken tracks; measured samples stay as they are.

    Returns
    -------
    Cleaned
        ``markers`` with ``filled`` flags, ``outliers``, ``fills`` each with its expected error in m, ``proposals``.

    Raises
    ------
    InputError : the file cannot be read, or no marker is seen in it
    """
    recording = markers if isinstance(markers, Markers) else load_markers(markers)
    return clean_recording(recording, settings, progress)


def track_video(video: FileName, *, rate: float = 30.0, progress: Progress = silent) -> Landmarks:
    """The person's landmarks in a video, by the pose network that ships.

    Parameters
    ----------
    video : the file
    rate : Hz, as many of its frames are looked at

    Raises
    ------
    InputError : no frame can be decoded
    Cancelled : raised by ``progress``
    """
    from markerscope.solver.video.blazepose import track_pose
    from markerscope.solver.video.flips import mend_flips

    return mend_flips(track_pose(Path(video), rate=rate, progress=progress))[0]


def solve(
    markers: Markers | FileName,
    *,
    video: FileName | None = None,
    prior: FileName | None = None,
    camera: FileName | None = None,
    out: FileName | None = None,
    offset: float | None = None,
    rate_ratio: float | None = None,
    up: Up | None = None,
    units: Units | None = None,
    subject: str | None = None,
    marker_rate: float | None = None,
    time_range: tuple[float | None, float | None] | None = None,
    method: Method | None = None,
    convention: Convention | None = None,
    neutral: tuple[float | None, float | None] | FileName | None = None,
    landmark_pull: LandmarkPull | None = None,
    body: FileName | None = None,
    weights: FileName | None = None,
    seed: int | None = None,
    progress: Progress = silent,
) -> Result:
    """Solve a trial: which marker sits where, a body that fits, its joint angles.

    What was computed before in the same folder is not computed again.

    Parameters
    ----------
    markers : a marker file, a session's folder, or markers in memory
    video : a video of the same movement; without one, ``prior`` is needed
    prior : poses that another program reconstructed from the video
    camera : result folder of another trial of the same session, to take the camera from
    out : folder for the results; where not given, a temporary one that lives as long as the result does
    offset, rate_ratio : s and 1, marker time = rate_ratio * video time + offset; found from the motion where not given
    up, units, subject, marker_rate : what the marker file does not say or says wrongly (Hz for the rate)
    time_range : (start, stop) s of the marker file's clock that is solved, either may be None
    method : "bundle" (default), "paper" or "neural"
    convention : names and signs of the angles
    neutral : what angles are counted from: a span (start, stop) s, the file of a static trial, or "recorded"
    landmark_pull : whether markers are drawn to bony landmarks where their layout has earned it
    body, weights : a user's own SMPL-layout model; weights of a network, for the method "neural"
    seed : of every random choice
    progress : called with the fraction done and what is being done; it may raise ``Cancelled``

    Raises
    ------
    InputError : an input cannot be used; nothing half-written is left
    Cancelled : raised by ``progress``; what was computed until then is kept in ``out``
    """
    from markerscope.solver.commands.solve import solve_session

    temporary = TemporaryDirectory(prefix="markerscope-") if out is None and not _is_session(markers) else None
    folder = Path(temporary.name) if temporary is not None else None if out is None else Path(out)
    try:
        file = _on_disk(markers, folder)
        request = SolveRequest(
            markers=file,
            out=folder,
            video=_path(video),
            prior=_path(prior),
            camera=_path(camera),
            offset=offset,
            rate_ratio=rate_ratio,
            up=up,
            units=units,
            subject=subject,
            marker_rate=marker_rate,
            range=time_range,
            method=method,
            seed=seed,
            body=_path(body),
            weights=_path(weights),
            convention=convention,
            neutral=_neutral(neutral),
            landmark_pull=landmark_pull,
        )
        check_inputs(request)
        done = solve_session(request, progress)
    except BaseException:
        if temporary is not None:
            temporary.cleanup()
        raise
    return replace(Result.open(done.out), _temporary=temporary)


def evaluate(
    result: Result | FileName,
    reference: Result | FileName,
    *,
    body: FileName | None = None,
    progress: Progress = silent,
) -> Mapping[str, Any]:
    """How far a result is from a reference: joint, velocity and skin errors, and each angle's difference.

    Parameters
    ----------
    result, reference : results, their folders, or AMASS-layout npz files
    body : the SMPL-layout model that the reference was made with, if not the result's

    Returns
    -------
    Mapping
        What ``markerscope evaluate --json`` prints: lengths in m, angles in degrees.

    Raises
    ------
    InputError : one of them cannot be read
    """
    from markerscope.solver.evaluate.evaluate import evaluate_result

    ours, theirs = (Path(r.folder if isinstance(r, Result) else r) for r in (result, reference))
    request = EvaluateRequest(ours, theirs, _path(body))
    check_inputs(request)
    return dict(evaluate_result(request, progress).summary)


def simulate(
    motion: FileName = "walk",
    *,
    out: FileName | None = None,
    seed: int = 0,
    progress: Progress = silent,
    **settings: Any,
) -> SynthSession:
    """A synthetic session whose truth is known.

    Parameters
    ----------
    motion : one of the program's own motions ("walk", "squat", ...), or a BVH or AMC file
    out : folder to write it to as files; None writes none
    seed : of every random choice
    settings : fields of ``SynthSettings``: ``frames``, ``rate``, ``markers``, ``part``, ``video_noise``, ...

    Raises
    ------
    InputError : the motion cannot be read, or a setting is not possible
    """
    from markerscope.solver.io.output_folder import check_output_folder
    from markerscope.solver.synth.files import check_free, write_session
    from markerscope.solver.synth.session import SynthSettings, synthesise
    from markerscope.solver.synth.source import read_source

    try:
        chosen = SynthSettings(**settings)
    except TypeError as error:
        raise InputError(str(error), "simulate", "see SynthSettings for what can be set") from error
    if seed < 0:
        raise InputError(f"{seed} is not possible", "seed", "give 0 or a positive whole number")
    if out is not None:
        check_free(Path(out))
        check_output_folder(out)
    progress(0.0, "reading the motion")
    source = read_source(str(motion), skeleton=None, rate=None)
    progress(0.2, "drawing the session")
    session = synthesise(source, chosen, seed)
    if out is not None:
        progress(0.8, "writing")
        write_session(out, session)
    progress(1.0, "done")
    return session


def _is_session(markers: Markers | FileName) -> bool:
    from markerscope.solver.pipeline.session import session_folder

    return not isinstance(markers, Markers) and session_folder(Path(markers)) is not None


def _on_disk(markers: Markers | FileName, folder: Path | None) -> Path:
    """A file that holds the markers; those in memory are written into the session's folder, to 0.1 micrometres."""
    if not isinstance(markers, Markers):
        return Path(markers)
    from markerscope.solver.io.atomic import make_folder
    from markerscope.solver.io.export_csv import write_markers_csv

    assert folder is not None
    make_folder(folder)
    file = folder / _MARKERS
    write_markers_csv(file, markers)
    return file


def _path(name: FileName | None) -> Path | None:
    return None if name is None else Path(name)


def _neutral(
    given: tuple[float | None, float | None] | FileName | None,
) -> tuple[float | None, float | None] | Path | Literal["recorded"] | None:
    if given is None or isinstance(given, tuple):
        return given
    return "recorded" if given == "recorded" else Path(given)
