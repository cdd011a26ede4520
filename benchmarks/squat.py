"""A real squat, solved from unlabelled markers and a video alone, against the labelled markers of the same trial.

    python -m benchmarks.squat DATA [--part whole_body|left_leg|right_arm] [--seed 1]

DATA holds ``squat_video`` (markers, video, inverse kinematics) and ``segments_squat.toml``. Labels are taken off and
the markers shuffled; only the score reads them. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import json
import resource
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np

from markerscope.solver.commands import solve_session
from markerscope.solver.core.markers import Markers, lab_rotation
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.mot import read_mot

PARTS = {
    "whole_body": None,
    "left_leg": ("left_thigh", "left_knee", "left_shank", "left_ankle", "left_foot"),
    "right_arm": ("right_shoulder", "right_upper_arm", "right_elbow", "right_forearm", "right_wrist"),
}
TRUE_OFFSET_S = -0.010
BODY_OF_JOINT = {
    **{f"{s}_{joint}": f"{body}_{s[0]}" for s in ("left", "right") for joint, body in {
        "hip": "femur", "knee": "tibia", "ankle": "talus", "shoulder": "humerus", "elbow": "ulna", "wrist": "hand",
    }.items()},
}  # fmt: skip
ANGLES = ("hip_flexion", "knee_angle", "ankle_angle", "elbow_flex")


def main() -> None:
    """Solve what was asked for and print how close it came."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--part", choices=PARTS, action="append")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rows: list[dict[str, str]] = []
    with tempfile.TemporaryDirectory() as folder:
        for part in options.part or list(PARTS):
            rows.append(run(options.data, part, options.seed, Path(folder)))
    print("| | " + " | ".join(row["part"] for row in rows) + " |")
    print("|---" * (len(rows) + 1) + "|")
    for name in rows[0]:
        if name != "part":
            print(f"| {name} | " + " | ".join(row.get(name, "") for row in rows) + " |")


def run(data: Path, part: str, seed: int, folder: Path) -> dict[str, str]:
    """One solve and its score."""
    markers, labels = stripped(data, part, seed)
    path, out = folder / f"{part}.trc", folder / part
    write_trc(path, markers)
    start = time.perf_counter()
    request = SolveRequest(path, video=data / "squat_video" / "video.mp4", out=out)
    summary = solve_session(request, silent).summary
    seconds = time.perf_counter() - start
    start = time.perf_counter()
    solve_session(request, silent)
    again = time.perf_counter() - start
    stages = summary["seconds"]
    fit = sum(stages[name] for name in ("localize", "orient", "fit"))
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return {
        "part": part.replace("_", " "),
        "markers": str(len(labels)),
        **score(data, out, labels),
        "sync offset, off by (s)": f"{abs(summary['sync']['offset_s'] - TRUE_OFFSET_S):.3f}",
        "confidence; next answer's energy": f"{summary['confidence']:.2f}; "
        + (f"x {summary['margin']:.2f}" if summary["margin"] else "none"),
        "seconds in all; landmarks; fit": f"{seconds:.1f}; {stages['landmarks']:.1f}; {fit:.1f}",
        "seconds when nothing changed": f"{again:.1f}",
        "peak memory of the process so far (GB)": f"{peak:.2f}",
    }


def stripped(data: Path, part: str, seed: int) -> tuple[Markers, list[str]]:
    """The trial's markers without their names, shuffled, and the names for the judge."""
    full = load_markers(data / "squat_video" / "squats1.trc", up="y")
    segment_of = segments(data)[0]
    wanted = PARTS[part]
    keep = [
        i for i, name in enumerate(full.labels) if name in segment_of and (not wanted or segment_of[name] in wanted)
    ]
    order = np.random.default_rng(seed).permutation(keep)
    labels = [full.labels[i] for i in order]
    bare = Markers(full.positions[:, order], full.rate, tuple(f"M{i}" for i in range(len(order))), full.first_time,
                   lab_rotation("y"))  # fmt: skip
    return bare, labels


def segments(data: Path) -> tuple[dict[str, str], dict[str, list[str]]]:
    """Segment of each marker, and the joints whose bone a marker of a segment may be given to."""
    table = tomllib.loads((data / "segments_squat.toml").read_text())
    allowed = table.pop("joints")
    return {marker: segment for segment, names in table.items() for marker in names}, allowed


def score(data: Path, out: Path, labels: list[str]) -> dict[str, str]:
    """Figures of one result folder, in words and numbers."""
    segment_of, allowed = segments(data)
    motion = np.load(out / "motion.npz", allow_pickle=False)
    found = [JOINTS[j] for j in motion["marker_joint"]]
    right = np.mean([bone in allowed[segment_of[name]] for bone, name in zip(found, labels, strict=True)])
    side = np.mean(
        [not {"left", "right"} <= {bone.split("_")[0], segment_of[name].split("_")[0]}
         for bone, name in zip(found, labels, strict=True)]
    )  # fmt: skip
    bodies = json.loads((data / "squat_video" / "bodies_mocap.json").read_text())
    lab = motion["joints"] @ motion["R_lab_internal"].T
    errors = []
    for joint, body in BODY_OF_JOINT.items():
        path = np.array(bodies["bodies"][body]["translation"])
        there = np.stack([np.interp(motion["time"], bodies["time"], path[:, k]) for k in range(3)], axis=1)
        errors.append(np.linalg.norm(lab[:, INDEX[joint]] - there, axis=1).mean())
    reference = read_mot(data / "squat_video" / "squats1_ik.mot")
    true = reference.in_degrees()
    ours = np.genfromtxt(out / "angles.csv", delimiter=",", names=True)
    figures = {
        "markers on the right bone, side": f"{100 * right:.0f} %, {100 * side:.0f} %",
        "12-joint MPJPE (mm)": f"{1000 * np.mean(errors):.1f}",
    }
    for angle in ANGLES:
        cells = []
        for s in "rl":
            gap = ours[f"{angle}_{s}"] - np.interp(ours["time"], reference.time, true[f"{angle}_{s}"])
            cells.append(f"{np.sqrt(np.nanmean(gap**2)):.1f} ({np.nanstd(gap):.1f})")
        figures[f"{angle} RMSE, right; left (less offset), degrees"] = "; ".join(cells)
    return figures


if __name__ == "__main__":
    main()
