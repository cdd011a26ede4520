"""How long the window's views take to prepare what widgets draw: a clock step, a dragged cut, opening a long recording.

    OMP_NUM_THREADS=1 python -m benchmarks.views [RESULT]

RESULT is a folder that ``markerscope solve`` or ``demo`` left; a session is made up where none is given. Prints two
Markdown tables: milliseconds a frame, and what ten minutes at 100 Hz with 60 markers cost once.
"""

from __future__ import annotations

import argparse
import time
import tracemalloc
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.app.views import bodies, scene, video
from markerscope.app.views.affinity import affinity_picture, recut
from markerscope.app.views.markers import marker_table
from markerscope.app.views.timelines import offset_row, overview, presence_row, residual_row
from markerscope.app.views.tracks import tracks_of
from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.clustering.segment import SegmentSettings, segment
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import load_session
from markerscope.solver.pipeline.stage import stage_keys
from markerscope.solver.pipeline.stages import SOURCES
from markerscope.solver.sync.offset import Sync

Row = tuple[str, *tuple[float, ...]]
RATE = 100.0
STEPS = 300


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("result", type=Path, nargs="?")
    options = parser.parse_args()
    body = load_body()
    long = made_up(body, frames=60_000, markers=60)
    found = long if options.result is None else loaded(options.result)
    name = "made up" if options.result is None else options.result.name
    print(f"A clock step ({name}), {STEPS} steps over the session:\n")
    show(("", "median ms", "p95 ms", "p95 ms of processor time"), clock_steps(body, found))
    print("\nTen minutes at 100 Hz, 60 markers, once:\n")
    show(("", "ms of processor time", "memory MB"), opening(long))


def show(titles: tuple[str, ...], rows: list[Row]) -> None:
    """Print a Markdown table."""
    print("| " + " | ".join(titles) + " |\n|---" + "|---:" * (len(titles) - 1) + "|")
    for text, *values in rows:
        print(f"| {text} | " + " | ".join(f"{value:.2f}" for value in values) + " |")


def clock_steps(body: Body, found: Mapping[str, Any]) -> list[Row]:
    """What each thing takes that a step of the clock needs."""
    motion, sync = found["fit"], found["sync"]
    tracks, track = tracks_of(found["markers"], motion), bodies.of_motion(body, motion)
    frames = np.linspace(0, len(motion.time) - 1, STEPS).round().astype(int)
    times = motion.time[frames]
    video_times = (times - sync.offset) / sync.rate_ratio
    clusters = found["segment"].clusters
    steps: dict[str, Callable[[int], Any]] = {
        "markers coloured by cluster": lambda i: scene.markers_at(tracks, frames[i], "cluster", clusters=clusters),
        "markers coloured by residual": lambda i: scene.markers_at(tracks, frames[i], "residual", motion=motion),
        "markers coloured by gap state": lambda i: scene.markers_at(tracks, frames[i], "gaps"),
        "trails of 0.5 s": lambda i: scene.trails(tracks, int(frames[i])),
        "lines to the skin": lambda i: scene.ties(tracks, track, int(frames[i])),
        "skeleton": lambda i: track.joints(float(times[i])),
        f"body, coarse ({len(track.coarse.features)} vertices)": lambda i: track.vertices(float(times[i]), "coarse"),
        f"body, full ({len(track.full.features)} vertices)": lambda i: track.vertices(float(times[i]), "full"),
        "markers and body over the video": lambda i: video.projection_at(
            motion.camera, sync, float(video_times[i]), tracks, track
        ),
    }
    rows = [(text, *percentiles([timed(step, i) for i in range(STEPS)])) for text, step in steps.items()]
    everything = [np.sum([timed(step, i) for step in steps.values()], axis=0) for i in range(STEPS)]
    ghost = bodies.BodyTrack(
        body, motion.betas, motion.time[::25], motion.rotations[::25], motion.trans[::25], *_none()
    )
    rows.append(("all of the above", *percentiles(everything)))
    ghosts = [timed(lambda i: ghost.vertices(float(times[i]), "coarse"), i) for i in range(STEPS)]
    rows.append(("a ghost between keyframes", *percentiles(ghosts)))
    return [*rows, ("a cut dragged, 100 markers", *percentiles(cuts()))]


def cuts() -> list[np.ndarray]:
    """Milliseconds to cut a tree of 100 markers anew at each of its heights, with some hand edits."""
    rng = np.random.default_rng(0)
    positions = rng.normal(0, 1, (1, 100, 3)) + 0.01 * rng.normal(0, 1, (400, 100, 3))
    edits = SegmentSettings(merges=((0, 5), (9, 10)), splits=((3, 4),), moves=((7, 8),), left_out=(50,))
    found = segment(Markers(positions, RATE, tuple(map(str, range(100)))), edits)
    heights = np.tile(found.linkage[:, 2], 3)
    return [timed(lambda i: recut(found, edits, float(heights[i])), i) for i in range(len(heights))]


def opening(found: Mapping[str, Any]) -> list[Row]:
    """Milliseconds and peak of new memory, MB, of what a recording needs once."""
    markers, motion, sync = found["markers"], found["fit"], found["sync"]
    tracks = tracks_of(markers, motion)
    steps: dict[str, Callable[[int], Any]] = {
        "states of all samples": lambda _: tracks_of(markers, motion),
        "presence row": lambda _: presence_row(tracks),
        "overview": lambda _: overview(tracks),
        "residual row, one fit": lambda _: residual_row({"fit": motion}, motion.time, own="fit"),
        "residual row, one fit, median": lambda _: residual_row({"fit": motion}, motion.time, "median", own="fit"),
        "marker table": lambda _: marker_table(tracks, found["segment"], motion),
        "offset row with motion": lambda _: offset_row(sync, markers, found["prior"]),
        "affinity picture": lambda _: affinity_picture(found["segment"], markers.labels),
    }
    rows = []
    for text, step in steps.items():
        spent = min(float(timed(step, 0)[1]) for _ in range(3))
        tracemalloc.start()
        step(0)
        rows.append((text, spent, tracemalloc.get_traced_memory()[1] / 1e6))
        tracemalloc.stop()
    return rows


def timed(step: Callable[[int], Any], i: int) -> np.ndarray:
    """Milliseconds that one call takes, by the clock and of the processor."""
    start, busy = time.perf_counter(), time.process_time()
    step(i)
    return 1000 * np.array([time.perf_counter() - start, time.process_time() - busy])


def percentiles(spent: list[np.ndarray]) -> tuple[float, float, float]:
    """Median and 95th percentile by the clock, and 95th percentile of the processor, ms."""
    clock, busy = np.stack(spent, axis=1)
    return float(np.median(clock)), float(np.percentile(clock, 95)), float(np.percentile(busy, 95))


def loaded(folder: Path) -> dict[str, Any]:
    """The results of a solve by stage."""
    session = load_session(folder)
    graph = graph_of(session)
    keys = stage_keys(graph, session.sources(SOURCES), session.stage_settings(graph))
    found = {stage.name: session.store.get(stage.name, keys[stage.name], stage.result) for stage in graph}
    return found | {"markers": found["clean"].markers}


def made_up(body: Body, frames: int, markers: int) -> dict[str, Any]:
    """A body that swings its limbs, markers on its skin with gaps, and a camera."""
    rng = np.random.default_rng(0)
    when = np.arange(frames) / RATE
    phase = when[:, None, None] * rng.uniform(0.5, 2, (24, 3)) + rng.uniform(0, 6, (24, 3))
    rotations = exp_so3(0.4 * np.sin(phase))
    rotations[:, 0] = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    trans = np.tile([0.0, 0.0, 0.9], (frames, 1))
    betas = np.zeros(body.shape_count)
    vertex = rng.choice(np.flatnonzero(body.marker_mask), markers, replace=False)
    placed, joints = body.pose(rotations, betas, trans, vertex)
    positions = placed + rng.normal(0, 0.005, placed.shape)
    for m in range(markers):
        for start in rng.integers(0, frames, 20):
            positions[start : start + rng.integers(1, 200), m] = np.nan
    view = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    camera = CameraResult(view, np.array([0.0, -4, 1]), 900.0, (720, 1280), 4.0)
    recorded = Markers(positions, RATE, tuple(f"m{i}" for i in range(markers)))
    bone = body.weights[vertex].argmax(axis=1)
    residual = np.linalg.norm(positions - placed, axis=2)
    fit = FittedMotion(
        when, rotations, trans, betas, joints, bone, vertex, placed, residual, camera, 0, 1.0, ()
    )  # fmt: skip
    nothing = np.zeros(1)
    return {
        "markers": recorded,
        "fit": fit,
        "segment": segment(recorded),
        "sync": Sync(0.0, 1.0, 1.0, nothing, nothing),
        "prior": PosePrior(rotations[:100], np.ones(100, bool), when[:100]),
    }


def _none() -> tuple[np.ndarray, np.ndarray]:
    return np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp)


if __name__ == "__main__":
    main()
