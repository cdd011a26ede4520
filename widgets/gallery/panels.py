"""Examples of the cards, bars and lists."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette
from markerscope.widgets.panels.hypotheses import HypothesesView
from markerscope.widgets.panels.hypothesis_data import Hypothesis, Term
from markerscope.widgets.panels.scene_bar import Choice, SceneBar
from markerscope.widgets.panels.stage_data import EarlierResult, FieldSpec, StageData, StageProgress
from markerscope.widgets.panels.stage_panel import StagePanel
from markerscope.widgets.panels.transport import Readout, Transport

SEGMENT = (
    FieldSpec(
        "threshold", "Threshold", "float", 6.5, 8.0, "mm", 0.1, 100.0,
        help="average standard deviation of distance at which the tree is cut",
    ),
    FieldSpec("groups", "Groups", "int", None, None, "", 1, 60, optional=True, help="cut into this many instead"),
    FieldSpec("far", "Far", "float", 350.0, 350.0, "mm", 0.0, 2000.0, help="pairs further apart are held apart"),
    FieldSpec("keep", "Keep the measured points", "bool", True, True, help="do not smooth"),
    FieldSpec("convention", "Convention", "choice", "opensim", "opensim", choices=("opensim", "isb", "plugin-gait")),
    FieldSpec("span", "Range", "range", (2.0, 14.5), (None, None), "s", 0.0, 60.0, help="part of the recording"),
)  # fmt: skip
STAGES = (
    StageData("markers", "Markers", "cached", 0.03, "41 markers, 60.0 s at 100 Hz, 3.2 % lost"),
    StageData("clean", "Cleaning", "stale", 1.34, "214 points taken out, 5 gaps filled"),
    StageData(
        "segment", "Segmentation", "cached", 0.41, "11 groups of 41 markers at 6.5 mm", SEGMENT,
        (
            EarlierResult("a1", "threshold 6.5 mm", "today 14:02", "11 groups", current=True),
            EarlierResult("b2", "threshold 8 mm", "today 13:48", "9 groups", compared=True),
        ),
        help="Groups markers that move rigidly together",
    ),
    StageData(
        "sync", "Synchronisation", "check", 0.4, "marker time = video time -8.000 s",
        checks=("The offset is not sure (confidence 0.00).",),
    ),
    StageData("orient", "Orientation", "running", None, "", why_not="stages are running; wait for them, or stop them"),
    StageData(
        "fit", "Fit", "failed", 3.2,
        "The fit stopped at marker LANK, frame 112: no group covers the left shank. Merge groups, run again.",
    ),
    StageData("angles", "Joint angles"),
)  # fmt: skip


def stages() -> QWidget:
    """A stage in every state; one is open."""
    made = StagePanel()
    made.set_stages(STAGES)
    made.set_progress("orient", StageProgress(0.42, "candidate 5 of 12", 38.0))
    made.card("segment").set_open(True)
    made.resize(max(390, made.minimumSizeHint().width()), 820)
    return made


TERMS = (
    ("markers", "markers to skin"),
    ("video", "video landmarks"),
    ("prior", "likely poses"),
    ("time", "smoothness"),
)


def hypotheses() -> QWidget:
    """Four yaws; the second is the runner-up."""
    rng = np.random.default_rng(6)
    cards: list[Hypothesis] = []
    inks = palette.categorical(4)
    for k in range(4):
        values = rng.uniform(0.005, 0.03, 4) * (1 + 0.35 * k)
        terms = tuple(
            Term(*name, "How much it adds.", float(v), tuple(ink.tolist())) for name, v, ink in zip(TERMS, values, inks)
        )
        energy = float(values.sum())
        first = cards[0].energy if cards else energy
        cards.append(
            Hypothesis(k, "pelvis and both legs", 90.0 * k - 134, energy, terms, energy / first, k == 3, k == 1, k == 0)
        )
    made = HypothesesView()
    picture = QImage(320, 240, QImage.Format.Format_RGB32)
    picture.fill(0x8899AA)
    made.set_cards(
        cards, [picture, picture, None, picture], "The first is ahead of the best other answer by 1.4 times."
    )
    made.set_selected(1)
    made.resize(900, made.sizeHint().height())
    return made


def transport() -> QWidget:
    """Playing at half speed."""
    made = Transport()
    made.set_readouts(Readout(1234, 6000, 12.34), Readout(370, 1800, 12.345))
    made.set_state(True, 0.5, True)
    made.resize(max(760, made.sizeHint().width()), made.sizeHint().height())
    return made


def scene_bar() -> QWidget:
    """Colours by bone, trails on."""
    made = SceneBar(
        [Choice("cluster", "Group", "1", "Who moves together"), Choice("bone", "Bone", "2", "What they sit on")],
        [Choice("body", "Body", "B", "The fitted skin"), Choice("trails", "Trails", "T", "Where the markers were")],
        [Choice("front", "From the front", "Ctrl+1", "Look from the front")],
        {"tool": "Q", "follow": "J", "opacity": "O, Shift+O", "trail": "Ctrl+T, Shift+T"},
    )
    made.set_state(True, "bone", ("body", "trails"), 0.6, 0.5, False)
    made.resize(made.sizeHint())
    return made


EXAMPLES = {"stages": stages, "hypotheses": hypotheses, "transport": transport, "scene_bar": scene_bar}
