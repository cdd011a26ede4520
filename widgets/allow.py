"""Controls that cannot be used now, and say why."""

from __future__ import annotations

from PySide6.QtGui import QAction
from PySide6.QtWidgets import QWidget


def allow(part: QWidget | QAction, reason: str, tip: str) -> None:
    """Let a control be used, with ``tip`` as its tooltip; where there is a reason (a clause) against it, not."""
    part.setEnabled(not reason)
    part.setToolTip(f"{tip.rstrip('.')}. Not now: {reason}." if reason else tip)
