"""How close a solve of the embedded session came to what made it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.evaluate.evaluate import Posed, compare, measured_markers, posed, summary_of
from markerscope.solver.io.motion_in import MOTION, read_motion
from markerscope.solver.synth.truth import Truth, load_truth

_SHOWN = ("hip_flexion", "knee_angle", "ankle_angle", "arm_flex", "elbow_flex")


def judge_demo(result: Path, progress: Progress = silent) -> Outcome:
    """Compare a result of the embedded session with its truth, which no stage of the solve ever reads."""
    truth = load_truth()
    found = read_motion(result)
    time = np.arange(len(found.rotations)) / found.rate if found.time is None else found.time
    ours, _ = posed(found, time, load_body(), known=True)
    clock = np.arange(len(truth.motion.rotations)) / truth.motion.rate + time[0]
    theirs = Posed(truth.body, truth.betas, clock, truth.motion.rotations, truth.motion.trans, truth.joints)
    compared = compare(ours, theirs, measured_markers(result), "the embedded session", (), progress)
    with np.load(Path(result) / MOTION, allow_pickle=False) as motion:
        bones = motion["marker_joint"]
    near, side = _agreement(bones, truth)
    summary = {**summary_of(compared), "right_bone": near, "right_side": side}
    lines = [
        f"joints {1000 * compared.mpjpe.mean:.1f} mm (MPJPE), joint velocities {1000 * compared.mpjve.mean:.0f} mm/s "
        "(MPJVE)",
        f"markers on the right side {100 * side:.0f} %, on the right bone or its neighbour {100 * near:.0f} %",
        f"markers to skin {1000 * compared.m2s:.1f} mm, to the true skin {1000 * compared.m2s_reference:.1f} mm (m2s)",
    ]
    if compared.v2v is not None:
        lines.insert(1, f"skin {1000 * compared.v2v.mean:.1f} mm (V2V)")
    for name in _SHOWN:
        left, right = (compared.angles.get(f"{name}_{s}") for s in "lr")
        if left is not None and right is not None:
            values = [np.degrees(v) for a in (left, right) for v in (a.rmse, a.rmse_less_offset)]
            lines.append(
                f"{name}: {values[0]:.1f} degrees RMSE left, {values[2]:.1f} right "
                f"({values[1]:.1f} and {values[3]:.1f} less offset)"
            )
    return Outcome(summary=summary, lines=tuple(f"  {line}" for line in lines))


def _agreement(bones: np.ndarray, truth: Truth) -> tuple[float, float]:
    """Shares of the markers on the true bone or one next to it, and on the true side."""
    from markerscope.solver.core.skeleton import PARENTS

    pairs = [(int(a), int(b)) for a, b in zip(bones, truth.marker_joint, strict=True)]
    near = [a >= 0 and (a == b or PARENTS[a] == b or PARENTS[b] == a) for a, b in pairs]
    side = [a >= 0 and not {"left", "right"} <= {JOINTS[a].split("_")[0], JOINTS[b].split("_")[0]} for a, b in pairs]
    return float(np.mean(near)), float(np.mean(side))
