"""The store: whole entries or none, whatever happens to writers, files and disks."""

from __future__ import annotations

import errno
import json
import multiprocessing
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline import store as store_module
from markerscope.solver.pipeline.store import Absent, Store

KEY = "0" * 32


@dataclass(frozen=True)
class Result:
    positions: np.ndarray
    label: str = "knee"


RESULT = Result(np.linspace(0, 1, 300).reshape(100, 3))


@pytest.fixture
def store(tmp_path: Path) -> Store:
    return Store(tmp_path / "results")


def files(root: Path) -> list[str]:
    return sorted(str(p.relative_to(root)) for p in root.rglob("*") if p.is_file())


def test_what_is_put_is_got(store: Store) -> None:
    assert not store.has("fit", KEY)
    entry = store.put("fit", KEY, RESULT, {"seconds": 1.5, "headline": "3 mm"})
    assert store.has("fit", KEY)
    back = store.get("fit", KEY, Result)
    np.testing.assert_array_equal(back.positions, RESULT.positions)
    assert back.label == "knee"
    assert store.entry("fit", KEY) == entry
    assert entry.about == {"seconds": 1.5, "headline": "3 mm"}
    assert store.list() == store.list("fit") == (entry,)
    assert store.list("angles") == ()
    assert files(store.root) == [f"fit/{KEY}/arrays.npz", f"fit/{KEY}/manifest.json"]


def test_nothing_stored_is_a_pickle(store: Store) -> None:
    store.put("fit", KEY, RESULT)
    with np.load(store.folder("fit", KEY) / "arrays.npz", allow_pickle=False) as arrays:
        assert [arrays[name].shape for name in arrays.files] == [(100, 3)]


def test_what_is_absent_says_so(store: Store) -> None:
    with pytest.raises(Absent):
        store.get("fit", KEY, Result)


def flip(path: Path, at: int) -> None:
    content = bytearray(path.read_bytes())
    content[at] ^= 1
    path.write_bytes(content)


def truncate(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-10])


@pytest.mark.parametrize(
    "damage",
    [
        lambda folder: flip(folder / "arrays.npz", 700),
        lambda folder: flip(folder / "manifest.json", 200),
        lambda folder: truncate(folder / "arrays.npz"),
        lambda folder: truncate(folder / "manifest.json"),
        lambda folder: (folder / "arrays.npz").write_bytes(b""),
        lambda folder: (folder / "manifest.json").write_text("[]"),
        lambda folder: (folder / "arrays.npz").unlink(),
        lambda folder: (folder / "manifest.json").unlink(),
    ],
)
def test_a_damaged_entry_counts_as_absent_and_can_be_written_again(store: Store, damage) -> None:
    store.put("fit", KEY, RESULT)
    damage(store.folder("fit", KEY))
    with pytest.raises(Absent):
        store.get("fit", KEY, Result)
    store.discard("fit", KEY)
    store.put("fit", KEY, RESULT)
    np.testing.assert_array_equal(store.get("fit", KEY, Result).positions, RESULT.positions)
    assert files(store.root) == [f"fit/{KEY}/arrays.npz", f"fit/{KEY}/manifest.json"]


def test_put_replaces_what_does_not_even_look_whole(store: Store) -> None:
    store.put("fit", KEY, RESULT)
    truncate(store.folder("fit", KEY) / "manifest.json")
    store.put("fit", KEY, RESULT)
    assert store.has("fit", KEY)


def test_an_entry_moved_to_another_key_counts_as_absent(store: Store) -> None:
    store.put("fit", KEY, RESULT)
    os.rename(store.folder("fit", KEY), store.folder("fit", "1" * 32))
    assert not store.has("fit", "1" * 32)


def test_an_entry_of_another_type_counts_as_absent(store: Store) -> None:
    store.put("fit", KEY, RESULT)
    with pytest.raises(Absent):
        store.get("fit", KEY, int | None)


def test_a_sound_entry_is_left_alone(store: Store) -> None:
    store.put("fit", KEY, RESULT, {"seconds": 1})
    assert store.put("fit", KEY, RESULT, {"seconds": 2}).about == {"seconds": 1}


def test_a_full_disk_is_one_sentence_and_leaves_nothing(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*args, **kwargs):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(store_module.os, "fsync", full)
    with pytest.raises(InputError, match="the disk is full"):
        store.put("fit", KEY, RESULT)
    assert files(store.root) == []


def test_leftovers_of_a_process_and_old_ones_are_cleaned(store: Store) -> None:
    store.put("fit", KEY, RESULT)
    for name, age in ((".tmp-111-aa", 0), (".tmp-222-bb", 0), (".tmp-333-cc", 10**6)):
        (store.root / "fit" / name).mkdir()
        (store.root / "fit" / name / "arrays.npz").write_bytes(b"half")
        os.utime(store.root / "fit" / name, (1e9 if age else os.stat(store.root).st_mtime,) * 2)
    assert len(store.list()) == 1
    store.clean(process=111)
    assert sorted(os.listdir(store.root / "fit")) == [".tmp-222-bb", ".tmp-333-cc", KEY]
    store.clean()
    assert sorted(os.listdir(store.root / "fit")) == [".tmp-222-bb", KEY]


def put_many(root: str, count: int) -> None:
    for i in range(count):
        Store(root).put("fit", f"{i:032d}", RESULT)


def test_two_processes_may_write_the_same_keys(store: Store) -> None:
    context = multiprocessing.get_context("spawn")
    processes = [context.Process(target=put_many, args=(str(store.root), 20)) for _ in range(2)]
    for process in processes:
        process.start()
    for process in processes:
        process.join()
    assert [process.exitcode for process in processes] == [0, 0]
    assert len(store.list()) == 20
    assert len(files(store.root)) == 40
    store.get("fit", f"{19:032d}", Result)


def test_the_manifest_is_json_that_a_person_can_read(store: Store) -> None:
    store.put("fit", KEY, RESULT, {"settings": {"threshold": 0.008}})
    manifest = json.loads((store.folder("fit", KEY) / "manifest.json").read_text())
    assert manifest["stage"] == "fit"
    assert manifest["about"]["settings"]["threshold"] == 0.008
    assert manifest["value"]["fields"]["label"] == "knee"
