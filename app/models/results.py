"""Results from the store, loaded when they are first asked for, the latest kept."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from app.models.signal import Signal
from solver.pipeline.methods import result_type
from solver.pipeline.store import Entry, Store

_MEMORY = 1 << 30
"""Bytes of arrays that are kept at most; ten minutes of a full session take some 300 MB."""


@dataclass(frozen=True, order=True)
class Ref:
    """Which result: the stage that made it, and its key."""

    stage: str
    key: str


class Results:
    """The results of a session.

    Parameters
    ----------
    store : where they are
    memory : bytes of arrays that are kept; the one asked for last always is

    Attributes
    ----------
    loaded : emitted by ``poll`` with the ``Ref`` of a result that was loaded ahead
    """

    def __init__(self, store: Store, memory: int = _MEMORY) -> None:
        self.store = store
        self.loaded: Signal[[Ref]] = Signal()
        self._memory = memory
        self._held: OrderedDict[Ref, tuple[Any, int]] = OrderedDict()
        self._entries: dict[Ref, Entry] = {}
        self._lock = threading.Lock()
        self._pool: ThreadPoolExecutor | None = None
        self._coming: dict[Ref, Future[Any]] = {}

    def get(self, stage: str, key: str) -> Any:
        """A stage's result.

        Raises
        ------
        Absent : there is none of that key, or it is damaged
        """
        ref = Ref(stage, key)
        with self._lock:
            if ref in self._held:
                self._held.move_to_end(ref)
                return self._held[ref][0]
            coming = self._coming.get(ref)
        return self._load(ref) if coming is None else coming.result()

    def has(self, stage: str, key: str) -> bool:
        """Whether there is such a result."""
        return self.entry(stage, key) is not None

    def is_loaded(self, stage: str, key: str) -> bool:
        """Whether ``get`` would return at once."""
        with self._lock:
            return Ref(stage, key) in self._held

    def entry(self, stage: str, key: str) -> Entry | None:
        """What is known of a result without loading it, or None where there is none."""
        ref = Ref(stage, key)
        known = self._entries.get(ref)
        if known is None:
            known = self.store.entry(stage, key)
            if known is not None:
                self._entries[ref] = known
        elif not known.folder.is_dir():
            del self._entries[ref]
            return None
        return known

    def entries(self, stage: str) -> tuple[Entry, ...]:
        """Every result of a stage, the newest first; each is looked into once, so this is quick."""
        folder = self.store.root / stage
        try:
            keys = [path.name for path in folder.iterdir() if not path.name.startswith(".") and path.is_dir()]
        except OSError:
            return ()
        found = [entry for key in keys if (entry := self.entry(stage, key)) is not None]
        return tuple(sorted(found, key=lambda entry: (-written(entry), entry.key)))

    def load_ahead(self, stage: str, key: str) -> None:
        """Load a result in the background; ``poll`` says when it is there."""
        ref = Ref(stage, key)
        with self._lock:
            if ref in self._held or ref in self._coming:
                return
            if self._pool is None:
                self._pool = ThreadPoolExecutor(1, thread_name_prefix="results")
            self._coming[ref] = self._pool.submit(self._load, ref)

    def poll(self) -> None:
        """Tell of the results that have been loaded ahead since the last call, on the caller's thread."""
        with self._lock:
            done = [ref for ref, future in self._coming.items() if future.done()]
            told = [ref for ref in done if self._coming.pop(ref).exception() is None]
        for ref in told:
            self.loaded.emit(ref)

    def of(self, keys: Mapping[str, str]) -> StageResults:
        """The results of these keys, by stage."""
        return StageResults(self, keys)

    def close(self) -> None:
        """Load nothing more ahead, and forget what is held."""
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            self._held.clear()
            self._coming.clear()

    def _load(self, ref: Ref) -> Any:
        value = self.store.get(ref.stage, ref.key, result_type(ref.stage))
        entry = self.entry(ref.stage, ref.key)
        with self._lock:
            self._held[ref] = value, entry.size if entry else 0
            self._held.move_to_end(ref)
            while len(self._held) > 1 and sum(size for _, size in self._held.values()) > self._memory:
                self._held.popitem(last=False)
        return value


class StageResults(Mapping[str, Any]):
    """Results by stage name; a stage is in it if its result is in the store.

    Parameters
    ----------
    results : where they are loaded from
    keys : key of each stage
    """

    def __init__(self, results: Results, keys: Mapping[str, str]) -> None:
        self.results = results
        self.keys_of_stages = dict(keys)

    def __getitem__(self, stage: str) -> Any:
        return self.results.get(stage, self.keys_of_stages[stage])

    def get(self, stage: str, default: Any = None) -> Any:
        """The stage's result, or ``default`` where it has none."""
        try:
            return self[stage]
        except KeyError:  # Absent is one
            return default

    def __contains__(self, stage: object) -> bool:
        key = self.keys_of_stages.get(stage) if isinstance(stage, str) else None
        return key is not None and self.results.has(str(stage), key)

    def __iter__(self) -> Iterator[str]:
        return (stage for stage in self.keys_of_stages if stage in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)


def written(entry: Entry) -> float:
    """When a result was written: s since the epoch, 0 if its folder has gone."""
    try:
        return (entry.folder / "manifest.json").stat().st_mtime
    except OSError:
        return 0.0
