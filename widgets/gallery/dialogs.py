"""Examples of the dialogs, messages and pages."""

from __future__ import annotations

import numpy as np
from PySide6.QtWidgets import QVBoxLayout, QWidget

from markerscope.widgets.dialogs.command_palette import CommandPalette, PaletteEntry
from markerscope.widgets.dialogs.export_dialog import ExportDialog, ExportFormat
from markerscope.widgets.dialogs.import_data import ImportShown
from markerscope.widgets.dialogs.import_dialog import ImportDialog
from markerscope.widgets.dialogs.shortcut_sheet import ShortcutSheet
from markerscope.widgets.panels.history import HistoryList
from markerscope.widgets.panels.message_bar import Message, MessageBar
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_data import StageProgress
from markerscope.widgets.panels.welcome import Recent, WelcomePage

ENTRIES = (
    PaletteEntry("play", "Play or stop", "Space", "Go along the clock"),
    PaletteEntry("merge", "Merge groups", "M", "Make the selected groups one", False, "select two groups"),
    PaletteEntry("markers", "Open markers...", "Ctrl+O", "Begin a session from a marker file"),
    PaletteEntry("csv", "Export angles as CSV...", "", "Joint angles in degrees, one row a frame"),
    PaletteEntry("front", "Camera from the front", "1", "Look along the y axis"),
    PaletteEntry("run", "Run all stages", "F5", "Compute what is missing or stale"),
    PaletteEntry("undo", "Undo", "Ctrl+Z", "Take back the last decision"),
)
FORMATS = (
    ExportFormat("angles", "Joint angles (CSV)", ("angles.csv", "angles.json"),
                 "One row a frame, degrees; convention beside it", True),
    ExportFormat("mot", "OpenSim motion (MOT)", ("angles.mot",), "Degrees and metres, for gait models"),
    ExportFormat("c3d", "Labelled markers (C3D)", ("markers_labelled.c3d",), "Each named after its bone, mm", True),
    ExportFormat("bvh", "Skeleton (BVH)", ("motion.bvh",), "Joint rotations in degrees, lengths in cm"),
    ExportFormat("video", "Video of the scene (MP4)", ("scene.mp4",), why_not="The fit has not been run."),
)  # fmt: skip


def person() -> np.ndarray:
    """(41, 3) m: points on two legs, a trunk and two arms."""
    rng = np.random.default_rng(1)
    ends = [
        ((0.1, 0, 0.05), (0.09, 0, 0.95)), ((-0.1, 0, 0.05), (-0.09, 0, 0.95)), ((0, 0, 0.95), (0, 0, 1.55)),
        ((0.2, 0, 1.4), (0.5, 0.2, 1.0)), ((-0.2, 0, 1.4), (-0.5, 0.2, 1.0)),
    ]  # fmt: skip
    along = rng.random((41, 1))
    a, b = (np.array([ends[k % 5][side] for k in range(41)]) for side in (0, 1))
    points = a + along * (b - a) + rng.normal(0, 0.05, (41, 3)) * (1, 1, 0)
    points[7] = np.nan
    return points


def import_dialog() -> QWidget:
    """A C3D file that does not name its units."""
    made = ImportDialog()
    measured = np.clip(np.random.default_rng(2).beta(9, 1, 41), 0, 1)
    measured[7] = 0.004
    labels = tuple(f"*{k + 1}" for k in range(41))
    notes = ("The file does not say its units; a person 1.5 m tall speaks for mm.", "The up-axis is the file's.")
    made.set_shown(ImportShown("squat.c3d", labels, measured, person(), 6000, "mm", None, "z", "z", 100.0, notes=notes))
    item = made.points.topLevelItem(7)
    assert item is not None
    made._tick(0.05)
    made.resize(made.sizeHint())
    return made


def export_dialog() -> QWidget:
    """Two of five formats chosen, one file there already."""
    made = ExportDialog(FORMATS, "/home/lab/squat.results")
    made.set_existing(["angles.csv"])
    made.resize(made.sizeHint())
    return made


def messages() -> QWidget:
    """An error, a warning and a note over a strip of progress."""
    made, bar, strip = QWidget(), MessageBar(), ProgressStrip()
    layout = QVBoxLayout(made)
    layout.addWidget(bar)
    layout.addStretch(1)
    layout.addWidget(strip)
    bar.show_message(Message("info", "The video starts 2.87 s after the markers", "found from the motion"))
    bar.show_message(
        Message(
            "warning",
            "Two headings explain the markers nearly alike",
            "stage Orientation",
            "look at both hypotheses",
            "Show",
        )
    )
    bar.show_message(
        Message("error", "The file ends in the middle of a frame", "walk.c3d, frame 1204", "export it again", "Retry")
    )
    strip.set_progress(StageProgress(0.37, "candidate 5 of 12", 42.0), "Orientation")
    made.resize(760, 240)
    return made


def welcome() -> QWidget:
    """With recent sessions, one of them gone."""
    made = WelcomePage()
    made.set_recent([
        Recent("/home/lab/squat.markerscope", "squat", "/home/lab, today"),
        Recent("/home/lab/gait_07.markerscope", "gait_07", "/home/lab, last week"),
        Recent("/media/stick/jump.markerscope", "jump", present=False),
    ])  # fmt: skip
    made.resize(made.sizeHint())
    return made


def history() -> QWidget:
    """Five decisions, the last two undone."""
    made = HistoryList()
    sentences = (
        "Cut the tree at 6.5 mm", "Merge the groups of M03 and M12", "Leave out M40", "Pin candidate 2",
        "Offset 2.87 s",
    )  # fmt: skip
    made.set_history(sentences, 3)
    made.resize(made.sizeHint())
    return made


def palette() -> QWidget:
    """What "ex" finds."""
    made = QWidget()
    made.resize(760, 460)
    shown = CommandPalette(made)
    shown.open_with(ENTRIES)
    shown.line.setText("o")
    return made


def shortcuts() -> QWidget:
    """Three groups."""
    made = ShortcutSheet({
        "Playing": [("Space", "Play or stop"), ("Left, Right", "One frame"), ("Shift+Left, Shift+Right", "Ten frames")],
        "Camera": [("1", "From the front"), ("2", "From the side"), ("F", "Fit the body into the view")],
        "Session": [("Ctrl+S", "Save"), ("Ctrl+Z", "Undo"), ("Ctrl+K", "Search for an action"), ("F1", "This sheet")],
    })  # fmt: skip
    made.resize(made.sizeHint())
    return made


EXAMPLES = {
    "import": import_dialog,
    "export": export_dialog,
    "messages": messages,
    "welcome": welcome,
    "history": history,
    "command_palette": palette,
    "shortcuts": shortcuts,
}
