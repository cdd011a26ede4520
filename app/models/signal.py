"""Signals between models: who listens is called, in order, by whoever emits."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Generic, ParamSpec

P = ParamSpec("P")


class Signal(Generic[P]):
    """Something that others may listen to.

    A listener that is connected twice is called once. One that raises does not keep the others from being told; the
    first error is raised when all have been.
    """

    def __init__(self) -> None:
        self._listeners: list[Callable[P, Any]] = []
        self._blocked = 0

    def connect(self, listener: Callable[P, Any]) -> Callable[P, Any]:
        """Call ``listener`` from now on; it is returned, so that this can decorate."""
        if listener not in self._listeners:
            self._listeners.append(listener)
        return listener

    def disconnect(self, listener: Callable[P, Any]) -> None:
        """Call it no more; one that was not connected is no mistake."""
        if listener in self._listeners:
            self._listeners.remove(listener)

    def emit(self, *args: P.args, **kwargs: P.kwargs) -> None:
        """Tell those who listen now; one that is disconnected meanwhile is not called."""
        if self._blocked:
            return
        failure: Exception | None = None
        for listener in tuple(self._listeners):
            if listener not in self._listeners:
                continue
            try:
                listener(*args, **kwargs)
            except Exception as error:
                failure = failure or error
        if failure is not None:
            raise failure

    @contextmanager
    def block(self) -> Iterator[None]:
        """Tell nobody inside the block."""
        self._blocked += 1
        try:
            yield
        finally:
            self._blocked -= 1
