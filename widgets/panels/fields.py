"""A form made from records of settings."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

from PySide6.QtCore import QEvent, QSignalBlocker, QTimer, Signal
from PySide6.QtGui import QFont
from PySide6.QtWidgets import (
    QCheckBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.boxes import CountBox, NumberBox
from markerscope.widgets.icons import icon
from markerscope.widgets.panels.controls import control_of, fit, number_box, on_change, read, said, suffix, write
from markerscope.widgets.panels.stage_data import FieldSpec


class Editor(QWidget):
    """The control of one setting, with a way to leave it to the program where that is possible.

    Signals
    -------
    changed(value) : in the unit of the record; None for automatic
    """

    changed = Signal(object)

    def __init__(self, spec: FieldSpec, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.spec = spec
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        self._controls: list[QWidget] = []
        self.automatic: QCheckBox | None = None
        if spec.kind == "range":
            self._controls = [number_box(spec, end) for end in ("from", "to")]
        else:
            self._controls = [control_of(spec)]
        if spec.optional and spec.kind != "range":
            self.automatic = QCheckBox("auto")
            self.automatic.setToolTip("Leave it to the program")
            self.automatic.setAccessibleName(f"{spec.label}: automatic")
            self.automatic.toggled.connect(self._tell)
            layout.addWidget(self.automatic)
        column = QVBoxLayout()
        column.setSpacing(3)
        layout.addLayout(column, 1)
        for control in self._controls:
            column.addWidget(control)
            on_change(control, self._tell)
        self.setFocusProxy(self._controls[0])
        self.set_value(spec.value)

    def value(self) -> Any:
        """What is set."""
        if self.automatic is not None and self.automatic.isChecked():
            return None
        values = [read(control) for control in self._controls]
        return tuple(values) if self.spec.kind == "range" else values[0]

    def set_value(self, value: Any) -> None:
        """Show a value; nothing is emitted."""
        values = value if self.spec.kind == "range" and value is not None else [value] * len(self._controls)
        if self.automatic is not None:
            with QSignalBlocker(self.automatic):
                self.automatic.setChecked(value is None)
        for control, part in zip(self._controls, values):
            with QSignalBlocker(control):
                if part is None and self.spec.kind == "range":
                    control.setValue(control.minimum())  # type: ignore[attr-defined]
                elif part is not None:
                    write(control, part)
        self._grey()

    def fit(self) -> None:
        """Make room for the values in the font there is."""
        for control in self._controls:
            fit(control)

    def _tell(self, *_: object) -> None:
        self._grey()
        self.changed.emit(self.value())

    def _grey(self) -> None:
        """A number that the program chooses is not shown, as it would not be the one."""
        automatic = self.automatic is not None and self.automatic.isChecked()
        for control in self._controls:
            control.setEnabled(not automatic)
            if isinstance(control, NumberBox | CountBox):
                control.blank = automatic
                with QSignalBlocker(control):
                    control.setSuffix("" if automatic else suffix(self.spec))


class SettingsForm(QWidget):
    """Labels, controls and a way back to each default.

    Signals
    -------
    changed(name, value) : the user set something; None for automatic
    """

    changed = Signal(str, object)

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setHorizontalSpacing(8)
        self._grid.setVerticalSpacing(4)
        self._grid.setColumnStretch(1, 1)
        self._editors: dict[str, Editor] = {}
        self._labels: dict[str, QLabel] = {}
        self._resets: dict[str, QToolButton] = {}
        self._fitting = QTimer(self, singleShot=True, interval=0)  # once the controls have the font, too
        self._fitting.timeout.connect(self._fit)

    def set_fields(self, specs: Sequence[FieldSpec]) -> None:
        """Show these settings; controls are kept where only values changed, so that the focus stays."""
        if [_shape(spec) for spec in specs] != [_shape(editor.spec) for editor in self._editors.values()]:
            self._build(specs)
        for spec in specs:
            editor = self._editors[spec.name]
            editor.spec = spec
            editor.set_value(spec.value)
            self._mark(spec)

    def editor(self, name: str) -> Editor:
        """The control of a setting."""
        return self._editors[name]

    def reset_button(self, name: str) -> QToolButton:
        """What sets a setting to its default."""
        return self._resets[name]

    def _build(self, specs: Sequence[FieldSpec]) -> None:
        while (item := self._grid.takeAt(0)) is not None:
            if (old := item.widget()) is not None:
                old.deleteLater()
        self._editors, self._labels, self._resets = {}, {}, {}
        for row, spec in enumerate(specs):
            label, editor, reset = QLabel(spec.label), Editor(spec), QToolButton()
            label.setWordWrap(True)
            _fit_label(label)
            label.setBuddy(editor)
            label.setSizePolicy(QSizePolicy.Policy.Preferred, QSizePolicy.Policy.Preferred)
            reset.setIcon(icon("reset"))
            reset.setAutoRaise(True)
            reset.setAccessibleName(f"{spec.label}: back to the default")
            reset.clicked.connect(partial(self._reset, spec.name))
            editor.changed.connect(partial(self.changed.emit, spec.name))
            for column, part in enumerate((label, editor, reset)):
                self._grid.addWidget(part, row, column)
            self._editors[spec.name], self._labels[spec.name], self._resets[spec.name] = editor, label, reset
            for part in (label, editor, *editor.findChildren(QWidget)):
                if not isinstance(part, QCheckBox) or spec.kind == "bool":
                    part.setToolTip(_tip(spec))

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange) and hasattr(self, "_fitting"):
            self._fitting.start()

    def _fit(self) -> None:
        for label, editor in zip(self._labels.values(), self._editors.values()):
            _fit_label(label)
            editor.fit()

    def _mark(self, spec: FieldSpec) -> None:
        """Show what differs from its default by bold type and a way back."""
        changed, label = spec.value != spec.default, self._labels[spec.name]
        font = QFont(label.font())
        font.setBold(changed)
        label.setFont(font)
        self._resets[spec.name].setEnabled(changed)
        self._resets[spec.name].setToolTip(f"Back to the default, {said(spec, spec.default)}")

    def _reset(self, name: str) -> None:
        spec = self._editors[name].spec
        self._editors[name].set_value(spec.default)
        self.changed.emit(name, spec.default)


def _fit_label(label: QLabel) -> None:
    metrics = label.fontMetrics()
    label.setMinimumWidth(min(metrics.horizontalAdvance(label.text()) + 8, 7 * metrics.height()))


def _shape(spec: FieldSpec) -> tuple:
    return (spec.name, spec.label, spec.kind, spec.unit, spec.minimum, spec.maximum, spec.choices, spec.optional)


def _tip(spec: FieldSpec) -> str:
    ends = [f"{end:g}" if end is not None else "" for end in (spec.minimum, spec.maximum)]
    span = f" Range: {ends[0]} to {ends[1]}{suffix(spec)}." if all(ends) and spec.kind in ("float", "int") else ""
    text = spec.help[:1].upper() + spec.help[1:]
    text = text if not text or text.endswith(".") else text + "."
    hand = " Decided by hand." if spec.decided else ""
    return f"{text} Default: {said(spec, spec.default)}.{span}{hand}".strip()
