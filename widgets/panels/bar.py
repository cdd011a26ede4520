"""Bars that show how far something is."""

from __future__ import annotations

from PySide6.QtWidgets import QProgressBar


def show_part(bar: QProgressBar, part: float | None) -> None:
    """Show 0..1 of it done; None where nobody knows how much.

    Qt would draw the whole window's changes at once for every new value; they are drawn when all is set.
    """
    bar.setUpdatesEnabled(False)
    bar.setRange(0, 0 if part is None else 1000)
    if part is not None:
        bar.setValue(round(1000 * part))
        bar.setFormat(f"{100 * part:.0f} %")
    bar.setUpdatesEnabled(True)
