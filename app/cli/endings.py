"""How a command that did not succeed ends: one sentence on stderr and an exit code."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
import traceback

from markerscope.solver.core.errors import Cancelled, InputError, MarkerscopeError
from markerscope.solver.core.plain import shown

FAILED, REFUSED, CANCELLED = 1, 2, 130

_DISK = (errno.ENOSPC, errno.EDQUOT, errno.EROFS)


def ended(error: Exception, debug: bool = False) -> int:
    """Tell what ended the command; returns the exit code."""
    if debug:
        traceback.print_exception(error)
    if isinstance(error, BrokenPipeError):
        return _reader_left()
    if isinstance(error, Cancelled):
        return _say("Cancelled.", CANCELLED)
    if isinstance(error, InputError):
        return _say(str(error), REFUSED)
    if isinstance(error, MarkerscopeError):
        return _say(str(error), FAILED)
    if isinstance(error, OSError) and error.errno in _DISK:
        place = error.filename or tempfile.gettempdir()
        return _say(f"{place}: {error.strerror}; free some space or choose another disk.", REFUSED)
    if isinstance(error, MemoryError):
        return _say("There is not enough memory; solve a shorter --range, or close other programs.", FAILED)
    what = f"{type(error).__name__}: {error}".splitlines()[0]
    details = "shown above" if debug else _write_log(error)
    return _say(f"Markerscope made a mistake ({what}); the details are {details}.", FAILED)


def _say(sentence: str, code: int) -> int:
    print(shown(" ".join(sentence.splitlines())), file=sys.stderr)
    return code


def _write_log(error: Exception) -> str:
    """Keep the traceback for a report; returns where it is."""
    try:
        with tempfile.NamedTemporaryFile(
            "w", prefix="markerscope-", suffix=".log", delete=False, encoding="utf-8", errors="backslashreplace"
        ) as log:
            log.write("".join(traceback.format_exception(error)))
    except OSError:
        return "shown with --debug"
    return f"in {log.name} and shown with --debug"


def _reader_left() -> int:
    """Whoever read our output has what it wanted (``markerscope ... | head``): end without a word."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return FAILED
