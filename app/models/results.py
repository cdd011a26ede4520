"""Results from the store, loaded when they are first asked for, the latest kept."""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, TypeVar, overload

from markerscope.app.models.signal import Signal
from markerscope.solver.pipeline.methods import result_type
from markerscope.solver.pipeline.stage import StageName
from markerscope.solver.pipeline.store import Absent, Entry, Store

T = TypeVar("T")
_MEMORY = 1 << 30
"""Bytes of arrays that are kept at most; ten minutes of a full session take some 300 MB."""
_AGAIN_S, _LONGEST_S = 0.4, 60.0
"""A result that could not be loaded is tried again after so long, and after twice as long each time, at most."""
_SETTLED_S = 1.0
"""A folder that changed less than this ago may change again without another time stamp."""


@dataclass(frozen=True, order=True)
class Ref:
    """Which result: the stage that made it, and its key."""

    stage: str
    key: str


@dataclass(frozen=True)
class Unread:
    """A result in the store that cannot be loaded.

    Attributes
    ----------
    ref : which
    why : in words
    gone : whether it was damaged and has been taken out of the store; else it is tried again
    """

    ref: Ref
    why: str
    gone: bool


class Results:
    """The results of a session.

    Parameters
    ----------
    store : where they are
    memory : bytes of arrays that are kept; the one asked for last always is
    prepare : called in the background with what is loaded ahead, before it counts as loaded

    Attributes
    ----------
    loaded : emitted by ``poll`` with the ``Ref`` of a result that was loaded ahead
    failed : emitted by ``poll`` with one that could not be, twice
    """

    def __init__(
        self, store: Store, memory: int = _MEMORY, prepare: Callable[[Ref, Any], None] = lambda ref, value: None
    ) -> None:
        self.store = store
        self._prepare = prepare
        self.loaded: Signal[[Ref]] = Signal()
        self.failed: Signal[[Unread]] = Signal()
        self._memory = memory
        self._held: OrderedDict[Ref, tuple[Any, int]] = OrderedDict()
        self._entries: dict[Ref, Entry] = {}
        self._lock = threading.Lock()
        self._pool: ThreadPoolExecutor | None = None
        self._coming: dict[Ref, Future[Any]] = {}
        self._failures: dict[Ref, tuple[int, float]] = {}  # how often, and when (monotonic s) to try again
        self._listed: dict[str, tuple[int, tuple[Entry, ...]]] = {}
        self._written: dict[Ref, float] = {}

    @overload
    def get(self, stage: StageName[T], key: str) -> T: ...
    @overload
    def get(self, stage: str, key: str) -> Any: ...
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
            self._written.pop(ref, None)
            return None
        return known

    def entries(self, stage: str) -> tuple[Entry, ...]:
        """Every result of a stage, the newest first; each is looked into once, so this is quick."""
        folder = self.store.root / stage
        try:
            stamp = folder.stat().st_mtime_ns
            listed = self._listed.get(stage)
            if listed is not None and listed[0] == stamp:
                return listed[1]
            keys = [path.name for path in folder.iterdir() if not path.name.startswith(".") and path.is_dir()]
        except OSError:
            return ()
        found = [entry for key in keys if (entry := self.entry(stage, key)) is not None]
        ordered = tuple(sorted(found, key=lambda entry: (-self.written(entry), entry.key)))
        if time.time() - stamp / 1e9 > _SETTLED_S:
            self._listed[stage] = stamp, ordered
        return ordered

    def written(self, entry: Entry) -> float:
        """When a result was written: s since the epoch, 0 if its folder has gone."""
        ref = Ref(entry.stage, entry.key)
        if ref not in self._written:
            try:
                self._written[ref] = (entry.folder / "manifest.json").stat().st_mtime
            except OSError:
                return 0.0
        return self._written[ref]

    def load_ahead(self, stage: str, key: str) -> None:
        """Load a result in the background; ``poll`` says when it is there, or that it cannot be had."""
        ref = Ref(stage, key)
        if ref not in self._failures or self._failures[ref][1] <= time.monotonic():
            self._begin(ref)

    def poll(self) -> None:
        """Tell of the results that have been loaded ahead since the last call, on the caller's thread."""
        with self._lock:
            done = {ref: future for ref, future in self._coming.items() if future.done()}
            for ref in done:
                del self._coming[ref]
        unread = []
        for ref, future in done.items():
            error = future.exception()
            if error is None:
                self._failures.pop(ref, None)
            elif (found := self._count(ref, error)) is not None:
                unread.append(found)
        now = time.monotonic()
        for ref in [ref for ref, (_, due) in self._failures.items() if due <= now]:
            self._begin(ref)
        for ref, future in done.items():
            if future.exception() is None:
                self.loaded.emit(ref)
        for one in unread:
            self.failed.emit(one)

    def forget(self, stage: str, key: str) -> None:
        """Look anew at a result that was computed once more."""
        ref = Ref(stage, key)
        self._entries.pop(ref, None)
        self._written.pop(ref, None)
        self._listed.pop(stage, None)
        with self._lock:
            self._held.pop(ref, None)

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
        self._failures.clear()

    def _begin(self, ref: Ref) -> None:
        with self._lock:
            if ref in self._held or ref in self._coming:
                return
            if self._pool is None:
                self._pool = ThreadPoolExecutor(1, thread_name_prefix="results")
            self._coming[ref] = self._pool.submit(self._load, ref, self._prepare)

    def _count(self, ref: Ref, error: BaseException) -> Unread | None:
        """Note that a result could not be loaded; what there is to tell of it, once, when it has been tried twice."""
        if self.entry(ref.stage, ref.key) is None:
            self._failures.pop(ref, None)  # it is in the store no more, so nobody will ask for it again
            return None
        times = self._failures.get(ref, (0, 0.0))[0] + 1
        self._failures[ref] = times, time.monotonic() + min(_AGAIN_S * 2 ** (times - 1), _LONGEST_S)
        if times != 2:
            return None
        refused = error.__cause__ if isinstance(error, Absent) else error
        if isinstance(error, Absent) and not isinstance(refused, OSError):
            self.store.discard(ref.stage, ref.key)
            del self._failures[ref]
            return Unread(ref, "its file is damaged", True)
        why = refused.strerror if isinstance(refused, OSError) and refused.strerror else str(refused)
        return Unread(ref, f"it cannot be read: {why or type(refused).__name__}", False)

    def _load(self, ref: Ref, prepare: Callable[[Ref, Any], None] | None = None) -> Any:
        value = self.store.get(ref.stage, ref.key, result_type(ref.stage))
        if prepare is not None:
            prepare(ref, value)
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

    @overload
    def __getitem__(self, stage: StageName[T]) -> T: ...
    @overload
    def __getitem__(self, stage: str) -> Any: ...
    def __getitem__(self, stage: str) -> Any:
        return self.results.get(stage, self.keys_of_stages[stage])

    @overload
    def get(self, stage: StageName[T], default: None = None) -> T | None: ...
    @overload
    def get(self, stage: str, default: Any = None) -> Any: ...
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
