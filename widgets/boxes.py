"""Boxes for one value, which the wheel leaves alone."""

from __future__ import annotations

from PySide6.QtGui import QWheelEvent
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QSpinBox


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
