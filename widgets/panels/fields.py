"""A form made from records of settings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from PySide6.QtCore import QSignalBlocker, Qt, Signal
from PySide6.QtGui import QFont, QWheelEvent
from PySide6.QtWidgets import (
    QAbstractSpinBox,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QSizePolicy,
    QSpinBox,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from widgets.icons import icon
from widgets.panels.stage_data import FieldSpec

_UNITS = {"deg": "°"}


class _CalmWheel:
    """Numbers do not change as the panel is scrolled over them."""

    def wheelEvent(self, event: QWheelEvent) -> None:
        """Leave the wheel to the panel unless the number is being edited."""
        if self.hasFocus():  # type: ignore[attr-defined]
            super().wheelEvent(event)  # type: ignore[misc]
        else:
            event.ignore()


class NumberBox(_CalmWheel, QDoubleSpinBox):
    """A number without needless zeros, or a blank."""

    blank = False

    def textFromValue(self, value: float) -> str:
        """Six digits at most."""
        return "" if self.blank else f"{value:.6g}"


class CountBox(_CalmWheel, QSpinBox):
    """A whole number, or a blank."""

    blank = False

    def textFromValue(self, value: int) -> str:
        """Without separators."""
        return "" if self.blank else str(value)


class ChoiceBox(_CalmWheel, QComboBox):
    """One of several words."""


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
            self._controls = [_number(spec, end) for end in ("from", "to")]
        else:
            self._controls = [_control(spec)]
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
            _on_change(control, self._tell)
        self.setFocusProxy(self._controls[0])
        self.set_value(spec.value)

    def value(self) -> Any:
        """What is set."""
        if self.automatic is not None and self.automatic.isChecked():
            return None
        values = [_read(control) for control in self._controls]
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
                    _write(control, part)
        self._grey()

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
                    control.setSuffix("" if automatic else _suffix(self.spec))


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
            wide = label.fontMetrics().horizontalAdvance(spec.label) + 8
            label.setMinimumWidth(min(wide, 9 * label.fontMetrics().height()))
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


def said(spec: FieldSpec, value: Any) -> str:
    """A value in words."""
    if value is None:
        return "automatic"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple | list):
        return " to ".join("open" if v is None else f"{v:g}" for v in value) + (f" {spec.unit}" if spec.unit else "")
    number = isinstance(value, int | float)
    return f"{value:g}{_suffix(spec)}" if number else str(value)


def _suffix(spec: FieldSpec) -> str:
    return (_UNITS.get(spec.unit) or f" {spec.unit}") if spec.unit else ""


def _shape(spec: FieldSpec) -> tuple:
    return (spec.name, spec.label, spec.kind, spec.unit, spec.minimum, spec.maximum, spec.choices, spec.optional)


def _tip(spec: FieldSpec) -> str:
    ends = [f"{end:g}" if end is not None else "" for end in (spec.minimum, spec.maximum)]
    span = f" Range: {ends[0]} to {ends[1]}{_suffix(spec)}." if all(ends) and spec.kind in ("float", "int") else ""
    text = spec.help[:1].upper() + spec.help[1:]
    text = text if not text or text.endswith(".") else text + "."
    hand = " Decided by hand." if spec.decided else ""
    return f"{text} Default: {said(spec, spec.default)}.{span}{hand}".strip()


def _control(spec: FieldSpec) -> QWidget:
    if spec.kind == "float":
        return _number(spec)
    if spec.kind == "int":
        count = CountBox()
        count.setRange(
            int(spec.minimum) if spec.minimum is not None else -(2**31),
            int(spec.maximum) if spec.maximum is not None else 2**31 - 1,
        )
        return _typed(count, spec)
    if spec.kind == "bool":
        box = QCheckBox()
        box.setAccessibleName(spec.label)
        return box
    if spec.kind == "choice":
        choice = ChoiceBox()
        choice.addItems(list(spec.choices))
        choice.setAccessibleName(spec.label)
        choice.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
        choice.setSizeAdjustPolicy(QComboBox.SizeAdjustPolicy.AdjustToMinimumContentsLengthWithIcon)
        choice.setMinimumContentsLength(6)
        return choice
    line = QLineEdit()
    line.setAccessibleName(spec.label)
    return line


def _number(spec: FieldSpec, end: str = "") -> NumberBox:
    box = NumberBox()
    box.setDecimals(9)
    box.setRange(spec.minimum if spec.minimum is not None else -1e9, spec.maximum if spec.maximum is not None else 1e9)
    box.setStepType(QAbstractSpinBox.StepType.AdaptiveDecimalStepType)
    typed = _typed(box, spec)
    if end:
        typed.setPrefix(f"{end} ")
        typed.setAccessibleName(f"{spec.label}, {end}")
    return typed


def _typed(box: Any, spec: FieldSpec) -> Any:
    box.setSuffix(_suffix(spec))
    box.setKeyboardTracking(False)
    box.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    box.setAccessibleName(spec.label)
    box.setMinimumWidth(box.fontMetrics().horizontalAdvance(f"from 000.00{_suffix(spec)}") + 24)
    return box


def _on_change(control: Any, tell: Callable[..., None]) -> None:
    if isinstance(control, QComboBox):
        control.currentTextChanged.connect(tell)
    elif isinstance(control, QCheckBox):
        control.toggled.connect(tell)
    elif isinstance(control, QLineEdit):
        control.editingFinished.connect(tell)
    else:
        control.valueChanged.connect(tell)


def _read(control: Any) -> Any:
    if isinstance(control, QComboBox):
        return control.currentText()
    if isinstance(control, QCheckBox):
        return control.isChecked()
    return control.text() if isinstance(control, QLineEdit) else control.value()


def _write(control: Any, value: Any) -> None:
    if isinstance(control, QComboBox):
        control.setCurrentText(str(value))
    elif isinstance(control, QCheckBox):
        control.setChecked(bool(value))
    elif isinstance(control, QLineEdit):
        control.setText(str(value))
    else:
        control.setValue(value)
