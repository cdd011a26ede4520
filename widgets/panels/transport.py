"""The bar that plays, steps and loops, and says where both streams are."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, QSize, Signal
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QSizePolicy, QToolButton, QVBoxLayout, QWidget

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.plots.scales import clock

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True)
class Readout:
    """Where a stream is.

    Attributes
    ----------
    frame : counted from 0 as everywhere else, None where the stream has none now
    frames : how many there are
    time : s on its own clock
    """

    frame: int | None
    frames: int
    time: float = 0.0

    def text(self, name: str) -> str:
        """As the bar says it."""
        if self.frames <= 0:
            return f"{name} –"
        if self.frame is None:
            return f"{name} none now"
        return f"{name} {self.frame} / {self.frames - 1}   {clock(self.time, 0.001)}"


class Transport(QWidget):
    """Buttons, speed and both readouts; the keys are the window's.

    Signals
    -------
    play_toggled() : play or stop
    stepped(frames) : so many frames of the markers on, or back
    start_wanted(), end_wanted()
    speed_chosen(speed) : times real time
    loop_toggled(on)
    """

    play_toggled = Signal()
    stepped = Signal(int)
    start_wanted = Signal()
    end_wanted = Signal()
    speed_chosen = Signal(float)
    loop_toggled = Signal(bool)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Playback")
        self._reasons: Mapping[str, str] = {}
        self._tips: dict[str, str] = {}
        self.to_start = self._button("to_start", "To the start (Home)")
        self.back = self._button("step_back", "One frame back (Left; with Shift ten)")
        self.play = self._button("play", "Play (Space)")
        self.forward = self._button("step_forward", "One frame on (Right; with Shift ten)")
        self.to_end = self._button("to_end", "To the end (End)")
        self.loop = self._button("loop", "Loop over the range, or over all")
        for name in ("to_start", "back", "play", "forward", "to_end"):
            self._tips[name] = getattr(self, name).toolTip()
        self.loop.setCheckable(True)
        self.speed = QComboBox()
        self.speed.setAccessibleName("Speed of playing, times real time")
        self.speed.setToolTip("Speed, times real time (comma and full stop)")
        for speed in SPEEDS:
            self.speed.addItem(f"{speed:g}×", speed)
        self.markers, self.video = QLabel(), QLabel()
        self.markers.setToolTip("Frame of the markers, of how many, and the time on their clock")
        self.video.setToolTip("Frame of the video shown, of how many, and the time on the video's own clock")
        for label in (self.markers, self.video):
            font = label.font()
            font.setStyleHint(font.StyleHint.Monospace)
            label.setFont(font)
            label.setSizePolicy(QSizePolicy.Policy.Minimum, QSizePolicy.Policy.Preferred)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(6, 2, 6, 2)
        layout.setSpacing(3)
        for button in (self.to_start, self.back, self.play, self.forward, self.to_end):
            layout.addWidget(button)
        layout.addSpacing(8)
        layout.addWidget(self.speed)
        layout.addWidget(self.loop)
        layout.addStretch(1)
        readouts = QVBoxLayout()
        readouts.setSpacing(0)
        readouts.addWidget(self.markers)
        readouts.addWidget(self.video)
        layout.addLayout(readouts)
        self.play.clicked.connect(self.play_toggled)
        self.back.clicked.connect(lambda: self.stepped.emit(-1))
        self.forward.clicked.connect(lambda: self.stepped.emit(1))
        self.to_start.clicked.connect(self.start_wanted)
        self.to_end.clicked.connect(self.end_wanted)
        self.loop.toggled.connect(self.loop_toggled)
        self.speed.activated.connect(lambda k: self.speed_chosen.emit(float(self.speed.itemData(k))))
        self._playing = False
        self.set_readouts(Readout(None, 0), Readout(None, 0))
        self.set_state(False, 1.0, False)

    def set_state(self, playing: bool, speed: float, loop: bool) -> None:
        """Show whether it plays, how fast, and whether it loops; nothing is emitted."""
        if playing != self._playing:
            self._playing = playing
            self.play.setIcon(icon("pause" if playing else "play"))
            self._tips["play"] = "Stop (Space)" if playing else "Play (Space)"
            allow(self.play, self._reasons.get("play", ""), self._tips["play"])
            self.play.setAccessibleName("Stop" if playing else "Play")
        with QSignalBlocker(self.speed):
            at = next((k for k in range(self.speed.count()) if abs(self.speed.itemData(k) - speed) < 1e-9), -1)
            if at < 0:
                self.speed.addItem(f"{speed:g}×", speed)
                at = self.speed.count() - 1
            self.speed.setCurrentIndex(at)
        with QSignalBlocker(self.loop):
            self.loop.setChecked(loop)

    def set_reasons(self, reasons: Mapping[str, str]) -> None:
        """Say of the buttons "to_start", "back", "play", "forward", "to_end" why they do nothing now, "" if they do."""
        for name, reason in reasons.items():
            if self._reasons.get(name, "") != reason:
                button: QToolButton = getattr(self, name)
                allow(button, reason, self._tips[name])
        self._reasons = dict(reasons)

    def set_readouts(self, markers: Readout, video: Readout) -> None:
        """Say where both streams are; the labels keep their width while digits change."""
        for label, readout, name in ((self.markers, markers, "Markers"), (self.video, video, "Video")):
            label.setText(readout.text(name))
            widest = readout.text(name) if readout.frames <= 0 else Readout(readout.frames, readout.frames).text(name)
            wide = label.fontMetrics().horizontalAdvance(f"{widest}00:00")
            if label.minimumWidth() < wide:
                label.setMinimumWidth(wide)

    def sizeHint(self) -> QSize:
        """One line of buttons, two of readouts."""
        return QSize(self.layout().sizeHint().width(), self.layout().sizeHint().height())  # type: ignore[union-attr]

    def _button(self, glyph: str, tip: str) -> QToolButton:
        button = QToolButton()
        button.setIcon(icon(glyph))
        side = round(1.3 * self.fontMetrics().height())
        button.setIconSize(QSize(side, side))
        button.setAutoRaise(True)
        button.setToolTip(tip)
        button.setAccessibleName(tip.split(" (")[0])
        return button
