"""How many marker-frames a marker set names right, on real trials that were broken, exchanged and given ghosts.

    python -m benchmarks.labels DATA [--seeds N] [--only person,people,parts,shipped,sound]

DATA holds ``squat_video``, ``subject4``, ``fullbody`` and ``gait``. The sets are learnt by names (no video) from
``squats1.trc`` and from one walk of ``gait``; both are applied to other trials: of the person, and of other people. Ten
breaks, ten exchanges of neighbours within 0.3 m and ghosts (2 % of the samples, 30 to 150 mm beside a marker) are put
in with a seed. Names are taken off and trajectories shuffled; they are there to judge by. Computed points of the gait
files, which are no names of the set, are left out. Prints a Markdown table.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.markerset.by_names import pose_by_names
from markerscope.solver.markerset.columns import CERTAIN, in_order
from markerscope.solver.markerset.label import label
from markerscope.solver.markerset.learn import learn_from_pose
from markerscope.solver.markerset.marker_set import MarkerSet
from markerscope.solver.markerset.shipped import shipped

SQUATS, GAIT = "squat_video/squats1.trc", "gait/HC036A10.c3d"
PERSON = (
    "subject4/STS1.trc", "subject4/walking1.trc", "subject4/walkingTI1.trc", "subject4/walkingTS1.trc",
    "squat_video/static1.trc",
)  # fmt: skip
PEOPLE = (
    "fullbody/labval_dropjump_male.trc", "fullbody/labval_dropjump_gaps.trc", "gait/HC002D06.c3d", "gait/HC031A06.c3d",
    "gait/HC033A10.c3d", "gait/HC039A17.c3d", "gait/HC044A15.c3d",
)  # fmt: skip
LEG = ("L_thigh", "L_knee", "L_sh", "L_ankle", "L_calc", "L_5meta", "L_toe")
ARM = ("R_Shoulder", "R_humerus", "R_elbow", "R_forearm", "R_wrist")
FEW = (
    "L.ASIS", "r.ASIS", "L.PSIS", "r.PSIS", "L_knee", "r_knee", "L_ankle", "r_ankle", "L_toe", "r_toe", "C7",
    "L_Shoulder", "R_Shoulder", "L_elbow_lat", "R_elbow_lat", "L_wrist_radius", "R_wrist_radius",
)  # fmt: skip
BREAKS, EXCHANGES, GHOSTS = 10, 10, 0.02
_NEIGHBOUR_M = 0.3


@dataclass(frozen=True, eq=False)
class Spoilt:
    """Trajectories of which all is known.

    Attributes
    ----------
    markers : without names, shuffled
    truth : (T, N) number of the name of each sample, -1 for a ghost's or none
    breaks, exchanges : frame and the two trajectories of each
    """

    markers: Markers
    truth: np.ndarray
    breaks: tuple[tuple[int, int, int], ...]
    exchanges: tuple[tuple[int, int, int], ...]


def spoilt(markers: Markers, owner: np.ndarray, seed: int, much: bool = True) -> Spoilt:
    """The trial broken, exchanged, with ghosts, shuffled.

    Parameters
    ----------
    owner : (M,) number of each trajectory's name, -1 where the set has none
    """
    rng = np.random.default_rng(seed)
    frames = len(markers.positions)
    tracks = [markers.positions[:, m].copy() for m in range(len(owner))]
    truth = [np.where(np.isfinite(t).all(axis=1), o, -1) for t, o in zip(tracks, owner)]
    breaks, exchanges = [], []
    count = len(tracks)
    seen = lambda m, t: np.isfinite(tracks[m][t - 1 : t + 1]).all()  # noqa: E731
    while much and len(breaks) < BREAKS:
        m, t = int(rng.integers(count)), int(rng.integers(frames // 10, 9 * frames // 10))
        if not seen(m, t):
            continue
        later, own = np.full((frames, 3), np.nan), np.full(frames, -1)
        later[t:], own[t:] = tracks[m][t:], truth[m][t:]
        tracks[m][t:], truth[m][t:] = np.nan, -1
        tracks.append(later)
        truth.append(own)
        breaks.append((t, m, len(tracks) - 1))
    while much and len(exchanges) < EXCHANGES:
        m, t = int(rng.integers(len(tracks))), int(rng.integers(frames // 10, 9 * frames // 10))
        away = np.array(
            [np.linalg.norm(track[t] - tracks[m][t]) if seen(n, t) else 9 for n, track in enumerate(tracks)]
        )
        away[m] = 9
        near = np.flatnonzero(away < _NEIGHBOUR_M)
        if not seen(m, t) or not len(near):
            continue
        n = int(rng.choice(near))
        for rows in (tracks, truth):
            rows[m][t:], rows[n][t:] = rows[n][t:].copy(), rows[m][t:].copy()
        exchanges.append((t, m, n))
    made = 0
    while much and made < GHOSTS * frames * count:
        length, m = int(rng.integers(5, 40)), int(rng.integers(count))
        t = int(rng.integers(0, max(1, frames - length)))
        aside = rng.normal(size=3)
        aside *= rng.uniform(0.03, 0.15) / np.linalg.norm(aside)
        ghost = np.full((frames, 3), np.nan)
        wander = np.cumsum(rng.normal(0, 1e-3, (len(ghost[t : t + length]), 3)), axis=0)
        ghost[t : t + length] = markers.positions[t : t + length, m] + aside + wander
        tracks.append(ghost)
        truth.append(np.full(frames, -1))
        made += length
    order = rng.permutation(len(tracks))
    now = {int(old): new for new, old in enumerate(order)}
    positions = np.stack([tracks[i] for i in order], axis=1)
    labels = tuple(f"*{i}" for i in range(len(order)))
    moved = lambda rows: tuple((t, now[a], now[b]) for t, a, b in rows)  # noqa: E731
    return Spoilt(
        replace(markers, positions=positions, labels=labels, filled=None),
        np.stack([truth[i] for i in order], axis=1),
        moved(breaks),
        moved(exchanges),
    )


def judged(marker_set: MarkerSet, given: Spoilt) -> str:
    """The cells of a row."""
    start = time.process_time()
    found = label(load_body(), marker_set, given.markers)
    seconds = time.process_time() - start
    named = given.truth >= 0
    right = found.name == given.truth
    wrong = (found.name >= 0) & ~right
    sure = named & (np.nan_to_num(found.probability) >= CERTAIN)
    ordered = in_order(given.markers, found)
    mended = [
        all(found.name[t + k, n] == given.truth[t + k, n] for n in pair for k in (-2, 2) if given.truth[t + k, n] >= 0)
        for rows in (given.breaks, given.exchanges)
        for t, *pair in rows
    ]
    breaks, exchanges = mended[: len(given.breaks)], mended[len(given.breaks) :]
    moved = sum(one.what in ("joined", "exchanged") for one in ordered.stretches)
    certain = f"{100 * right[sure].mean():.2f}" if sure.any() else "none"
    return (
        f"{'yes' if found.same_person else 'no'} | {100 * right[named].mean():.2f} | "
        f"{100 * wrong.sum() / named.sum():.2f} | {100 * sure.sum() / named.sum():.1f} | {certain} | "
        f"{sum(breaks)} of {len(breaks)} | {sum(exchanges)} of {len(exchanges)} | {moved} | {seconds:.1f}"
    )


def learnt(path: Path) -> MarkerSet:
    """The set of a labelled trial, by its names."""
    body, markers = load_body(), load_markers(path)
    return learn_from_pose(body, markers, pose_by_names(body, markers).pose, path.stem, path.name)


def trial(
    path: Path, marker_set: MarkerSet, keep: Callable[[str], bool] = lambda name: True
) -> tuple[Markers, np.ndarray]:
    """The trajectories whose names the set has, and which."""
    markers = load_markers(path)
    chosen = np.array([name in marker_set.names and keep(name) for name in markers.labels])
    markers = markers.select(markers=np.flatnonzero(chosen))
    return markers, np.array([marker_set.names.index(name) for name in markers.labels])


def rows(data: Path, only: set[str], seeds: int) -> Iterator[tuple[str, MarkerSet, Spoilt]]:
    """What is judged."""
    person = learnt(data / SQUATS)
    for seed in range(seeds):
        for file in PERSON if "person" in only else ():
            yield f"person, {Path(file).stem}", person, spoilt(*trial(data / file, person), seed)
        for file in PEOPLE if "people" in only else ():
            own = learnt(data / GAIT) if file.startswith("gait") else person
            yield f"other people, {Path(file).stem}", own, spoilt(*trial(data / file, own), seed)
        for file in PERSON[:2] if "parts" in only else ():
            for what, part in (("leg", LEG), ("arm", ARM)):
                some = trial(data / file, person, lambda name, part=part: name.startswith(part))
                yield f"one {what}, {Path(file).stem}", person, spoilt(*some, seed, much=False)
            few = person.part(np.array([name in FEW for name in person.names]))
            yield f"set of {len(few.names)}, {Path(file).stem}", few, spoilt(*trial(data / file, few), seed)
        for file in (SQUATS, *PERSON[1:2]) if "shipped" in only else ():
            ships = shipped("opencap")
            yield f"shipped names, {Path(file).stem}", ships, spoilt(*trial(data / file, ships), seed)
        for file in PERSON if "sound" in only else ():
            yield f"sound, {Path(file).stem}", person, spoilt(*trial(data / file, person), seed, much=False)


def main() -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--only", default="person,people,parts,shipped,sound")
    options = parser.parse_args()
    print(
        "| trial | taken for the same person | right % | wrong % | certain % | of these right % | breaks "
        "| exchanges | moved | CPU s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    try:
        for what, marker_set, given in rows(options.data, set(options.only.split(",")), options.seeds):
            print(f"| {what} | {judged(marker_set, given)} |", flush=True)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
