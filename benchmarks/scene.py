"""How long the 3D scene and the video view take to show something new, and whether memory grows.

    python -m benchmarks.scene [--steps 200] [--updates 2000]      0 leaves a table out

Draws off screen at 900 x 700 px: the embedded body with its skeleton, 60 named markers and a floor, each step moved.
Prints a Markdown table of milliseconds from new arrays to painted pixels; the processor's time, of all threads together
and on average, says what a picture costs where others keep the machine busy.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")

import numpy as np
from PySide6.QtWidgets import QApplication

from markerscope.widgets import palette, theme
from markerscope.widgets.gallery.scene import coarse_body, made_up_body, made_up_markers
from markerscope.widgets.scene import Camera, Scene3D
from markerscope.widgets.video import VideoView

WARM_UP = 20


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--updates", type=int, default=2000)
    options = parser.parse_args()
    theme.apply(QApplication([]), "light")
    started = time.perf_counter()
    scene = Scene3D()
    scene.resize(900, 700)
    scene.show()
    shown()
    first = 1e3 * (time.perf_counter() - started)
    if scene.problem:
        sys.exit(scene.problem)
    whole, coarse = made_up_body(), coarse_body()
    bodies = {f"{len(v)} vertices": (v, f) for v, f in ((whole[0], whole[1]), coarse)}
    skeleton = (whole[2], whole[3])
    if options.steps:
        time_rows(scene, whole, coarse, first, options.steps)
    if options.updates:
        memory_rows(scene, {name: step(scene, body, skeleton, 0.6) for name, body in bodies.items()}, options.updates)


def time_rows(
    scene: Scene3D, whole: tuple[np.ndarray, ...], coarse: tuple[np.ndarray, np.ndarray], first: float, steps: int
) -> None:
    """Print how long each kind of change takes."""
    print("| what changes | p50 ms | p95 ms | CPU ms |\n|---|---|---|---|")
    print(f"| nothing: the first picture of a scene | {first:.1f} | | |")
    bodies = {f"{len(v)} vertices": (v, f) for v, f in ((whole[0], whole[1]), coarse)}
    for name, body in bodies.items():
        for opacity, look in ((1.0, "solid"), (0.6, "see-through")):
            row(f"everything, body of {name}, {look}", step(scene, body, (whole[2], whole[3]), opacity), steps)
    row("everything but the body", step(scene, None, (whole[2], whole[3]), 1.0), steps)
    show = step(scene, bodies[next(iter(bodies))], (whole[2], whole[3]), 0.6)
    show(0)
    markers, table = made_up_markers(whole[0], 60)[0], palette.categorical(60)

    def turn(k: int) -> None:
        scene.orbit(0.02, 0.0)
        shown()

    def recolour(k: int) -> None:
        scene.set_markers(markers, np.roll(table, k, axis=0))
        shown()

    def choose(k: int) -> None:
        scene.set_selected([k % 60])
        shown()

    row("the camera, full body see-through", turn, steps)
    row("the markers' colours", recolour, steps)
    row("what is hovered or selected", choose, steps)
    row("nothing: which marker is at a pixel", lambda k: scene.marker_at((400.0 + k % 90, 300.0)), steps)
    row("nothing: a smooth picture for a file", lambda k: scene.image(), max(10, steps // 10))
    video_rows(whole, coarse, steps)


def step(
    scene: Scene3D,
    body: tuple[np.ndarray, np.ndarray] | None,
    skeleton: tuple[np.ndarray, np.ndarray],
    opacity: float,
) -> Callable[[int], None]:
    """A function that shows frame ``k`` of a body that sways."""
    markers, _ = made_up_markers(made_up_body()[0], 60)
    colours = palette.categorical(60)
    scene.set_marker_labels([f"M{i:02d}" for i in range(60)])
    scene.set_legend(
        "Cluster", [(f"Cluster {k + 1}", (int(r), int(g), int(b))) for k, (r, g, b) in enumerate(colours[:12])]
    )
    vertices = np.zeros((0, 3), dtype=np.float32) if body is None else body[0].astype(np.float32)
    faces = np.zeros((0, 3), dtype=int) if body is None else body[1]

    def show(k: int) -> None:
        sway = np.array([0.1 * np.sin(0.1 * k), 0.05 * np.cos(0.1 * k), 0.0], dtype=np.float32)
        scene.set_markers(markers + sway, colours)
        scene.set_mesh("body", None if body is None else vertices + sway, faces, None, opacity)
        scene.set_bones("skeleton", skeleton[0] + sway, skeleton[1])
        shown()

    show(0)
    scene.set_floor(0.0)
    scene.set_facing((0.0, -1.0))
    scene.view_from("isometric")
    scene.view_from("fit")
    return show


def shown() -> None:
    """Have Qt paint what was set: ``repaint`` alone may put it off."""
    QApplication.processEvents()


def video_rows(whole: tuple[np.ndarray, ...], coarse: tuple[np.ndarray, np.ndarray], steps: int) -> None:
    """The same for a frame of 1280 x 720 px with outline, bones and markers."""
    view = VideoView()
    view.resize(900, 506)
    view.show()
    frames = [np.full((720, 1280, 3), 40 + k, dtype=np.uint8) for k in range(8)]
    random = np.random.default_rng(1)
    camera = Camera().fitted(whole[0], 1280 / 720)
    outline, joints = (camera.project(points, 1280, 720)[0] for points in (coarse[0], whole[2]))
    markers, colours = camera.project(made_up_markers(whole[0], 60)[0], 1280, 720)[0], palette.categorical(60)

    def show(k: int) -> None:
        shift = random.normal(size=2)
        view.set_frame(frames[k % 8], f"frame {k}")
        view.set_body(outline + shift, coarse[1])
        view.set_skeleton(joints + shift, whole[3])
        view.set_markers(markers + shift, colours)
        shown()

    row("video: 720p frame, outline, bones, 60 markers", show, steps)
    view.close()


def row(name: str, act: Callable[[int], object], steps: int) -> None:
    """Time ``act`` and print its line."""
    for k in range(WARM_UP):
        act(k)
    times = []
    worked = time.process_time()
    for k in range(steps):
        before = time.perf_counter()
        act(k)
        times.append(1e3 * (time.perf_counter() - before))
    worked = 1e3 * (time.process_time() - worked) / steps
    print(f"| {name} | {np.percentile(times, 50):.1f} | {np.percentile(times, 95):.1f} | {worked:.1f} |", flush=True)


def memory_rows(scene: Scene3D, shows: dict[str, Callable[[int], None]], updates: int) -> None:
    """Print how much the process grows over many updates."""
    print("\n| memory | after warm-up MB | growth MB | references to None |\n|---|---|---|---|")
    for name, show in shows.items():
        for k in range(200):
            show(k)
        before, nones = resident_mb(), sys.getrefcount(None)
        for k in range(updates):
            show(k)
        lost = sys.getrefcount(None) - nones
        print(f"| {updates} updates, {name} | {before:.0f} | {resident_mb() - before:+.1f} | {lost:+d} |", flush=True)


def resident_mb() -> float:
    """Memory that this process holds now, MB."""
    status = Path("/proc/self/statm")
    if status.exists():
        return int(status.read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20
    import resource

    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


if __name__ == "__main__":
    main()
