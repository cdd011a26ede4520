"""Examples of the plots."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.panels.track_editor import TrackEditor
from markerscope.widgets.plots.affinity import AffinityView
from markerscope.widgets.plots.angle_data import AngleCurve, AnglePlot
from markerscope.widgets.plots.convergence import ConvergenceView
from markerscope.widgets.plots.convergence_data import EnergyCurve
from markerscope.widgets.plots.curves import CurvesView
from markerscope.widgets.plots.marker_curve_data import (
    KIND_TITLES,
    CurvePicture,
    CurvePlot,
    Line,
    ProposalRow,
    Shade,
    Way,
)
from markerscope.widgets.plots.marker_curves import MarkerCurvesView
from markerscope.widgets.plots.pair import PairPlot
from markerscope.widgets.plots.rows import Curve, CurveRow, OffsetRow, PresenceRow, StateRow
from markerscope.widgets.plots.timelines import Timelines


def session_rows(frames: int = 1800, markers: int = 24, rate: float = 30.0) -> list:
    """Made-up rows of every kind: 24 markers in six groups, with gaps, fills and outliers."""
    rng = np.random.default_rng(4)
    time = np.arange(frames) / rate
    present = np.ones((frames, markers), bool)
    for marker in range(markers):
        for start in rng.integers(0, frames, rng.poisson(frames / 600)):
            present[start : start + int(rng.exponential(25)) + 1, marker] = False
    present[: frames // 4, 5] = False
    filled = ~present & (rng.random((1, markers)) < 0.6)
    filled[: frames // 4, 5] = False
    outlier = (rng.random((frames, markers)) < 4e-4) & present
    groups = np.sort(rng.integers(0, 6, markers))
    tracked = np.zeros(frames, np.uint8)
    tracked[frames // 3 : frames // 3 + frames // 12] = 1
    slow = np.interp(time, np.linspace(0, time[-1], 40), rng.random(40))
    quick = np.abs(np.interp(time, np.linspace(0, time[-1], 90), rng.standard_normal(90)))
    colours = palette.categorical(4)
    ours = 6 + 3 * slow + rng.normal(0, 0.3, frames)
    ours[~present.any(axis=1)] = np.nan
    theirs = 11 + 6 * slow + rng.normal(0, 0.5, frames)
    theirs[frames // 2 : frames // 2 + 60] = np.nan
    return [
        StateRow(
            "Video", time, tracked, np.array([palette.GOOD, palette.GAP]), ("person tracked", "person lost"),
            "Where the pose network saw a person in the video.",
        ),
        PresenceRow(
            "Markers", time, present, filled, outlier, palette.categorical(6)[groups],
            tuple(f"M{k:02d}" for k in range(markers)), "A strip a marker: seen, lost, filled, taken out.",
        ),
        CurveRow(
            "Residual", time,
            (Curve("fit, 8 mm cut", ours, colours[0]), Curve("published method", theirs, colours[1])),
            "mm", help="Mean distance of the markers from where the body says they are.",
        ),
        OffsetRow(
            "Video offset", 0.0, 0.8 * time[-1], 3.214, 2.87,
            fixed=Curve("markers", quick, np.array(palette.LOST), time),
            moving=Curve("video", quick[90:], np.array(palette.LEFT), time[: frames - 90]),
            help="How far the video's clock is behind the markers'.",
        ),
    ]  # fmt: skip


def timelines() -> QWidget:
    """All kinds of rows, zoomed in a little, with a loop range."""
    made = Timelines()
    made.set_span(0, 60)
    made.set_rows(session_rows())
    made.set_view(5, 48)
    made.set_range((14, 31))
    made.set_time(21.3)
    made.set_selected([8, 9, 15])
    made.resize(1100, 430)
    return made


def rigid_groups(markers: int = 30, groups: int = 7) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A made-up matrix (M, M) m of groups that move rigidly, its linkage and the order of its tree."""
    from scipy.cluster.hierarchy import leaves_list, linkage
    from scipy.spatial.distance import squareform

    rng = np.random.default_rng(2)
    group = rng.integers(0, groups, markers)
    between = rng.uniform(0.02, 0.16, (groups, groups))
    matrix = np.where(group[:, None] == group, 0.003, np.maximum(between, between.T)[group][:, group])
    matrix = matrix * rng.uniform(0.5, 1.6, (markers, markers))
    matrix = np.triu(matrix, 1)
    matrix += matrix.T
    tree = linkage(squareform(matrix), "average")
    return matrix, tree, leaves_list(tree)


def affinity_view() -> QWidget:
    """30 markers; the groups follow the cut."""
    from scipy.cluster.hierarchy import fcluster

    matrix, tree, order = rigid_groups()
    made = AffinityView()

    def groups_at(cut: float) -> np.ndarray:
        found = fcluster(tree, cut, "distance")[order]
        first = {group: k for k, group in enumerate(dict.fromkeys(found.tolist()))}
        groups = np.zeros(len(order), int)
        groups[order] = [first[group] for group in found.tolist()]
        return groups

    def recut(cut: float) -> None:
        groups = groups_at(cut)
        made.set_clusters(groups, palette.categorical(groups.max() + 1)[groups], cut)

    made.cut_dragged.connect(recut)
    groups = groups_at(0.008)
    inks = palette.categorical(groups.max() + 1)[groups]
    made.set_data(matrix, order, tree, [f"M{k:02d}" for k in range(30)], 0.008, groups, inks)
    made.set_selected([int(order[3])], (int(order[3]), int(order[12])))
    made.resize(560, 620)
    return made


def pair_plot() -> QWidget:
    """A pair that is nearly rigid, with a gap."""
    made, time = PairPlot(), np.arange(600) / 30
    distance = 0.183 + 0.002 * np.sin(2 * time) + np.random.default_rng(1).normal(0, 4e-4, 600)
    distance[200:260] = np.nan
    made.set_pair("M03", "M12", time, distance)
    made.set_time(12.3)
    made.resize(560, 170)
    return made


def curves() -> QWidget:
    """Legs over 12 s, with another result dashed."""
    time = np.arange(360) / 30
    rng = np.random.default_rng(8)
    plots = []
    for joint, names in {
        "pelvis": ("tilt", "obliquity", "rotation"), "hip": ("flexion", "adduction", "rotation"), "knee": ("flexion",),
        "ankle": ("dorsiflexion", "inversion"), "shoulder": ("flexion", "abduction"), "elbow": ("flexion",),
    }.items():  # fmt: skip
        for name in names:
            made = []
            for side, ink in (
                (("", palette.LEFT),) if joint == "pelvis" else (("left", palette.LEFT), ("right", palette.RIGHT))
            ):
                size, lag = rng.uniform(8, 45), rng.uniform(0, 1)
                degrees = size * (1 - np.cos(1.6 * time + lag)) + rng.normal(0, 0.4, 360)
                degrees[100:130] = np.nan if side == "right" else degrees[100:130]
                rests = "video only" if side == "left" and joint == "ankle" else ""
                error = 1.5 + 0.03 * size * (1 + np.sin(time)) if not rests else np.full(360, 9.0)
                compared = degrees * 0.93 + 3
                made.append(AngleCurve(f"{joint}_{name}_{side[:1]}", side, degrees, compared, name, rests, ink, error))
            plots.append(AnglePlot(joint, f"{joint.capitalize()} {name}", tuple(made)))
    view = CurvesView()
    view.set_curves(time, plots, "OpenSim gait model", "the T pose")
    view.set_time(5.3)
    view.resize(980, 430)
    return view


def marker_curve_picture(frames: int = 900) -> CurvePicture:
    """Two markers with a gap that is previewed in two ways, and one that was filled."""
    time, rng = np.arange(frames) / 60, np.random.default_rng(2)
    plots, inks = [], [(0, 114, 178), (230, 159, 0)]
    for title in "xyz":
        lines = []
        for label, ink in zip(("LKNE", "LANK"), inks):
            truth = 300 * np.sin(2 * time + rng.uniform(0, 6)) + rng.uniform(-400, 400)
            own, filled = truth.copy(), np.full(frames, np.nan)
            own[400:440] = own[600:620] = np.nan
            filled[599:621] = truth[599:621]
            lines += [Line("raw", label, truth + rng.normal(0, 1, frames), ink), Line("body", label, truth + 12, ink)]
            lines += [Line("measured", label, own, ink), Line("filled", label, filled, ink)]
        for strong in (False, True):
            course = truth[399:441] + (0 if strong else 30) * np.sin(np.linspace(0, np.pi, 42))
            lines.append(Line("preview", "LANK", course, inks[1], 399, strong))
        plots.append(CurvePlot(title, "mm", tuple(lines)))
    shades = [Shade(400, 439, "gap", "LANK", inks[1], True), Shade(600, 619, "filled", "LANK", inks[1])]
    shades += [Shade(700, 702, "outlier", "LKNE", inks[0])]
    names = tuple(zip(("LKNE", "LANK"), inks))
    return CurvePicture(time, tuple(plots), tuple(shades), names, "", frozenset(KIND_TITLES))


def marker_curves() -> QWidget:
    """With what stands beside them."""
    editor = TrackEditor()
    ways = [Way("rigid", "Rigid body of the neighbours", "0.8 mm"), Way("spline", "Spline", "2.4 mm")]
    editor.set_gap("LANK, frames 400 to 439 (0.667 s)", [*ways, Way("body", "Fitted body", why_not="there is no fit")])
    editor.set_proposals((ProposalRow("LKNE and LANK look exchanged from 4.2 s on.", "4.20 s", "proposed"),), "")
    editor.histogram.set_lengths("LANK: 60 gaps", np.repeat([1, 3, 6, 20, 70], [30, 15, 8, 6, 1]), 60.0)
    view = MarkerCurvesView(editor)
    view.window_of_time.set_span(0.0, 15.0)
    view.set_picture(marker_curve_picture())
    view.window_of_time.set_time(7.0)
    view.resize(1100, 430)
    return view


def convergence() -> QWidget:
    """Five candidates, of which the lowest is scrubbed."""
    iteration = np.unique(np.geomspace(1, 400, 90).astype(int)) - 1
    made = ConvergenceView()
    found = [
        EnergyCurve(
            "refine", f"candidate {k + 1}, heading {60 * k}°",
            iteration, 0.09 + 0.03 * k + 2.5 * np.exp(-iteration / (8 + 6 * k)), tuple(ink.tolist()), "converged",
        )
        for k, ink in enumerate(palette.categorical(5))
    ]  # fmt: skip
    made.set_curves(found)
    made.set_iteration(1, 37)
    made.resize(520, 420)
    return made


EXAMPLES = {
    "marker_curves": marker_curves,
    "curves": curves,
    "convergence": convergence,
    "timelines": timelines,
    "affinity": affinity_view,
    "pair": pair_plot,
}
