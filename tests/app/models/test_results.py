"""Results come from the store once, stay while there is room, and are loaded ahead without a wait."""

from __future__ import annotations

import shutil
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.models.results import Ref, Results
from solver.pipeline.methods import GRAPHS, result_type
from solver.pipeline.run import keys_of
from solver.pipeline.session import Session
from solver.pipeline.store import Absent, Store
from solver.solve.paper.results import PaperLocalization
from solver.solve.results import Localization
from solver.sync import Sync


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
