"""How quick the widgets are on made-up sessions of full size: `python -m benchmarks.widgets`.

10 minutes at 100 Hz with 60 markers for the timelines, 4 for the marker curves, 100 markers for the affinity view.
Everything is drawn into memory; a step ends when its last pixel is painted. On a busy machine believe the processor's
time, not the clock's.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable

import numpy as np

FRAMES, MARKERS, RATE = 60_000, 60, 100.0


def main() -> None:
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    from PySide6.QtWidgets import QApplication

    from markerscope.widgets import theme

    app = QApplication([])
    theme.apply(app, "light")
    print(f"{'ms':54s} {'median':>8s} {'p95':>8s} {'worst':>8s}   processor: {'median':>8s} {'p95':>8s}")
    for name, step, times in [*timelines(app), *markers(app), *affinity(app), *angles(app), *table(app)]:
        report(name, step, times, app)


def report(name: str, step: Callable[[int], None], times: int, app: object) -> None:
    taken, busy = [], []
    for k in range(times + 3):
        start, used = time.perf_counter(), time.process_time()
        step(k)
        app.processEvents()  # type: ignore[attr-defined]
        if k >= 3:
            taken.append(1e3 * (time.perf_counter() - start))
            busy.append(1e3 * (time.process_time() - used))
    figures = f"{np.median(taken):8.1f} {np.quantile(taken, 0.95):8.1f} {max(taken):8.1f}"
    print(f"{name:54s} {figures}              {np.median(busy):8.1f} {np.quantile(busy, 0.95):8.1f}")


def timelines(app: object) -> list:
    from markerscope.widgets import palette
    from markerscope.widgets.plots.rows import Curve, CurveRow, PresenceRow
    from markerscope.widgets.plots.timelines import Timelines

    rng = np.random.default_rng(0)
    clock = np.arange(FRAMES) / RATE
    present = np.ones((FRAMES, MARKERS), bool)
    for marker in range(MARKERS):
        for start in rng.integers(0, FRAMES, 60):
            present[start : start + int(rng.exponential(40)), marker] = False
    filled = ~present & (rng.random((1, MARKERS)) < 0.5)
    outlier = rng.random((FRAMES, MARKERS)) < 1e-4
    curves = tuple(
        Curve(f"fit {k}", 5 + k + rng.standard_normal(FRAMES).cumsum() * 0.01, ink)
        for k, ink in enumerate(palette.categorical(3))
    )
    shown = Timelines()
    shown.resize(1400, 420)
    shown.show()

    def opened(_: int) -> None:
        shown.set_span(0, FRAMES / RATE)
        shown.set_rows(
            [
                PresenceRow("Markers", clock, present, filled, outlier, palette.categorical(MARKERS)),
                CurveRow("Residual", clock, curves, "mm"),
            ]
        )

    def zoom(k: int) -> None:
        width = 600 / 1.25 ** (k % 24)
        shown.set_view(200 - width / 3, 200 + width * 2 / 3)

    def part(k: int) -> None:
        shown.set_view(10.0 * (k % 20), 10.0 * (k % 20) + 60)

    def whole(k: int) -> None:
        shown.set_view(0, 600 - 0.5 * (k % 2))

    opened(0)
    return [
        ("timelines: 60,000 frames x 60 markers, rows new", opened, 8),
        ("timelines: the same, one step of zoom", zoom, 48),
        ("timelines: the same, one step of pan at a minute", part, 40),
        ("timelines: the same, the whole again", whole, 12),
        ("timelines: cursor step", lambda k: shown.set_time(100 + 0.5 * k), 200),
        ("timelines: another selection", lambda k: shown.set_selected([k % MARKERS, 3]), 30),
    ]


def markers(app: object) -> list:
    from markerscope.widgets import palette
    from markerscope.widgets.plots.marker_curve_data import CurvePicture, CurvePlot, Line, Shade
    from markerscope.widgets.plots.marker_curves import MarkerCurvesView

    rng = np.random.default_rng(0)
    inks = [tuple(int(c) for c in ink) for ink in palette.categorical(4)]
    plots = []
    for title in ("x", "y", "z"):
        lines = []
        for k, ink in enumerate(inks):
            whole, raw = rng.standard_normal(FRAMES).cumsum(), np.full(FRAMES, np.nan)
            raw[999::1000], raw[1000::1000] = whole[999::1000], whole[1000::1000] + 50
            seen, filled = whole.copy(), np.full(FRAMES, np.nan)
            for start in range(500, FRAMES, 1000):
                seen[start : start + 30] = np.nan
                filled[start - 1 : start + 31] = whole[start - 1 : start + 31]
            lines += [Line(kind, f"M{k}", v, ink) for kind, v in (  # type: ignore[arg-type]
                ("raw", raw), ("body", whole + 5), ("measured", seen), ("filled", filled))]  # fmt: skip
        plots.append(CurvePlot(title, "mm", tuple(lines)))
    shades = [Shade(s, s + 29, "filled", f"M{k}", ink) for k, ink in enumerate(inks) for s in range(500, FRAMES, 1000)]
    names = tuple((f"M{k}", ink) for k, ink in enumerate(inks))
    view = MarkerCurvesView()
    view.resize(1100, 420)
    view.window_of_time.set_span(0, FRAMES / RATE)
    view.show()
    picture = CurvePicture(np.arange(FRAMES) / RATE, tuple(plots), tuple(shades), names)
    view.set_picture(picture)

    def pan(width: float) -> Callable[[int], None]:
        return lambda k: view.window_of_time.set_view(3.0 * (k % 60), 3.0 * (k % 60) + width)

    return [
        ("marker curves: 60,000 frames x 4 markers, pan at 5 min", pan(300), 40),
        ("marker curves: the same, pan at 5 s", pan(5), 40),
        ("marker curves: cursor step", lambda k: view.window_of_time.set_time(100 + 0.5 * (k % 4)), 100),
    ]


def affinity(app: object) -> list:
    from PySide6.QtCore import QPointF, Qt
    from PySide6.QtTest import QTest
    from scipy.cluster.hierarchy import fcluster

    from markerscope.widgets import palette
    from markerscope.widgets.gallery.plots import rigid_groups
    from markerscope.widgets.plots.affinity import AffinityView

    matrix, tree, order = rigid_groups(100, 16)
    view = AffinityView()
    view.resize(700, 800)

    def recut(cut: float) -> None:
        groups = fcluster(tree, cut, "distance") - 1
        view.set_clusters(groups, palette.categorical(groups.max() + 1)[groups], cut)

    view.cut_dragged.connect(recut)
    groups = fcluster(tree, 0.008, "distance") - 1
    inks = palette.categorical(groups.max() + 1)[groups]
    view.set_data(matrix, order, tree, [f"M{k}" for k in range(100)], 0.008, groups, inks)
    view.show()
    app.processEvents()  # type: ignore[attr-defined]
    area, scale = view.places().tree, view.height_scale()
    x = area.center().x() + 3
    QTest.mousePress(view, Qt.MouseButton.LeftButton, pos=QPointF(x, scale.at(8.0)).toPoint())

    def drag(k: int) -> None:
        y = area.top() + 5 + (area.height() - 10) * (0.5 + 0.45 * np.sin(0.3 * k))
        QTest.mouseMove(view, QPointF(x, y).toPoint())

    return [("affinity: cut dragged at 100 markers, groups and all", drag, 100)]


def angles(app: object) -> list:
    from markerscope.widgets.gallery.plots import curves

    view = curves()
    view.resize(1100, 500)
    view.show()
    view.set_shown(["Hip flexion", "Knee flexion", "Ankle dorsiflexion"])  # type: ignore[attr-defined]
    return [("angles: cursor step, three plots", lambda k: view.set_time(0.05 * (k % 200)), 200)]  # type: ignore[attr-defined]


def table(app: object) -> list:
    from PySide6.QtCore import Qt

    from markerscope.widgets.gallery.tables import marker_rows
    from markerscope.widgets.tables.markers import MarkerTable

    view = MarkerTable()
    view.resize(900, 400)
    view.show()
    orders = (Qt.SortOrder.AscendingOrder, Qt.SortOrder.DescendingOrder)
    return [
        ("table: 100 markers anew", lambda k: view.set_rows(marker_rows(100)), 20),
        ("table: sorted", lambda k: view.table.view.sortByColumn(k % 8, orders[k % 2]), 30),
    ]


if __name__ == "__main__":
    main()
