"""x, y and z of markers over time: as in the file, cleaned, filled, and as the body predicts them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from PySide6.QtCore import QPoint, QSize, Qt, Signal
from PySide6.QtWidgets import QFrame, QHBoxLayout, QScrollArea, QToolBar, QToolButton, QVBoxLayout, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.plots.curve_legend import CurveLegend
from markerscope.widgets.plots.marker_curve_data import CurvePicture
from markerscope.widgets.plots.marker_curve_plots import MarkerCurvePlots
from markerscope.widgets.plots.time_window import TimeWindow

OPTIONS: dict[str, tuple[str, bool, str]] = {
    "x": ("x", True, "The laboratory's first horizontal axis"),
    "y": ("y", True, "The laboratory's second horizontal axis"),
    "z": ("z", True, "Upwards"),
    "position": ("Position", True, "Where the markers are"),
    "velocity": ("Velocity", False, "Central difference of the positions; nothing is smoothed"),
    "acceleration": ("Acceleration", False, "Second difference of the positions; nothing is smoothed"),
    "raw": ("Raw", True, "As the file has them, where the cleaned curves are other than that"),
    "filled": ("Filled", True, "Gaps as they were filled, or will be by the next cleaning"),
    "body": ("Body", True, "Where the fitted body has the markers"),
    "metres": ("m", False, "Metres instead of millimetres"),
}
"""What can be shown: word, whether it is at first, and what it means."""
_APART = ("position", "raw", "metres")
_WALKS = (
    ("go.gap_back", "left", "Gap"), ("go.gap", "right", ""), ("go.outlier_back", "left", "Outlier"),
    ("go.outlier", "right", ""),
)  # fmt: skip


class MarkerCurvesView(QWidget):
    """The plots with a bar above them.

    The wheel zooms in time, with Shift it pans, with Ctrl it zooms the values of a plot; the middle button pans. A
    click goes to a moment, a drag marks a range, a double click goes near to a gap, or shows all. Keys: ``+ - 0``.

    Signals
    -------
    seeked(time) : s
    range_marked(range) : (start, end) in s
    view_changed(start, end) : s, the visible part
    options_changed()
    asked(action) : a button asks for an action by its id
    menu_wanted(place) : on the screen
    """

    seeked = Signal(float)
    range_marked = Signal(object)
    view_changed = Signal(float, float)
    options_changed = Signal()
    asked = Signal(str)
    menu_wanted = Signal(QPoint)

    def __init__(self, beside: QWidget | None = None, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Marker curves")
        self.window_of_time = TimeWindow(self)
        self.plots = MarkerCurvePlots(self.window_of_time)
        self.legend = CurveLegend()
        self.setFocusProxy(self.plots)
        self.options: dict[str, QToolButton] = {}
        self.walks: dict[str, QToolButton] = {}
        bar = QToolBar()
        bar.setAccessibleName("What the curves show")
        for name, sign, text in _WALKS:
            button = self.walks[name] = _button(text, "")
            button.setIcon(icon(sign))
            if text:
                button.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
            button.setAccessibleName(name.replace("go.", "").replace("_back", " before"))
            button.clicked.connect(lambda checked=False, name=name: self.asked.emit(name))
            bar.addWidget(button)
        self.reset = _button("Show all", "All of the recording, and values as they are in it: 0 in the plots")
        self.reset.clicked.connect(self.plots.reset)
        bar.addWidget(self.reset)
        bar.addSeparator()
        for name, (text, on, tip) in OPTIONS.items():
            if name in _APART:
                bar.addSeparator()
            button = self.options[name] = _button(text, tip)
            button.setCheckable(True)
            button.setChecked(on)
            button.toggled.connect(self.options_changed)
            bar.addWidget(button)
        scroll = QScrollArea()
        scroll.setWidget(self.plots)
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.NoFrame)
        scroll.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        scroll.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        left = QWidget()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        column.setSpacing(0)
        for part in (bar, self.legend):
            column.addWidget(part)
        column.addWidget(scroll, 1)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(0)
        layout.addWidget(left, 1)
        if beside is not None:
            beside.setMaximumWidth(round(30 * self.fontMetrics().height()))
            layout.addWidget(beside)
        self.plots.seeked.connect(self.seeked)
        self.plots.range_marked.connect(self.range_marked)
        self.plots.menu_wanted.connect(self.menu_wanted)
        self.window_of_time.viewed.connect(lambda: self.view_changed.emit(*self.window_of_time.view))

    def on(self, name: str) -> bool:
        """Whether something of ``OPTIONS`` is shown."""
        return self.options[name].isChecked()

    def state(self) -> dict[str, Any]:
        """What is shown, to be remembered."""
        return {name: button.isChecked() for name, button in self.options.items()}

    def restore(self, state: Any) -> None:
        """Show what ``state`` gave; what cannot be understood is left out."""
        for name, on in state.items() if isinstance(state, dict) else ():
            if name in self.options and isinstance(on, bool):
                self.options[name].setChecked(on)

    def set_picture(self, shown: CurvePicture) -> None:
        """Show these curves."""
        self.plots.set_picture(shown)
        self.legend.set_picture(shown)

    def set_reasons(self, reasons: Mapping[str, tuple[str, str]]) -> None:
        """Why each walk cannot be gone now (empty if it can), and what it does, by the action's id."""
        for name, button in self.walks.items():
            reason, tip = reasons.get(name, ("", ""))
            button.setEnabled(not reason)
            button.setToolTip(f"{tip} Not now: {reason}." if reason else tip)

    def sizeHint(self) -> QSize:
        """A dock across the window."""
        return QSize(900, round(22 * self.fontMetrics().height()))


def _button(text: str, tip: str) -> QToolButton:
    made = QToolButton()
    made.setText(text)
    made.setToolTip(tip)
    made.setAutoRaise(True)
    made.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    made.setAccessibleName(text)
    return made
