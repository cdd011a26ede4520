"""How far a result is from a reference: another result, or a motion in AMASS layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from solver import metrics
from solver.body.model import Body
from solver.body.skeleton import JOINTS
from solver.errors import InputError
from solver.io.motion_in import MOTION, MotionFile, read_motion
from solver.markers import Markers
from solver.pipeline.request import EvaluateRequest, Outcome
from solver.progress import Progress, part_of, silent

_MOST_MESHES = 100
"""Frames, evenly spread, in which whole surfaces are compared."""
_MARKERS = "markers_labelled.c3d"


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A result against a reference, over the time both cover.

    Attributes
    ----------
    time : (T,) s, the frames of the result that were compared
    mpjpe : joint position errors, m
    pa_mpjpe : the same once each frame is turned, shifted and scaled onto the reference, m
    mpjve : joint velocity errors, m/s
    v2v : vertex errors in up to 100 frames, m; None where the two bodies have different meshes
    m2s, m2s_reference : m, mean distance of the measured markers to either body's surface; NaN without markers
    angles : by name, rad
    notes : what was assumed, one sentence each
    """

    time: np.ndarray
    mpjpe: metrics.PointErrors
    pa_mpjpe: metrics.PointErrors
    mpjve: metrics.PointErrors
    v2v: metrics.PointErrors | None
    m2s: float
    m2s_reference: float
    angles: Mapping[str, metrics.AngleDifference]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Posed:
    """A motion on its body, on the clock of the comparison.

    Attributes
    ----------
    body : with as many shape coefficients as ``betas``
    betas : (S,)
    time : (T,) s
    rotations, trans : pose of each frame
    joints : (T, 24, 3) m
    """

    body: Body
    betas: np.ndarray
    time: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    joints: np.ndarray

    def at(self, time: np.ndarray) -> Posed:
        """The motion at other times: joints and places linear between frames, rotations by slerp, NaN outside."""
        return replace(
            self,
            time=time,
            rotations=metrics.rotations_at(self.time, self.rotations, time),
            trans=metrics.points_at(self.time, self.trans, time),
            joints=metrics.points_at(self.time, self.joints, time),
        )

    def vertices(self, frames: np.ndarray) -> np.ndarray:
        """(n, V, 3) m."""
        mesh: np.ndarray = self.body.pose(self.rotations[frames], self.betas, self.trans[frames])[0]
        return mesh


def evaluate_result(request: EvaluateRequest, progress: Progress = silent) -> Outcome:
    """What ``markerscope evaluate`` prints."""
    found = evaluate(request.result, request.reference, body=request.body, progress=progress)
    return Outcome(summary=summary_of(found), lines=lines_of(found), warnings=found.notes)


def evaluate(
    result: str | Path, reference: str | Path, *, body: str | Path | None = None, progress: Progress = silent
) -> Evaluation:
    """Compare a result with a reference.

    Parameters
    ----------
    result : folder that a solve wrote, or its ``motion.npz``
    reference : another result, or an npz in AMASS layout in the same world frame (z up)
    body : the SMPL model file that the reference was made with, where it is not a result
    progress : called along the way

    Raises
    ------
    InputError
        Where either cannot be read, or they do not overlap in time.
    """
    found, other = read_motion(result), read_motion(reference)
    clock, clock_notes = _clock(found, other)
    own_body, other_body = _body_of(result), Path(body) if body else _body_of(reference)
    bodies = {path: _load_body(path) for path in {own_body, other_body}}
    ours, notes = posed(found, _times(found), bodies[own_body], known=own_body is not None)
    theirs, other_notes = posed(other, clock, bodies[other_body], known=other_body is not None)
    if body is None:
        theirs = _on_true_body(theirs, other.source)
    return compare(ours, theirs, measured_markers(result), other.source, (*clock_notes, *notes, *other_notes), progress)


def _on_true_body(reference: Posed, source: str) -> Posed:
    """The reference of a synthetic session on the body that it was made with, which no shape coefficients reach."""
    from solver.synth.files import REFERENCE
    from solver.synth.truth import TRUTH, load_truth

    beside = Path(source).with_name(TRUTH)
    if Path(source).name != REFERENCE or not beside.is_file():
        return reference
    truth = load_truth(beside)
    if len(truth.motion.trans) != len(reference.time):
        return reference
    return Posed(truth.body, truth.betas, reference.time, truth.motion.rotations, truth.motion.trans, truth.joints)


def compare(
    ours: Posed,
    theirs: Posed,
    markers: Markers | None,
    source: str,
    notes: tuple[str, ...] = (),
    progress: Progress = silent,
) -> Evaluation:
    """Compare a motion with a reference on the same clock.

    Parameters
    ----------
    markers : what was measured, None where it is not at hand
    source : what to call the reference in messages
    notes : what was assumed so far
    """
    inside = (ours.time >= theirs.time[0] - 1e-9) & (ours.time <= theirs.time[-1] + 1e-9)
    if inside.sum() < 2:
        a, b, c, d = (f"{t:.2f}" for t in (ours.time[0], ours.time[-1], theirs.time[0], theirs.time[-1]))
        raise InputError(
            f"it covers {c} to {d} s and the result {a} to {b} s, so they do not overlap",
            source,
            "compare recordings of the same trial on one clock",
        )
    ours = ours.at(ours.time[inside])
    theirs = theirs.at(ours.time)
    progress(0.1, "comparing joints and angles")
    frames = np.unique(np.linspace(0, len(ours.time) - 1, min(_MOST_MESHES, len(ours.time))).round().astype(int))
    surface = None
    if len(ours.body.template) == len(theirs.body.template):
        surface = metrics.v2v(ours.vertices(frames), theirs.vertices(frames))
    m2s = [
        _to_surface(markers, motion, frames, part_of(progress, 0.3 + 0.35 * i, 0.65 + 0.35 * i))
        for i, motion in enumerate((ours, theirs))
    ]
    return Evaluation(
        time=ours.time,
        mpjpe=metrics.mpjpe(ours.joints, theirs.joints),
        pa_mpjpe=metrics.pa_mpjpe(ours.joints, theirs.joints),
        mpjve=metrics.mpjve(ours.joints, theirs.joints, ours.time),
        v2v=surface,
        m2s=m2s[0],
        m2s_reference=m2s[1],
        angles=_angles(ours, theirs),
        notes=notes,
    )


def _times(motion: MotionFile) -> np.ndarray:
    return np.arange(len(motion.rotations)) / motion.rate if motion.time is None else motion.time


def _clock(found: MotionFile, other: MotionFile) -> tuple[np.ndarray, tuple[str, ...]]:
    """The reference's times; a file that has none is taken to start with the result."""
    if other.time is not None:
        return other.time, ()
    start = float(_times(found)[0])
    note = f"{Path(other.source).name} has no times of its own and is taken to start with the result, at {start:.2f} s."
    return start + _times(other), (note,)


def _body_of(path: str | Path) -> Path | None:
    """The user's body that a result was solved with; None is the embedded one."""
    from solver.pipeline.session import load_session, session_folder

    folder = session_folder(Path(path).parent if Path(path).name == MOTION else path)
    if folder is None:
        return None
    file = load_session(folder).inputs.get("body_file")
    return None if file is None else Path(file.path)


def _load_body(path: Path | None) -> Body:
    from solver.body.bones import with_bone_lengths

    return with_bone_lengths(Body.load(path))


def posed(motion: MotionFile, time: np.ndarray, body: Body, *, known: bool) -> tuple[Posed, tuple[str, ...]]:
    """The motion on ``body``, which is ``known`` to be its own or only taken to be."""
    betas = np.zeros(body.shape_count)
    own = min(len(motion.betas), body.betas_count)
    betas[:own] = motion.betas[:own]
    if len(motion.bone_lengths) == body.shape_count - body.betas_count:
        betas[body.betas_count :] = motion.bone_lengths
    joints = motion.joints
    notes: tuple[str, ...] = ()
    if joints is None:
        _, joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)
        if not known:
            name = Path(motion.source).name
            notes = (f"{name} names no joints; its shape is taken to be that of the embedded body (else give --body).",)
    return Posed(body, betas, time, motion.rotations, motion.trans, joints), notes


def measured_markers(result: str | Path) -> Markers | None:
    """The markers that the result was solved from, what was filled in left out; None where they are not at hand."""
    from solver.io.markers_in import load_markers

    folder = Path(result) if Path(result).is_dir() else Path(result).parent
    if not (folder / _MARKERS).is_file():
        return None
    markers = load_markers(folder / _MARKERS)
    if markers.filled is None:
        return markers
    return replace(markers, positions=np.where(markers.filled[..., None], np.nan, markers.positions))


def _to_surface(markers: Markers | None, motion: Posed, frames: np.ndarray, progress: Progress) -> float:
    if markers is None or len(markers.positions) < 2:
        return float("nan")
    positions = metrics.points_at(markers.time, markers.positions, motion.time[frames])
    distance = metrics.marker_to_surface(
        positions, lambda chunk: motion.vertices(frames[chunk]), motion.body.faces, progress=progress
    )
    return metrics.nanmean(distance)


def _angles(ours: Posed, theirs: Posed) -> dict[str, metrics.AngleDifference]:
    """Both sides' angles by the same definition, each on its own body's landmarks."""
    from solver.angles import AngleSettings, joint_angles

    tables = []
    for motion in (ours, theirs):
        found = joint_angles(
            motion.time,
            motion.rotations,
            motion.body.landmarks(motion.betas),
            motion.body.joints(motion.betas),
            AngleSettings(),
        )
        values = np.radians(np.where(found.singular, np.nan, found.degrees))
        tables.append(dict(zip(found.names, values.T, strict=True)))
    return {name: metrics.angle_difference(tables[0][name], tables[1][name]) for name in tables[0]}


def summary_of(found: Evaluation) -> dict[str, object]:
    """Plain values for machines, millimetres and degrees."""
    return {
        "frames": len(found.time),
        "mpjpe_mm": 1000 * found.mpjpe.mean,
        "pa_mpjpe_mm": 1000 * found.pa_mpjpe.mean,
        "mpjve_mm_s": 1000 * found.mpjve.mean,
        "v2v_mm": None if found.v2v is None else 1000 * found.v2v.mean,
        "m2s_mm": 1000 * found.m2s,
        "m2s_reference_mm": 1000 * found.m2s_reference,
        "joints_mm": {name: 1000 * float(e) for name, e in zip(JOINTS, found.mpjpe.per_point, strict=True)},
        "angles_deg": {
            name: {
                "rmse": float(np.degrees(a.rmse)),
                "rmse_less_offset": float(np.degrees(a.rmse_less_offset)),
                "offset": float(np.degrees(a.offset)),
                "share": a.share,
            }
            for name, a in found.angles.items()
        },
    }


def lines_of(found: Evaluation) -> tuple[str, ...]:
    """The same for a person."""
    mm = 1000
    worst = int(np.argmax(np.nan_to_num(found.mpjpe.per_point)))
    lines = [
        f"{len(found.time)} frames compared, {found.time[0]:.2f} to {found.time[-1]:.2f} s.",
        f"Joints (MPJPE): {mm * found.mpjpe.mean:.1f} mm, {mm * found.pa_mpjpe.mean:.1f} mm once aligned; "
        f"worst is {JOINTS[worst]} with {mm * found.mpjpe.per_point[worst]:.1f} mm.",
        f"Joint velocities (MPJVE): {mm * found.mpjve.mean:.1f} mm/s.",
    ]
    if found.v2v is not None:
        lines.append(f"Surface (V2V): {mm * found.v2v.mean:.1f} mm.")
    if np.isfinite(found.m2s):
        lines.append(f"Markers to surface (m2s): {mm * found.m2s:.1f} mm, reference {mm * found.m2s_reference:.1f} mm.")
    for name, a in found.angles.items():
        if np.isfinite(a.rmse):
            rmse, less = np.degrees(a.rmse), np.degrees(a.rmse_less_offset)
            lines.append(f"{name}: {rmse:.1f} degrees RMSE, {less:.1f} less offset.")
    return tuple(lines)
