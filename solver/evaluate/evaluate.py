"""How far a result is from a reference: another result, or a motion in AMASS layout."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.core import metrics
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import EvaluateRequest, Outcome
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.evaluate.posed import Posed, angles_of, body_of, measured_markers, posed, times_of
from markerscope.solver.io.motion_in import MotionFile, read_motion

__all__ = [
    "Evaluation",
    "Posed",
    "compare",
    "evaluate",
    "evaluate_result",
    "lines_of",
    "measured_markers",
    "posed",
    "summary_of",
]

_MOST_MESHES = 100
"""Frames, evenly spread, in which whole surfaces are compared."""


@dataclass(frozen=True, eq=False)
class Evaluation:
    """A result against a reference, over the time both cover.

    Attributes
    ----------
    time : (T,) s, the frames of the result that were compared
    mpjpe : joint position errors, m
    pa_mpjpe : the same once each frame is turned, shifted and scaled onto the reference, m
    mpjve : joint velocity errors, m/s
    v2v : vertex errors in some frames, by default up to 100, m; None where the two bodies have different meshes
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


def evaluate_result(request: EvaluateRequest, progress: Progress = silent) -> Outcome:
    """What ``markerscope evaluate`` prints."""
    from markerscope.solver.evaluate.evaluate_angles import evaluate_angles, is_angle_table

    if is_angle_table(request.result) or is_angle_table(request.reference):
        compared = evaluate_angles(request.result, request.reference, body=request.body)
        return Outcome(summary=compared.summary(), lines=compared.lines(), warnings=compared.notes)
    found = evaluate(request.result, request.reference, body=request.body, progress=progress)
    return Outcome(summary=summary_of(found), lines=lines_of(found), warnings=found.notes)


def evaluate(
    result: str | Path, reference: str | Path, *, body: str | Path | None = None, progress: Progress = silent
) -> Evaluation:
    """Compare a result with a reference.

    Parameters
    ----------
    result : folder that a solve wrote, its ``motion.npz``, or what a reference may be
    reference : another result, an npz in AMASS layout or a ``*_stageii.pkl``, in the same world frame (z up)
    body : the SMPL model file that the reference was made with, where it is not a result
    progress : called along the way

    Raises
    ------
    InputError
        Where either cannot be read, or they do not overlap in time.
    """
    found, other = read_motion(result), read_motion(reference)
    our_clock, clock, clock_notes = _clocks(found, other)
    own_body, other_body = body_of(result), Path(body) if body else body_of(reference)
    bodies = {path: load_body(path) for path in {own_body, other_body}}
    ours, notes = posed(found, our_clock, bodies[own_body], known=own_body is not None)
    theirs, other_notes = posed(other, clock, bodies[other_body], known=other_body is not None)
    if body is None:
        theirs = _on_true_body(theirs, other.source)
    return compare(ours, theirs, measured_markers(result), other.source, (*clock_notes, *notes, *other_notes), progress)


def _on_true_body(reference: Posed, source: str) -> Posed:
    """The reference of a synthetic session on the body that it was made with, which no shape coefficients reach."""
    from markerscope.solver.synth.files import REFERENCE
    from markerscope.solver.synth.truth import TRUTH, load_truth

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
    meshes: int = _MOST_MESHES,
) -> Evaluation:
    """Compare a motion with a reference on the same clock.

    Parameters
    ----------
    markers : what was measured, None where it is not at hand
    source : what to call the reference in messages
    notes : what was assumed so far
    meshes : frames, evenly spread, in which whole surfaces are compared
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
    frames = np.unique(np.linspace(0, len(ours.time) - 1, min(meshes, len(ours.time))).round().astype(int))
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


def _clocks(found: MotionFile, other: MotionFile) -> tuple[np.ndarray, np.ndarray, tuple[str, ...]]:
    """The times of both; a file that has none is taken to start with the one that has."""
    ours, theirs = times_of(found), times_of(other)
    if found.time is not None and other.time is not None:
        return ours, theirs, ()
    start = float((ours if other.time is None else theirs)[0])
    late, beside = (other, "result") if other.time is None else (found, "reference")
    shifted = start + times_of(late)
    name = Path(late.source).name
    note = f"{name} has no times of its own and is taken to start with the {beside}, at {start:.2f} s."
    return (ours, shifted, (note,)) if late is other else (shifted, theirs, (note,))


def _to_surface(markers: Markers | None, motion: Posed, frames: np.ndarray, progress: Progress) -> float:
    if markers is None or len(markers.positions) < 2:
        return float("nan")
    positions = metrics.points_at(markers.time, markers.positions, motion.time[frames])
    distance = metrics.marker_to_surface(
        positions, lambda chunk: motion.vertices(frames[chunk]), motion.body.faces, progress=progress
    )
    return metrics.nanmean(distance)


def _angles(ours: Posed, theirs: Posed) -> dict[str, metrics.AngleDifference]:
    """Both sides' angles by the same definition."""
    found, reference = angles_of(ours), angles_of(theirs)
    return {name: metrics.angle_difference(found[name], reference[name]) for name in found}


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
        "angles_deg": angles_in_degrees(found.angles),
    }


def angles_in_degrees(angles: Mapping[str, metrics.AngleDifference]) -> dict[str, dict[str, float]]:
    """Plain values of compared angles."""
    return {
        name: {
            "rmse": float(np.degrees(a.rmse)),
            "rmse_less_offset": float(np.degrees(a.rmse_less_offset)),
            "offset": float(np.degrees(a.offset)),
            "share": a.share,
        }
        for name, a in angles.items()
    }


def angle_lines(angles: Mapping[str, metrics.AngleDifference]) -> tuple[str, ...]:
    """The same for a person; angles that could not be compared are passed over."""
    return tuple(
        f"{name}: {np.degrees(a.rmse):.1f} degrees RMSE, {np.degrees(a.rmse_less_offset):.1f} less offset."
        for name, a in angles.items()
        if np.isfinite(a.rmse)
    )


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
    return (*lines, *angle_lines(found.angles))
