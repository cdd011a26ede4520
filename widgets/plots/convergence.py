"""How each descent went down, and a slider that goes along one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from PySide6.QtCore import QSignalBlocker, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QIcon, QPixmap
from PySide6.QtWidgets import QComboBox, QHBoxLayout, QLabel, QSlider, QToolButton, QVBoxLayout, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.plots.convergence_data import EnergyCurve
from markerscope.widgets.plots.convergence_plot import ConvergencePlot, energy_text
from markerscope.widgets.plots.ink import colour

_STEP_MS, _PLAY_STEPS = 40, 120
"""Playing takes some five seconds however many iterations there were."""


class ConvergenceView(QWidget):
    """Stages to choose from, the curves of one, and the slider.

    Signals
    -------
    iteration_chosen(curve, iteration) : number of the curve as given, and where on it
    stage_chosen(stage)
    """

    iteration_chosen = Signal(int, int)
    stage_chosen = Signal(str)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName("Convergence")
        self._curves: tuple[EnergyCurve, ...] = ()
        self._rows: list[int] = []
        self.stage, self.curve = QComboBox(), QComboBox()
        self.stage.setAccessibleName("Stage of the solve")
        self.stage.setToolTip("Only curves of one stage have the same energy")
        self.curve.setAccessibleName("Candidate")
        self.curve.setToolTip("The descent that the slider goes along")
        self.plot = ConvergencePlot()
        self.play = QToolButton()
        self.play.setIcon(icon("play"))
        self.play.setToolTip("Play the iterations")
        self.play.setAccessibleName("Play the iterations")
        self.play.setCheckable(True)
        self.slider = QSlider(Qt.Orientation.Horizontal)
        self.slider.setAccessibleName("Iteration")
        self._said = QLabel()
        self._said.setWordWrap(True)
        self._timer = QTimer(self)
        self._timer.setInterval(_STEP_MS)
        self._timer.timeout.connect(self._advance)
        top, bottom = QHBoxLayout(), QHBoxLayout()
        top.addWidget(self.stage, 1)
        top.addWidget(self.curve, 1)
        bottom.addWidget(self.play)
        bottom.addWidget(self.slider, 1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(4, 4, 4, 4)
        layout.setSpacing(4)
        layout.addLayout(top)
        layout.addWidget(self.plot, 1)
        layout.addLayout(bottom)
        layout.addWidget(self._said)
        self.stage.activated.connect(self._choose_stage)
        self.curve.activated.connect(lambda k: self._choose(self._rows[k], self.slider.maximum(), tell=True))
        self.plot.pointed.connect(lambda k, iteration: self._choose(self._rows[k], iteration, tell=True))
        self.slider.valueChanged.connect(lambda k: self._choose(self.chosen(), k, tell=True))
        self.play.toggled.connect(self._play)

    def set_curves(self, curves: Sequence[EnergyCurve], preferred: str = "") -> None:
        """Show descents; more may come.

        Where no stage was chosen before, it is the ``preferred`` one, else the last.
        """
        stage, chosen, at = self.stage.currentText(), self.curve.currentText(), self.slider.value()
        at_end = at == self.slider.maximum() or self.chosen() < 0
        self._curves = tuple(curves)
        stages = list(dict.fromkeys(curve.stage for curve in curves))
        self.stage.clear()
        self.stage.addItems(stages)
        wanted = stage if stage in stages else preferred
        self.stage.setCurrentIndex(stages.index(wanted) if wanted in stages else len(stages) - 1)
        self._fill(chosen, None if at_end else at)

    def set_iteration(self, curve: int, iteration: int) -> None:
        """Show a place on a curve; nothing is emitted."""
        if 0 <= curve < len(self._curves):
            self.stage.setCurrentText(self._curves[curve].stage)
            self._fill(self._curves[curve].label, iteration)

    def chosen(self) -> int:
        """Number of the chosen curve, -1 for none."""
        row = self.curve.currentIndex()
        return self._rows[row] if 0 <= row < len(self._rows) else -1

    def sizeHint(self) -> QSize:
        """A dock."""
        return QSize(460, round(22 * self.fontMetrics().height()))

    def _choose_stage(self) -> None:
        self._fill(self.curve.currentText(), None)
        self.stage_chosen.emit(self.stage.currentText())
        self._tell()

    def _fill(self, label: str, iteration: int | None) -> None:
        """Offer the curves of the stage; choose the one of that label, or the lowest."""
        self._rows = [k for k, curve in enumerate(self._curves) if curve.stage == self.stage.currentText()]
        self.curve.clear()
        for k in self._rows:
            swatch = QPixmap(12, 12)
            swatch.fill(colour(self._curves[k].colour))
            self.curve.addItem(QIcon(swatch), self._curves[k].label)
        self.plot.set_curves([self._curves[k] for k in self._rows])
        ends = [float(e[-1]) if len(e := self._curves[k].energy) else np.inf for k in self._rows]
        labels = [self._curves[k].label for k in self._rows]
        if self._rows:
            row = labels.index(label) if label in labels else int(np.argmin(ends))
            last = self._curves[self._rows[row]].iteration
            self._choose(self._rows[row], iteration if iteration is not None else (int(last[-1]) if len(last) else 0))
        for control in (self.stage, self.curve, self.slider, self.play):
            control.setEnabled(bool(self._rows))
        self._said.setVisible(bool(self._rows))

    def _choose(self, curve: int, iteration: int, tell: bool = False) -> None:
        if curve < 0:
            return
        row, found = self._rows.index(curve), self._curves[curve]
        last = int(found.iteration[-1]) if len(found.iteration) else 0
        self.curve.setCurrentIndex(row)
        with QSignalBlocker(self.slider):
            self.slider.setRange(0, last)
            self.slider.setValue(iteration)
        at = self.slider.value()
        self.plot.set_cursor(row, at)
        k = max(0, int(np.searchsorted(found.iteration, at, side="right")) - 1)
        energy = energy_text(float(found.energy[k])) if len(found.energy) else "–"
        ended = f" It ended: {found.ended}." if found.ended and at == last else ""
        self._said.setText(f"Iteration {at} of {last}, energy {energy}.{ended}")
        if tell:
            self._tell()

    def _tell(self) -> None:
        if self.chosen() >= 0:
            self.iteration_chosen.emit(self.chosen(), self.slider.value())

    def _play(self, on: bool) -> None:
        self.play.setIcon(icon("pause" if on else "play"))
        if on and self.slider.value() >= self.slider.maximum():
            self.slider.setValue(0)
        self._timer.start() if on else self._timer.stop()

    def _advance(self) -> None:
        if self.slider.value() >= self.slider.maximum():
            self.play.setChecked(False)
        else:
            self.slider.setValue(self.slider.value() + max(1, self.slider.maximum() // _PLAY_STEPS))
