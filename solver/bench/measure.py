"""How far one answer is from the truth, as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from markerscope.solver.bench.methods import Alternative, Solved
from markerscope.solver.body.model import Body
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS, PARTS
from markerscope.solver.evaluate.evaluate import Evaluation, Posed, compare
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.synth.session import SynthSession

RIGHT_SHARE = 0.8
"""Part of the markers that must sit on the right part."""
RIGHT_HEADING_DEG = 45.0
_MESHES = 30

_REGION = np.array(
    [
        next((k + 1 for k, s in enumerate(("left", "right")) if name.startswith(s)), 0)
        + (2 if name.split("_")[-1] in ("hip", "knee", "ankle", "foot") else 0)
        for name in JOINTS
    ]
)
"""(24,) trunk 0, left arm 1, right arm 2, left leg 3, right leg 4."""


def measure(session: SynthSession, solved: Solved) -> dict[str, Any]:
    """All figures of an answer."""
    truth = session.truth
    part = session.settings.part
    motion = solved.motion
    figures = errors(session, motion, solved.body)
    region = right_part(motion.marker_joint, truth.marker_joint, part)
    heading = heading_error_deg(motion.rotations[:, 0], truth.motion.rotations[:, 0])
    right = region and heading < RIGHT_HEADING_DEG
    return figures | {
        "right_part": region,
        "right_yaw": heading < RIGHT_HEADING_DEG,
        "right": right,
        "right_bones": near_bones(motion.marker_joint, truth.marker_joint),
        "heading_error_deg": heading,
        "confidence": float(motion.confidence),
        "warnings": list(motion.warnings),
        "ambiguous": bool(motion.warnings),
        "named": right or any(_is_right(other, session) for other in solved.alternatives),
        "alternatives": len(solved.alternatives),
        "sync_error_s": float(solved.offset - truth.offset),
        "seconds": dict(solved.seconds),
        "info": dict(solved.info),
    }


def errors(session: SynthSession, motion: FittedMotion, body: Body) -> dict[str, float | None]:
    """Distances from the truth, mm and mm/s; those of the marked part beside those of the whole body."""
    found = Posed(body, motion.betas, motion.time, motion.rotations, motion.trans, motion.joints)
    compared = compare(found, true_motion(session), real_markers(session), "the session", meshes=_MESHES)
    part = session.settings.part
    joints = [INDEX[name] for name in PARTS[part]] if part else list(range(len(JOINTS)))
    return {**_plain(compared), "part_mpjpe_mm": float(1000 * np.nanmean(compared.mpjpe.per_point[joints]))}


def _plain(found: Evaluation) -> dict[str, float | None]:
    return {
        "mpjpe_mm": 1000 * float(found.mpjpe.mean),
        "pa_mpjpe_mm": 1000 * float(found.pa_mpjpe.mean),
        "mpjve_mm_s": 1000 * float(found.mpjve.mean),
        "v2v_mm": None if found.v2v is None else 1000 * float(found.v2v.mean),
        "m2s_mm": 1000 * float(found.m2s),
        "m2s_reference_mm": 1000 * float(found.m2s_reference),
    }


def true_motion(session: SynthSession) -> Posed:
    """The truth on the markers' clock."""
    truth = session.truth
    motion = truth.motion
    return Posed(truth.body, truth.betas, session.markers.time, motion.rotations, motion.trans, truth.joints)


def real_markers(session: SynthSession) -> Markers:
    """The markers without ghosts."""
    return session.markers.select(markers=np.flatnonzero(session.truth.marker_joint >= 0))


def right_part(found: np.ndarray, true: np.ndarray, part: str | None) -> bool:
    """Whether enough of the true markers were put on the part that carries them.

    With markers all over the body, the part of a marker is the limb (or the trunk) that it sits on.

    Parameters
    ----------
    found, true : (M,) bone of each marker, -1 if unused and if it is a ghost
    part : key of ``PARTS``, None for the whole body
    """
    real = true >= 0
    used = real & (found >= 0)
    if part is None:
        hit = used & (_REGION[found] == _REGION[true])
    else:
        hit = used & np.isin(found, [INDEX[name] for name in PARTS[part]])
    return bool(hit.sum() >= RIGHT_SHARE * max(real.sum(), 1))


def near_bones(found: np.ndarray, true: np.ndarray) -> float:
    """Share of the true markers on the right bone or one next to it."""
    pairs = [(int(a), int(b)) for a, b in zip(found, true, strict=True) if b >= 0]
    return float(np.mean([a >= 0 and (a == b or PARENTS[a] == b or PARENTS[b] == a) for a, b in pairs]))


def heading_error_deg(found: np.ndarray, true: np.ndarray) -> float:
    """Median turn about the vertical, degrees, between two root rotations (T, 3, 3)."""
    between = found @ np.swapaxes(true, -1, -2)
    turn = np.arctan2(between[:, 1, 0] - between[:, 0, 1], between[:, 0, 0] + between[:, 1, 1])
    return float(np.degrees(np.nanmedian(np.abs(turn))))


def _is_right(other: Alternative, session: SynthSession) -> bool:
    truth = session.truth
    heading = heading_error_deg(other.root, truth.motion.rotations[other.frames, 0])
    return heading < RIGHT_HEADING_DEG and right_part(other.marker_joint, truth.marker_joint, session.settings.part)


def steps(session: SynthSession, solved: Solved) -> Mapping[str, dict[str, Any]]:
    """The figures after each earlier step of the method."""
    return {name: measure(session, replace(solved, motion=motion)) for name, motion in solved.steps().items()}
