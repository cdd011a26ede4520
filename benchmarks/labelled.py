"""Pelvis and hips of a labelled fit against rigid marker clusters, on recordings without a video.

    python -m benchmarks.labelled DATA [TRIAL.trc ...]

DATA holds ``fullbody/labval_walk.trc`` and ``fullbody/labval_dropjump_male.trc`` (two people, 47 labelled markers). The
fit is told each marker's bone and nothing else; the reference is Kabsch's rotation of each segment's own markers since
the first frame. Both are rotations since the first frame, so no definition of a zero enters: what differs is how the
skin model carries the markers. Prints a Markdown table: root mean square of the angle between the two, in degrees.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from markerscope.solver.angles.angles import world_rotations
from markerscope.solver.body.bones import load_body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit.labelled.solve import solve_labelled
from markerscope.solver.io import load_markers

TRIALS = ("fullbody/labval_walk.trc", "fullbody/labval_dropjump_male.trc")
SIDES = {"left": "L", "right": "r"}
CLUSTERS = {
    "pelvis": ("L.ASIS", "r.ASIS", "L.PSIS", "r.PSIS"),
    "left_hip": ("L_thigh1", "L_thigh2", "L_thigh3", "L_thigh4", "L_knee"),
    "right_hip": ("r_thigh1", "r_thigh2", "r_thigh3", "r_thigh4", "r_thigh5", "r_knee"),
}
"""Joint -> markers that move with its bone."""
BONES = {
    **dict.fromkeys(CLUSTERS["pelvis"], "pelvis"),
    **dict.fromkeys(CLUSTERS["left_hip"], "left_thigh"),
    **dict.fromkeys(CLUSTERS["right_hip"], "right_thigh"),
    **{f"L_{m}": "left_shank" for m in ("sh2", "sh3", "shank_antsup", "ankle")},
    **{f"r_{m}": "right_shank" for m in ("sh2", "sh3", "sh4", "shank_antsup", "ankle")},
    **{f"{s}_{m}": f"{side}_foot" for side, s in SIDES.items() for m in ("calc", "5meta")},
    **{f"{s}_toe": f"{side}_foot" for side, s in SIDES.items()},
    **dict.fromkeys(("C7", "L_Sternum", "R_Sternum", "L_Shoulder", "R_Shoulder"), "thorax"),
    **{f"{s}_{m}": f"{side}_upper_arm" for side, s in (("left", "L"), ("right", "R"))
       for m in ("humerus", "elbow_lat", "elbow_med")},
    **{f"{s}_{m}": f"{side}_forearm" for side, s in (("left", "L"), ("right", "R"))
       for m in ("forearm", "wrist_radius", "wrist_ulna")},
}  # fmt: skip
"""Label -> bone it is stuck to."""


def main() -> int:
    """Fit what was asked for and print how far each joint is from its cluster."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("trials", nargs="*", default=TRIALS)
    options = parser.parse_args()
    print("| trial | pelvis | left hip | right hip |\n|---|---|---|---|")
    try:
        for trial in options.trials:
            pelvis, left, right = errors_deg(load_markers(options.data / trial))
            print(f"| {Path(trial).stem} | {pelvis:.1f} | {left:.1f} | {right:.1f} |", flush=True)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


def errors_deg(markers: Markers) -> tuple[float, float, float]:
    """Root mean square, degrees, of pelvis, left hip and right hip: rotations since the first frame, both ways."""
    body = load_body()
    motion = solve_labelled(body, markers, {label: BONES[label] for label in markers.labels if label in BONES})
    turn = world_rotations(motion.rotations)
    # Both as rotations of the lab since the first frame, so that neither's segment axes matter.
    ours = {joint: turn[:, INDEX[joint]] @ turn[0, INDEX[joint]].T for joint in CLUSTERS}
    theirs = {joint: rigid_rotations(markers, labels) for joint, labels in CLUSTERS.items()}
    found = []
    for joint in CLUSTERS:
        one, other = (R[joint] if joint == "pelvis" else relative(R["pelvis"], R[joint]) for R in (ours, theirs))
        off = np.degrees(np.linalg.norm(log_so3(relative(one, other)), axis=-1))
        found.append(float(np.sqrt(np.nanmean(off**2))))
    return found[0], found[1], found[2]


def relative(proximal: np.ndarray, distal: np.ndarray) -> np.ndarray:
    """(T, 3, 3) rotation of one frame in another."""
    return np.swapaxes(proximal, -1, -2) @ distal


def rigid_rotations(markers: Markers, labels: tuple[str, ...]) -> np.ndarray:
    """(T, 3, 3) Kabsch's rotation of a cluster since the first frame in which all of it is seen."""
    points = markers.positions[:, [markers.labels.index(label) for label in labels]]
    whole = np.isfinite(points).all(axis=(1, 2))
    if not whole[0]:
        raise InputError("the first frame lacks markers of a cluster", markers.source, "cut the trial")
    base = points[0] - points[0].mean(axis=0)
    R = np.full((len(points), 3, 3), np.nan)
    u, _, vt = np.linalg.svd(base.T @ (points[whole] - points[whole].mean(axis=1, keepdims=True)))
    signs = np.ones((len(u), 3))
    signs[:, 2] = np.sign(np.linalg.det(np.swapaxes(vt, -1, -2) @ np.swapaxes(u, -1, -2)))
    R[whole] = np.swapaxes(vt, -1, -2) @ (signs[:, :, None] * np.swapaxes(u, -1, -2))
    return R


if __name__ == "__main__":
    sys.exit(main())
