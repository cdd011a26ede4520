"""One line at the foot of the window: what runs, how far it is, and a way to stop it."""

from __future__ import annotations

from PySide6.QtCore import Signal
from PySide6.QtWidgets import QHBoxLayout, QLabel, QProgressBar, QSizePolicy, QToolButton, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.panels.bar import show_part
from markerscope.widgets.panels.stage_data import StageProgress, left


class ProgressStrip(QWidget):
    """Empty while nothing runs.

    Signals
    -------
    stop()
    """

    stop = Signal()

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Progress")
        self.label, self.bar, self.stop_button = QLabel(), QProgressBar(), QToolButton()
        self.label.setSizePolicy(QSizePolicy.Policy.Ignored, QSizePolicy.Policy.Preferred)
        self.bar.setFixedWidth(round(10 * self.fontMetrics().height()))
        self.bar.setAccessibleName("Part that is done")
        self.stop_button.setIcon(icon("stop"))
        self.stop_button.setAutoRaise(True)
        self.stop_button.setToolTip("End the run; what was computed before stays")
        self.stop_button.setAccessibleName("Stop the run")
        self.stop_button.clicked.connect(self.stop)
        for part in (self.bar, self.stop_button):  # else the whole window would be laid out anew at each run's end
            policy = part.sizePolicy()
            policy.setRetainSizeWhenHidden(True)
            part.setSizePolicy(policy)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(6, 0, 6, 0)
        layout.addWidget(self.label, 1)
        layout.addWidget(self.bar)
        layout.addWidget(self.stop_button)
        self.set_progress(None)

    def set_progress(self, progress: StageProgress | None, title: str = "") -> None:
        """Show how far the stage ``title`` is, or that nothing runs."""
        self.bar.setVisible(progress is not None)
        self.stop_button.setVisible(progress is not None)
        if progress is None:
            self.label.setText(title)
            return
        show_part(self.bar, progress.part)
        parts = [progress.text, "" if progress.seconds_left is None else left(progress.seconds_left)]
        said = ", ".join(part for part in parts if part)
        self.label.setText(": ".join(part for part in (title, said) if part))
        self.label.setToolTip(self.label.text())
