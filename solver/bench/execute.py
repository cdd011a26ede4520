"""One run: a session is made, a method answers, the answer is measured. Everything here happens in a worker process."""

from __future__ import annotations

import gc
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import FrameType
from typing import Any

from markerscope.solver.bench.cases import Case
from markerscope.solver.bench.measure import measure, steps
from markerscope.solver.bench.methods import Given, Labels, Variant
from markerscope.solver.bench.motions import MotionSource, find_motions, read_source
from markerscope.solver.bench.registry import method_named
from markerscope.solver.core.errors import MarkerscopeError
from markerscope.solver.core.progress import Progress
from markerscope.solver.pipeline.source import Changed
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise

_WARM_UP = SynthSettings(markers=12, frames=60)
_warm: set[str] = set()


@dataclass(frozen=True)
class Run:
    """One cell of the benchmark.

    Attributes
    ----------
    key : digest of everything that its result depends on
    case, motion, seed : what the session is made from
    method : name of the method
    iterations : cap of its optimisations, None for its own
    limit : s that it may take, None for any time
    """

    key: str
    case: Case
    motion: MotionSource
    method: str
    seed: int
    iterations: int | None = None
    limit: float | None = None

    @property
    def variant(self) -> Variant:
        """The method with its settings."""
        return method_named(self.method).capped(self.iterations)

    @property
    def about(self) -> dict[str, Any]:
        """What its record begins with."""
        return {
            "key": self.key,
            "case": self.case.name,
            "method": self.method,
            "motion": self.motion.name,
            "seed": self.seed,
            "iterations": self.iterations,
            "limit": self.limit,
        }

    def session(self) -> SynthSession:
        """The session, made anew."""
        return synthesise(read_source(self.motion), self.case.settings, self.seed)


class OutOfTime(Exception):
    """A run took longer than it may."""


def execute(run: Run) -> dict[str, Any]:
    """The record of a run, whatever happens in it."""
    record = run.about
    try:
        return record | {"status": "done"} | _measured(run)
    except OutOfTime:
        return record | {"status": "timed out", "sentence": f"It took more than {run.limit:g} s."}
    except Changed:  # says nothing of the method, and must not be kept as if it did
        raise
    except MarkerscopeError as error:
        return record | {"status": "failed", "sentence": str(error)}
    except Exception as error:  # a method may fail in any way; it is counted
        return record | {"status": "failed", "sentence": f"{type(error).__name__}: {error}"}


def _measured(run: Run) -> dict[str, Any]:
    session = run.session()
    given = given_of(session, run.variant)
    warm_up(run.variant)
    gc.collect()
    reset_peak()
    with time_limit(run.limit) as check:
        cpu, start = time.process_time(), time.perf_counter()
        solved = run.variant.solve(given, run.variant.settings, check)
        warm, cpu = time.perf_counter() - start, time.process_time() - cpu
    memory = peak_memory()
    found = measure(session, solved) | {"warm_s": warm, "cpu_s": cpu, "memory_gb": memory}
    return found | {"steps": dict(steps(session, solved))}


def given_of(session: SynthSession, variant: Variant) -> Given:
    """What the method may see of a session."""
    truth = session.truth
    labels = Labels(truth.marker_vertex, truth.marker_joint) if variant.needs_labels else None
    return Given(session.markers, session.prior, session.nominal_offset, labels=labels)


def warm_up(variant: Variant) -> None:
    """Have everything imported that the method needs, by a small session, once a process."""
    if variant.name in _warm:
        return
    _warm.add(variant.name)
    small = synthesise(read_source(find_motions(None, 1)[0]), _WARM_UP, 0)
    try:
        variant.capped(1).solve(given_of(small, variant), variant.capped(1).settings, lambda fraction, text: None)
    except Exception:  # the run itself will tell
        return


@contextmanager
def time_limit(seconds: float | None) -> Iterator[Progress]:
    """Raise ``OutOfTime`` in the block after so many seconds: by a signal where there is one, else by its progress."""
    end = float("inf") if seconds is None else time.monotonic() + seconds

    def check(fraction: float, text: str) -> None:
        if time.monotonic() > end:
            raise OutOfTime

    def ring(number: int, frame: FrameType | None) -> None:
        raise OutOfTime

    if seconds is None or not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield check
        return
    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield check
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def reset_peak() -> bool:
    """Let the process' peak memory be counted from now on; False where the system cannot."""
    try:
        Path("/proc/self/clear_refs").write_text("5")
    except OSError:
        return False
    return True


def peak_memory() -> float:
    """GB, the most that the process held since ``reset_peak``; since its start where the system cannot reset it."""
    try:
        status = Path("/proc/self/status").read_text()
        return next(int(line.split()[1]) for line in status.splitlines() if line.startswith("VmHWM")) / 1e6
    except (OSError, StopIteration):
        pass
    try:
        import resource
    except ImportError:  # not on Windows
        return float("nan")
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1e9 if sys.platform == "darwin" else 1e6)


def with_key(run: Run, key: str) -> Run:
    """The run under its key."""
    return replace(run, key=key)
