"""What is asked for many times at once is done once, as soon as all has changed that changes now."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer


class Once:
    """Does something once in a turn of the event loop, however often it was asked for.

    Parameters
    ----------
    parent : with which it ends
    act : what is done
    """

    def __init__(self, parent: QObject, act: Callable[[], object]) -> None:
        self._act = act
        self._timer = QTimer(parent, singleShot=True, interval=0)
        self._timer.timeout.connect(act)

    def ask(self, *anything: object) -> None:
        """Have it done soon; what a signal brings along is no matter."""
        self._timer.start()

    def done(self) -> None:
        """It has just been done: nobody waits for it any more."""
        self._timer.stop()

    def now(self) -> None:
        """Do it at once if it was asked for: a picture of the view is about to be taken."""
        if self._timer.isActive():
            self._timer.stop()
            self._act()
