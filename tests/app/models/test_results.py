"""Results come from the store once, stay while there is room, and are loaded ahead without a wait."""

from __future__ import annotations

import shutil
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.models.results import Ref, Results, Unread
from markerscope.solver.fit.published.results import PaperLocalization
from markerscope.solver.fit.results import Localization
from markerscope.solver.pipeline.methods import GRAPHS, result_type
from markerscope.solver.pipeline.run import keys_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.store import Absent, Store
from markerscope.solver.sync.offset import Sync


def a_sync(offset: float) -> Sync:
    return Sync(offset, 1.0, 1.0, np.zeros(1000), np.zeros(1000))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    store = Store(tmp_path)
    for i in range(3):
        store.put("sync", f"key{i}", a_sync(float(i)))
    return store


def test_a_result_is_loaded_once(store: Store) -> None:
    results = Results(store)
    assert results.get("sync", "key1").offset == 1.0
    assert results.get("sync", "key1") is results.get("sync", "key1")


def test_what_is_not_there_is_absent(store: Store) -> None:
    results = Results(store)
    assert not results.has("sync", "other")
    with pytest.raises(Absent):
        results.get("sync", "other")
    assert results.of({"sync": "other"}).get("sync") is None
    assert "sync" not in results.of({"sync": "other"})


def test_the_least_used_goes_when_memory_is_full(store: Store) -> None:
    results = Results(store, memory=2 * store.list("sync")[0].size)
    for key in ("key0", "key1", "key0", "key2"):
        results.get("sync", key)
    assert [results.is_loaded("sync", f"key{i}") for i in range(3)] == [True, False, True]


def test_one_result_is_kept_however_large(store: Store) -> None:
    results = Results(store, memory=1)
    results.get("sync", "key0")
    assert results.is_loaded("sync", "key0")


def test_what_is_loaded_ahead_is_prepared_in_the_background_before_it_counts_as_loaded(store: Store) -> None:
    begun, go_on, prepared = threading.Event(), threading.Event(), []

    def prepare(ref: Ref, value: Sync) -> None:
        begun.set()
        go_on.wait(5)
        prepared.append((ref.key, value.offset, threading.current_thread() is threading.main_thread()))

    results = Results(store, prepare=prepare)
    results.load_ahead("sync", "key2")
    assert begun.wait(5) and not results.is_loaded("sync", "key2")
    go_on.set()
    assert results.get("sync", "key2").offset == 2.0
    assert prepared == [("key2", 2.0, False)]


def test_loading_ahead_tells_the_thread_that_polls(store: Store) -> None:
    results, told = Results(store), []
    results.loaded.connect(lambda ref: told.append((ref, threading.current_thread())))
    results.load_ahead("sync", "key1")
    results.load_ahead("sync", "gone")
    while len(told) < 1:
        results.poll()
    assert told == [(Ref("sync", "key1"), threading.current_thread())]
    assert results.is_loaded("sync", "key1")
    results.close()


def until(results: Results, told: list[object]) -> None:
    """Poll until something has been told."""
    end = time.monotonic() + 30
    while not told:
        assert time.monotonic() < end, "nothing was told"
        results.poll()
        time.sleep(0.005)


def test_a_damaged_result_is_told_of_once_and_taken_out(store: Store) -> None:
    path = store.folder("sync", "key1") / "arrays.npz"
    path.write_bytes(bytes(path.stat().st_size))
    results, told = Results(store), list[Unread]()
    results.failed.connect(told.append)
    assert results.has("sync", "key1"), "its size and manifest say nothing of the damage"
    results.load_ahead("sync", "key1")
    until(results, told)
    assert told == [Unread(Ref("sync", "key1"), "its file is damaged", True)]
    assert not results.has("sync", "key1") and not store.has("sync", "key1")
    store.put("sync", "key1", a_sync(9.0))
    assert results.get("sync", "key1").offset == 9.0


def test_a_result_that_cannot_be_read_for_a_while_is_tried_again(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    refuses = [True]

    def get(self: Store, stage: str, key: str, *types: object) -> Sync:
        if refuses[0]:
            raise Absent(stage, key) from OSError(5, "Input/output error")
        return a_sync(7.0)

    monkeypatch.setattr(Store, "get", get)
    results, failed, loaded = Results(store), list[Unread](), list[Ref]()
    results.failed.connect(failed.append)
    results.loaded.connect(loaded.append)
    results.load_ahead("sync", "key2")
    until(results, failed)
    assert failed == [Unread(Ref("sync", "key2"), "it cannot be read: Input/output error", False)]
    assert store.has("sync", "key2"), "nothing says that it is damaged"
    refuses[0] = False
    until(results, loaded)
    assert loaded == [Ref("sync", "key2")] and len(failed) == 1
    assert results.get("sync", "key2").offset == 7.0


def test_entries_are_the_newest_first_and_follow_the_store(store: Store) -> None:
    results = Results(store)
    assert {entry.key for entry in results.entries("sync")} == {"key0", "key1", "key2"}
    store.discard("sync", "key1")
    store.put("sync", "key3", a_sync(3.0))
    assert {entry.key for entry in results.entries("sync")} == {"key0", "key2", "key3"}
    assert results.entries("nothing") == ()


def test_a_stage_that_the_methods_do_differently_loads_as_either(session: Session, paper_session: Session) -> None:
    for own, wanted in ((session, Localization), (paper_session, PaperLocalization)):
        assert isinstance(Results(own.store).of(keys_of(own))["localize"], wanted)


def test_every_stage_has_a_type() -> None:
    assert all(result_type(stage.name) is not None for graph in GRAPHS.values() for stage in graph)
    with pytest.raises(ValueError, match="no method has a stage"):
        result_type("nothing")


def test_stages_with_results_are_what_is_in_them(session: Session) -> None:
    results = Results(session.store)
    assert len(results.of(keys_of(session))) == len(keys_of(session))
    other = replace(session, edits={**session.edits, "segment": {"threshold": 0.5}})
    assert set(results.of(keys_of(other))) == {"markers", "clean", "landmarks", "prior", "sync"}
    shutil.rmtree(session.store.root / "sync")
    assert "sync" not in results.of(keys_of(session))
