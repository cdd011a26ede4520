"""Controls for one value each, and values in words."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QAbstractSpinBox, QCheckBox, QComboBox, QLineEdit, QWidget

from markerscope.widgets.boxes import ChoiceBox, CountBox, NumberBox
from markerscope.widgets.panels.stage_data import FieldSpec

_UNITS = {"deg": "°"}


def said(spec: FieldSpec, value: Any) -> str:
    """A value in words."""
    if value is None:
        return "automatic"
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, tuple | list):
        return " to ".join("open" if v is None else f"{v:g}" for v in value) + (f" {spec.unit}" if spec.unit else "")
    number = isinstance(value, int | float)
    return f"{value:g}{suffix(spec)}" if number else str(value)


def suffix(spec: FieldSpec) -> str:
    """The unit as it follows a number."""
    return (_UNITS.get(spec.unit) or f" {spec.unit}") if spec.unit else ""


def control_of(spec: FieldSpec) -> QWidget:
    """The control that a kind of value needs."""
    if spec.kind == "float":
        return number_box(spec)
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


def number_box(spec: FieldSpec, end: str = "") -> NumberBox:
    """A number with unit and range; ``end`` names which end of a span it is."""
    box = NumberBox()
    box.setDecimals(9)
    box.setRange(spec.minimum if spec.minimum is not None else -1e9, spec.maximum if spec.maximum is not None else 1e9)
    box.setStepType(QAbstractSpinBox.StepType.AdaptiveDecimalStepType)
    typed = _typed(box, spec)
    if end:
        typed.setPrefix(f"{end} ")
        fit(box)
        typed.setAccessibleName(f"{spec.label}, {end}")
    return typed


def _typed(box: Any, spec: FieldSpec) -> Any:
    box.setSuffix(suffix(spec))
    box.setKeyboardTracking(False)
    box.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    box.setAccessibleName(spec.label)
    fit(box)
    return box


def fit(control: QWidget) -> None:
    """Make room for a number with what stands about it, in the font there is."""
    if isinstance(control, NumberBox | CountBox):
        held = f"{control.prefix()}000.00{control.suffix()}"
        control.setMinimumWidth(control.fontMetrics().horizontalAdvance(held) + 30)


def on_change(control: Any, tell: Callable[..., None]) -> None:
    """Call ``tell`` when the user has set something."""
    if isinstance(control, QComboBox):
        control.currentTextChanged.connect(tell)
    elif isinstance(control, QCheckBox):
        control.toggled.connect(tell)
    elif isinstance(control, QLineEdit):
        control.editingFinished.connect(tell)
    else:
        control.valueChanged.connect(tell)


def read(control: Any) -> Any:
    """What a control holds."""
    if isinstance(control, QComboBox):
        return control.currentText()
    if isinstance(control, QCheckBox):
        return control.isChecked()
    return control.text() if isinstance(control, QLineEdit) else control.value()


def write(control: Any, value: Any) -> None:
    """Have a control show a value."""
    if isinstance(control, QComboBox):
        control.setCurrentText(str(value))
    elif isinstance(control, QCheckBox):
        control.setChecked(bool(value))
    elif isinstance(control, QLineEdit):
        control.setText(str(value))
    else:
        control.setValue(value)
