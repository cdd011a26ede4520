"""Mistakes of the program itself: told in the window, and with all detail in the terminal."""

from __future__ import annotations

import sys
import traceback
from types import TracebackType

from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.core.errors import MarkerscopeError
from markerscope.widgets.guard import end_painters, guard_paints

_REMEDY = "save the session; if it comes again, report it with what the terminal says"


class Mistakes:
    """Tells of every error that nobody expected, each once, until another one comes."""

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench
        self._told = ""
        bench.document.changed.connect(self._forget)

    def watch(self) -> None:
        """From now on, and whatever is painted."""
        self._before = sys.excepthook
        sys.excepthook = self.take
        guard_paints(self.tell)

    def take(self, kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
        """Python's hook for errors that came out of a slot or an event."""
        end_painters(error)
        if isinstance(error, Exception):
            self.tell(error)
        else:
            self._before(kind, error, trace)

    def _forget(self, another: bool) -> None:
        """What was decided may have mended it."""
        self._told = ""

    def tell(self, error: Exception) -> None:
        """Say it."""
        if isinstance(error, MarkerscopeError):
            if str(error) != self._told:  # else every frame that is drawn would say that a file cannot be read
                self._told = str(error)
                self.bench.say_error(error)
            return
        where = traceback.extract_tb(error.__traceback__)
        said = f"A mistake in the program ({type(error).__name__}): {str(error).rsplit('(): ', 1)[-1]}"
        if said != self._told:
            self._told = said
            traceback.print_exception(error)
            self.bench.say(Said("error", said.rstrip(". "), where[-1].name if where else "", _REMEDY))
