"""Long work in a spawned child process: progress and events stream back, and cancelling ends the child.

Spawned, since a thread that holds the interpreter's lock (as geometry libraries do for seconds) would freeze a window,
and ended from outside, since such a call cannot be asked to stop. What the child was writing stays a temporary name,
which is cleared away; what it had finished is in the store.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Any

from markerscope.solver.core.errors import Cancelled, MarkerscopeError
from markerscope.solver.core.progress import Found
from markerscope.solver.pipeline.stage import Event
from markerscope.solver.pipeline.store import Store

_REPORT_EVERY_S = 0.05
_NICE = 5
"""How far the child steps back, so that a window is drawn first where processors are short."""


@dataclass(frozen=True)
class Progressed:
    """The child has come this far."""

    fraction: float
    text: str


@dataclass(frozen=True)
class Finished:
    """The function returned; the last message."""

    value: Any


@dataclass(frozen=True)
class Failed:
    """The function raised, or the child died; the last message. ``details`` is the child's traceback, if any."""

    error: Exception
    details: str = ""


Message = Progressed | Found | Event | Finished | Failed


class WorkerDied(MarkerscopeError):
    """The child process ended without a word."""


class Job:
    """One call of a function in a child process.

    Parameters
    ----------
    function : importable by name; called as ``function(*args, progress=..., on_event=..., **kwargs)``
    store : where the child writes, cleared of its temporary folders when it is cancelled or dies
    """

    def __init__(self, function: Callable[..., Any], *args: Any, store: Store | None = None, **kwargs: Any) -> None:
        context = multiprocessing.get_context("spawn")
        receiver, sender = context.Pipe(duplex=False)
        self._store = store
        self._messages: queue.SimpleQueue[Message] = queue.SimpleQueue()
        self._cancelled = False
        # A daemon: it ends with the window, whatever happens to that.
        self._process = context.Process(target=_child, args=(sender, function, args, kwargs), daemon=True)
        self._process.start()
        sender.close()
        threading.Thread(target=self._receive, args=(receiver,), daemon=True).start()

    @property
    def running(self) -> bool:
        """Whether the child is still at work."""
        return self._process.is_alive()

    def poll(self) -> list[Message]:
        """What has arrived since the last call, without waiting."""
        arrived = []
        with suppress(queue.Empty):
            while True:
                arrived.append(self._messages.get_nowait())
        return arrived

    def messages(self) -> Iterator[Message]:
        """Every message as it arrives, up to the last one."""
        while True:
            message = self._messages.get()
            yield message
            if isinstance(message, Finished | Failed):
                return

    def result(self) -> Any:
        """Wait for the function's value, or raise what it raised."""
        *_, last = self.messages()
        if isinstance(last, Failed):
            raise last.error
        assert isinstance(last, Finished)
        return last.value

    def cancel(self) -> None:
        """End the child now; the last message is then a ``Cancelled``, unless it had finished before."""
        self._cancelled = True
        self._process.terminate()
        self._process.join(2.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()

    def _receive(self, receiver: Connection) -> None:
        """Carry messages from the pipe until the last one or the child's end."""
        with receiver:
            while True:
                try:
                    message = receiver.recv()
                except Exception:  # the end of the pipe, or half a message of a child that was ended
                    break
                self._messages.put(message)
                if isinstance(message, Finished | Failed):
                    return
        self._process.join()
        if self._store is not None and self._process.pid is not None:
            self._store.clean(self._process.pid)
        self._messages.put(Failed(Cancelled("Cancelled.") if self._cancelled else _death(self._process.exitcode)))


class _Sender:
    """A progress that goes to the parent; any thread may report."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self._last = 0.0

    def __call__(self, fraction: float, text: str) -> None:
        now = time.monotonic()
        if now - self._last >= _REPORT_EVERY_S or fraction >= 1.0:
            self._last = now
            self.send(Progressed(fraction, text))

    def found(self, found: Found) -> None:
        self.send(found)

    def send(self, message: Message) -> None:
        with self._lock:
            self._connection.send(message)


def _child(sender: Connection, function: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> None:
    """Run the function and send what happens."""
    # Ctrl+C in a terminal reaches the child too; whether to stop is the parent's decision.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with suppress(OSError, AttributeError):  # Windows knows no such thing
        os.nice(_NICE)
    say = _Sender(sender)
    try:
        say.send(Finished(function(*args, progress=say, on_event=say.send, **kwargs)))
    except MarkerscopeError as error:
        say.send(Failed(error, traceback.format_exc()))
    except Exception as error:
        # An arbitrary exception need not survive the journey; what it said does.
        say.send(Failed(RuntimeError(f"{type(error).__name__}: {error}"), traceback.format_exc()))


def _death(exit_code: int | None) -> WorkerDied:
    reason = f"signal {-exit_code}" if exit_code is not None and exit_code < 0 else f"exit code {exit_code}"
    hint = "; the memory may have been used up" if exit_code in (-9, 137) else ""
    return WorkerDied(f"The worker process ended without a result ({reason}){hint}.")
