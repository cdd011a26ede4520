"""How often the found sync offset is right, and whether its confidence says so.

    python -m benchmarks.sync_confidence DATA [--pairs 400] [--seed 0]

DATA is the folder of real recordings. A pair is a stretch of video landmarks and a stretch of markers: the real squat;
markers fixed to the bones of the sit-to-stand (whose offset is what most pairs say); recorded motions (BVH) seen by a
made-up camera through the trembling of a pose network; and, a seventh of the time, two different trials, for which
every offset is wrong. Lengths, limbs, numbers of markers and gaps vary. Prints the error, a table of confidence against
truth, and a logistic fit to compare with the one in ``markerscope.solver.sync.offset``.
"""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.sync.offset import find_offset
from markerscope.solver.video.blazepose import track_pose

RIGHT = 0.05  # s
SQUAT_OFFSET, RISE_OFFSET = -0.010, 0.064  # s
COMPUTED = ("L_HJC", "L_HJC_reg", "R_HJC", "R_HJC_reg")
LEG, ARM = ("femur_l", "tibia_l", "talus_l", "calcn_l"), ("humerus_r", "ulna_r", "hand_r")
SQUAT_LEG = ("L_thigh", "L_knee", "L_mknee", "L_sh", "L_ankle", "L_mankle", "L_toe", "L_calc", "L_5meta")
SQUAT_ARM = ("R_Shoulder", "R_humerus", "R_elbow", "R_forearm", "R_wrist")
MOTIONS = ("bow", "dance-short", "dance-short", "dance-short", "kick", "punch", "slash", "walk", "walk")
BONES = {"leg": ("UpperLeg_L", "LowerLeg_L", "Foot_L"), "arm": ("UpperArm_R", "LowerArm_R", "Hand_R")}
NEAREST = {
    "hip": "UpperLeg",
    "knee": "LowerLeg",
    "ankle": "Foot",
    "heel": "Foot",
    "foot": "Toes",
    "shoulder": "UpperArm",
}
NEAREST |= {"elbow": "LowerArm", "wrist": "Hand", "pinky": "Hand", "index": "Hand", "thumb": "Hand"}


@dataclass(frozen=True)
class Trial:
    """One recording seen twice."""

    landmarks: Landmarks
    markers: Markers
    offset: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--pairs", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    rng = np.random.default_rng(arguments.seed)
    videos = {name: track_pose(arguments.data / f"{name}_video" / "video.mp4") for name in ("squat", "sts")}
    rows = []
    for _ in range(arguments.pairs):
        trial = draw(arguments.data, videos, rng)
        found = find_offset(trial.landmarks, trial.markers)
        rows.append((found.offset - trial.offset, found.margin, found.confidence))
    report(np.array(rows))


def report(rows: np.ndarray) -> None:
    error, margin, confidence = np.abs(rows[:, 0]), np.maximum(rows[:, 1], 1.0), rows[:, 2]
    right = error < RIGHT  # false where the truth is NaN: two different trials
    true_pairs = np.isfinite(error)
    print(
        f"{len(rows)} pairs, {true_pairs.sum()} of one trial: {right.sum() / true_pairs.sum():.3f} right to {RIGHT} s"
    )
    median, most = 1000 * np.percentile(error[right], [50, 95])
    print(f"of these, median error {median:.1f} ms, 95 % within {most:.1f} ms")
    edges = np.array([0, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97, 1.0001])
    for low, high in pairwise(edges):
        inside = (confidence >= low) & (confidence < high)
        if inside.any():
            print(f"confidence {low:.2f} to {high:.2f}: {inside.sum():3d} pairs, {right[inside].mean():.2f} right")

    def surprise(parameters: np.ndarray) -> float:
        logit = parameters[0] * (np.log(margin) - parameters[1])
        return float(np.mean(np.logaddexp(0, logit) - right * logit))

    steepness, middle = minimize(surprise, [2.0, 2.0], method="Nelder-Mead").x
    print(f"logistic fit: even odds at {np.exp(middle):.1f} nats, steepness {steepness:.2f}")


def draw(data: Path, videos: dict[str, Landmarks], rng: np.random.Generator) -> Trial:
    """A stretch of a random trial."""
    kind = rng.choice(["squat", "sts", "motion", "mistaken"], p=[0.25, 0.15, 0.45, 0.15])
    part = str(rng.choice(["whole", "leg", "arm"]))
    count, seconds = int(rng.choice([4, 7, 12, 20, 40])), float(rng.choice([3, 5, 8, 14]))
    if kind == "motion":
        path = data / "motion" / "bandai" / f"dataset-1_{rng.choice(MOTIONS)}_normal_001.bvh"
        trial = filmed(path, part, count, rng)
    else:
        name = str(rng.choice(["squat", "sts"])) if kind == "mistaken" else str(kind)
        markers = squat(data, part, count, rng) if name == "squat" else risen(data, part, rng)
        other = {"squat": "sts", "sts": "squat"}[name] if kind == "mistaken" else name
        offset = np.nan if kind == "mistaken" else {"squat": SQUAT_OFFSET, "sts": RISE_OFFSET}[name]
        trial = Trial(videos[other], markers, offset)
    return stretch(trial, seconds, rng)


def squat(data: Path, part: str, count: int, rng: np.random.Generator) -> Markers:
    markers = load_markers(data / "squat_video" / "squats1.trc")
    wanted = {"leg": SQUAT_LEG, "arm": SQUAT_ARM}.get(part, ("",))
    keep = [
        i
        for i, n in enumerate(markers.labels)
        if n not in COMPUTED and n.lower().startswith(tuple(w.lower() for w in wanted))
    ]
    return markers.select(markers=rng.permutation(keep)[:count])


def risen(data: Path, part: str, rng: np.random.Generator) -> Markers:
    """Two markers fixed to every bone of the labelled inverse kinematics."""
    bodies = json.loads((data / "sts_video" / "bodies_mocap.json").read_text())["bodies"]
    paths = []
    for name in {"leg": LEG, "arm": ARM}.get(part, tuple(bodies)):
        turn = Rotation.from_euler("XYZ", bodies[name]["rotation"]).as_matrix()
        paths += [np.array(bodies[name]["translation"]) + turn @ rng.normal(0, 0.06, 3) for _ in range(2)]
    return captured(np.stack(paths, axis=1), rng)


def captured(positions: np.ndarray, rng: np.random.Generator) -> Markers:
    noisy = positions + rng.normal(0, 0.0005, positions.shape)
    return Markers(noisy, 100.0, tuple(f"M{i}" for i in range(positions.shape[1])))


def filmed(path: Path, part: str, count: int, rng: np.random.Generator) -> Trial:
    """A recorded motion with markers on its bones, and its landmarks by a camera some metres away."""
    names, rate, places, turns = read_bvh(path)
    bones = [names.index(n) for n in BONES.get(part, [n for n in names if n != "end" and "Root" not in n])]
    time = np.arange(len(places)) / rate
    chosen = [bones[i % len(bones)] for i in range(count)]
    paths = np.stack([places[:, j] + turns[j].apply(rng.normal(0, 0.07, 3)) for j in chosen], axis=1)
    fine = np.arange(0, time[-1], 0.01)
    markers = captured(CubicSpline(time, paths)(fine), rng)

    clock = np.arange(0, time[-1], 1 / 30)
    joints = CubicSpline(time, places)(clock) - places[:, 0].mean(axis=0)
    joints = joints @ Rotation.from_euler("yx", [rng.uniform(0, 6.28), rng.uniform(-0.3, 0.1)]).as_matrix()
    picture = 900 * joints[..., :2] * [1, -1] / (joints[..., 2:] + rng.uniform(4.5, 7)) + [360, 640]
    image = np.stack([picture[:, names.index(nearest(n, names))] for n in LANDMARKS], axis=1)
    size = np.ptp(image[0, :, 1]) / 500
    fade, drift = np.exp(-1 / 9), rng.normal(0, 5 * size, image.shape)
    for i in range(1, len(drift)):
        drift[i] = fade * drift[i - 1] + np.sqrt(1 - fade**2) * drift[i]
    image = image + drift + rng.normal(0, 1.2 * size, image.shape)
    frames = len(clock)
    seen, lit = np.ones(frames, dtype=bool), np.full((frames, 33), 0.9)
    landmarks = Landmarks(image, np.zeros((frames, 33, 3)), lit, seen, clock, np.arange(frames), (720, 1280))
    return Trial(landmarks, markers, 0.0)


def nearest(landmark: str, names: list[str]) -> str:
    side, _, part = landmark.partition("_")
    bone = NEAREST.get(part.split("_")[0])
    return f"{bone}_{side[0].upper()}" if bone and f"{bone}_{side[0].upper()}" in names else "Head"


def stretch(trial: Trial, seconds: float, rng: np.random.Generator) -> Trial:
    """Parts of the video and the markers of about the same time, on clocks of their own, sometimes with gaps."""
    time = trial.landmarks.time
    start = rng.uniform(0, max(0.0, time[-1] - seconds))
    rows = (time >= start) & (time <= start + seconds)
    names = ("image", "world", "visibility", "tracked", "frame")
    arrays = {name: getattr(trial.landmarks, name)[rows] for name in names}
    landmarks = replace(trial.landmarks, time=time[rows] - time[rows][0], **arrays)
    rate, length = trial.markers.rate, len(trial.markers.positions)
    first = int(np.clip((start + rng.uniform(-1, 1)) * rate, 0, length - 200))
    last = int(np.clip((start + seconds + rng.uniform(-1, 1)) * rate, first + 200, length))
    positions = trial.markers.positions[first:last].copy()
    if rng.random() < 0.3:
        for m in range(positions.shape[1]):
            for begin in rng.integers(len(positions), size=2):
                positions[begin : begin + int(np.exp(rng.uniform(0, 5))), m] = np.nan
    markers = replace(trial.markers, positions=positions, first_time=0.0, filled=None)
    return Trial(landmarks, markers, trial.offset + time[rows][0] - first / rate)


def read_bvh(path: Path) -> tuple[list[str], float, np.ndarray, list[Rotation]]:
    """Joint names, rate in Hz, places (T, J, 3) m, y up, and orientations of a BVH file in centimetres."""
    head, motion = path.read_text().split("MOTION")
    names, parents, offsets, channels, open_joints = [], [], [], [], [-1]
    for words in (line.split() for line in head.splitlines() if line.split()):
        if words[0] in ("ROOT", "JOINT", "End"):
            names.append("end" if words[0] == "End" else words[1])
            parents.append(open_joints[-1])
            offsets.append(np.zeros(3))
            channels.append([])
        elif words[0] == "{":
            open_joints.append(len(names) - 1)
        elif words[0] == "}":
            open_joints.pop()
        elif words[0] == "OFFSET":
            offsets[-1] = np.array(words[1:4], dtype=float)
        elif words[0] == "CHANNELS":
            channels[-1] = words[2:]
    lines = motion.strip().splitlines()
    table = np.array([line.split() for line in lines[2:]], dtype=float)
    places: list[np.ndarray] = []
    turns: list[Rotation] = []
    column = 0
    for joint, parent in enumerate(parents):
        values = dict(zip(channels[joint], table[:, column : column + len(channels[joint])].T, strict=True))
        column += len(channels[joint])
        axes = [name[0] for name in channels[joint] if name.endswith("rotation")]
        angles = np.stack([values[f"{a}rotation"] for a in axes], axis=1) if axes else np.zeros((len(table), 3))
        own = Rotation.from_euler("".join(axes) or "ZXY", angles, degrees=True)
        if parent < 0:
            places.append(np.stack([values[f"{a}position"] for a in "XYZ"], axis=1))
            turns.append(own)
        else:
            places.append(places[parent] + turns[parent].apply(offsets[joint]))
            turns.append(turns[parent] * own)
    return names, 1 / float(lines[1].split()[-1]), np.stack(places, axis=1) / 100, turns


if __name__ == "__main__":
    main()
