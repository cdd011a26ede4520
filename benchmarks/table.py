"""A table of what was measured, printed row by row as it becomes known, beside what it is to be."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from markerscope.solver.bench.machine import machine


def head() -> None:
    """Print the titles."""
    print("| | measured | budget | processor |\n|---|---:|---:|---:|", flush=True)


def say(what: str, measured: str, budget: str = "", processor: str = "") -> None:
    """Print a row."""
    print(f"| {what} | {measured} | {budget} | {processor} |", flush=True)


def say_spread(what: str, took: Sequence[tuple[float, float]], budget: str) -> None:
    """Print a row on something done many times: the median, the 95th percentile and the longest, ms."""
    passed, own = np.array(took).T
    spread = "; ".join(f"{value:.0f}" for value in (np.median(passed), np.percentile(passed, 95), passed.max()))
    say(f"{what}: median; p95; max", f"{spread} ms", budget, f"{np.percentile(own, 95):.0f} ms")


def timed(act: Callable[[], object]) -> tuple[float, float]:
    """Milliseconds that something takes, and those of them in which the window's thread was at work."""
    began, busy = time.perf_counter(), time.thread_time()
    act()
    return 1000 * (time.perf_counter() - began), 1000 * (time.thread_time() - busy)


def where(window: Any) -> str:
    """When and on what it was measured, in a line."""
    on = machine()
    graphics = "no graphics card" if window.scene.software else "a graphics card"
    load = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    today = time.strftime("%Y-%m-%d")
    return f"{today}, {on['processor']}, {on['cores']} cores, {graphics}; {on['system']}, Python {on['python']}{load}."
