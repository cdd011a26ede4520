"""What a command prints: a progress bar on stderr, sentences and the JSON summary on stdout."""

from __future__ import annotations

import argparse
import math
import shutil
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from types import TracebackType
from typing import Any, TextIO

from markerscope.solver.core.plain import json_text, shown
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Outcome

_REDRAW_EVERY_S = 0.1
_LINE_EVERY_S = 10.0
_ESTIMATE_AFTER_S = 1.0


@contextmanager
def standard_output() -> Iterator[None]:
    """Name the standard output in a failure to write there, which itself names no file."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or "the standard output"
        raise


class Terminal:
    """The streams of one command, as its options want them used.

    Parameters
    ----------
    options : has ``json`` and ``quiet``
    """

    def __init__(self, options: argparse.Namespace) -> None:
        self._json, self._quiet = options.json, options.quiet
        self._bar = None if self._quiet else ProgressBar(sys.stderr)
        self.progress: Progress = self._bar or silent

    def show(self, outcome: Outcome) -> None:
        """Print what was found."""
        self._clear()
        with standard_output():
            if not self._quiet:
                for line in outcome.lines:
                    print(shown(line))
                for warning in outcome.warnings:
                    print(f"Warning: {shown(warning)}")
            if self._json:
                said = {"warnings": list(outcome.warnings)} if outcome.warnings else {}
                print(json_line(said | dict(outcome.summary)))
            sys.stdout.flush()

    def _clear(self) -> None:
        if self._bar is not None:
            self._bar.close()

    def __enter__(self) -> Terminal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._clear()


class ProgressBar:
    """A ``Progress`` that draws one line with the time left; where nobody watches, a line now and then.

    Parameters
    ----------
    stream : where to draw
    clock : s, rising
    """

    def __init__(self, stream: TextIO, clock: Callable[[], float] = time.monotonic) -> None:
        self._stream, self._clock = stream, clock
        self._live = stream.isatty()
        self._start = clock()
        self._drawn = -math.inf
        self._shown = ""

    def __call__(self, fraction: float, text: str) -> None:
        """Draw, unless it was drawn a moment ago."""
        now = self._clock()
        if now - self._drawn < (_REDRAW_EVERY_S if self._live else _LINE_EVERY_S):
            return
        self._drawn, text = now, shown(text)
        if self._live:
            width = shutil.get_terminal_size().columns - 1
            line = self._line(fraction, text, now)[:width]
            self._stream.write(f"\r{line}{' ' * (len(self._shown) - len(line))}")
            self._shown = line
        else:
            self._stream.write(f"{100 * fraction:3.0f} %  {text}\n")
        self._stream.flush()

    def close(self) -> None:
        """Take the line away."""
        if self._shown:
            self._stream.write(f"\r{' ' * len(self._shown)}\r")
            self._stream.flush()
            self._shown = ""

    def _line(self, fraction: float, text: str, now: float) -> str:
        fraction = min(max(fraction, 0.0), 1.0)
        filled = round(20 * fraction)
        return f"[{'#' * filled}{'.' * (20 - filled)}] {100 * fraction:3.0f} %{self._time_left(fraction, now)}  {text}"

    def _time_left(self, fraction: float, now: float) -> str:
        elapsed = now - self._start
        if elapsed < _ESTIMATE_AFTER_S or fraction < 0.01:
            return ""
        left = math.ceil(elapsed * (1 - fraction) / fraction)
        return f"  {left // 60}:{left % 60:02d} left"


def json_line(summary: Mapping[str, Any]) -> str:
    """One line of strict JSON: what is not a finite number becomes null."""
    return json_text(summary, indent=None)
