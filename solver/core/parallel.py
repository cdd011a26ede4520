"""Work spread over the processor's cores by threads: numpy's products do not hold the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def cores() -> int:
    """How many cores this process may use."""
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on macOS and Windows
        return os.cpu_count() or 1


def spread(work: Callable[[A], B], items: Iterable[A]) -> list[B]:
    """``[work(item) for item in items]``, several at a time; the first failure is raised."""
    with ThreadPoolExecutor(min(cores(), 8)) as pool:
        return list(pool.map(work, items))
