"""Garbage collected by the window itself: never on another thread, and the long way only while nothing happens.

Python collects wherever the count of new objects happens to be full. On a thread that decodes a video that would end
widgets outside their own thread, which Qt does not survive; and in the midst of a step of the clock it would stop the
picture for a tenth of a second.
"""

from __future__ import annotations

import gc
import sys
from collections.abc import Callable

from PySide6.QtCore import QObject, QTimer

_EVERY_MS = 500
_QUIET_TICKS = 4
_YOUNG, _MIDDLE, _OLD = 2_000, 10, 10
_NEW_MODULES = 40
_turned_off = 0
_modules_known = 0


class Collecting(QObject):
    """Collects for as long as a window lives; then Python does again.

    Parameters
    ----------
    parent : the window
    busy : whether something moves, so that a long collection would be seen
    """

    def __init__(self, parent: QObject, busy: Callable[[], bool]) -> None:
        super().__init__(parent)
        self._busy, self._quiet = busy, 0
        self._timer = QTimer(self, interval=_EVERY_MS)
        self._timer.timeout.connect(self.collect)
        self._ended = False

    def start(self) -> None:
        """Collect from now on. All that was loaded to make the window stays to the end, so it is not looked at."""
        global _turned_off
        _turned_off += 1
        gc.disable()
        _set_aside()
        self._timer.start()

    def stop(self) -> None:
        """Leave it to Python again; once is enough, more is no mistake."""
        global _turned_off
        if self._ended:
            return
        self._ended = True
        self._timer.stop()
        _turned_off -= 1
        if not _turned_off:
            gc.enable()

    def collect(self) -> None:
        """Collect the young objects; after some quiet also the old ones."""
        self._quiet = 0 if self._busy() else self._quiet + 1
        young, middle, old = gc.get_count()
        if self._quiet >= _QUIET_TICKS and (old > _OLD or len(sys.modules) - _modules_known > _NEW_MODULES):
            gc.collect()
            _set_aside()
        elif middle > _MIDDLE:
            gc.collect(1)
        elif young > _YOUNG:
            gc.collect(0)


def _set_aside() -> None:
    """Look no more at what there is, where many modules have come since: they stay, and looking takes its time."""
    global _modules_known
    if len(sys.modules) - _modules_known > _NEW_MODULES:
        _modules_known = len(sys.modules)
        gc.freeze()
