"""Pieces of a result that takes long, kept while a stage is at work: stopped or killed, it goes on from them.

They lie in the store as results do, each there whole or not at all, under the key of the result they belong to: other
settings or another file never meet them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.store import Absent, Store

_SUFFIX = ".part"


def _free() -> None:
    """Nothing speaks against keeping a piece."""


class Pieces:
    """Those of one result.

    Parameters
    ----------
    stage, key : of the result
    check : called before a piece is kept; raises where it must not be
    """

    def __init__(self, store: Store, stage: str, key: str, check: Callable[[], None] = _free) -> None:
        self._store, self._stage, self._key, self._check = store, f"{stage}{_SUFFIX}", key, check

    def get(self, name: str, declared: Any) -> Any | None:
        """A piece of the declared type; None where it is not there, or damaged."""
        try:
            return self._store.get(self._stage, f"{self._key}-{name}", declared)
        except Absent:
            return None

    def keep(self, name: str, value: Any) -> None:
        """Keep a piece. One that cannot be written is done without: the result itself may yet be."""
        self._check()
        try:
            self._store.put(self._stage, f"{self._key}-{name}", value)
        except InputError:
            return

    def discard(self) -> None:
        """Take all of them away."""
        folder = self._store.root / self._stage
        for piece in sorted(folder.glob(f"{self._key}-*")):
            self._store.discard(self._stage, piece.name)
        try:
            folder.rmdir()
        except OSError:  # there is none, or it holds pieces of other results
            return
