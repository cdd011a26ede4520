"""A file that changes between the digest and the reading: nothing is stored under the digest of what it was."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress
from markerscope.solver.pipeline import source as source_module
from markerscope.solver.pipeline.digest import file_digest
from markerscope.solver.pipeline.digest_cache import SMALL_BYTES, DigestCache
from markerscope.solver.pipeline.methods import GRAPHS
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import NoSettings, Stage, run_graph
from markerscope.solver.pipeline.stages import SOURCES
from markerscope.solver.pipeline.store import Store

RIGHT, WRONG = b"right content", b"other content"
READERS = [
    (method, stage.name, source)
    for method, graph in GRAPHS.items()
    for stage in graph
    for source in stage.inputs
    if source in SOURCES
]
"""Every stage of every method that reads a file, and which."""


def overwritten(path: Path, content: bytes) -> None:
    """Other content of the same size, with the times that the file had."""
    status = path.stat()
    path.write_bytes(content)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))


def replaced(path: Path, content: bytes) -> None:
    """Another file of the same size and times in its place."""
    status, other = path.stat(), path.with_name("other")
    other.write_bytes(content)
    os.utime(other, ns=(status.st_atime_ns, status.st_mtime_ns))
    os.replace(other, path)


WAYS = pytest.mark.parametrize("change", [overwritten, replaced])


class Reading:
    """A graph of one stage that reads a file of one kind, as a real stage of a method does."""

    def __init__(self, folder: Path, name: str = "stage", source: str = "prior_file") -> None:
        self.store, self.source = Store(folder / "results"), source
        self.path = folder / "input.bin"
        self.path.write_bytes(RIGHT)
        os.utime(self.path, ns=(10**18, 10**18))
        self.before: Callable[[], object] = lambda: None
        self.after: Callable[[], object] = lambda: None
        self.stage = Stage(name, 1, NoSettings, (source,), self.run, str)
        self.ran = 0
        self.given = {source: Source.file(self.path)}

    def run(self, settings: Any, progress: Progress, **given: Any) -> str:
        self.ran += 1
        self.before()
        content = given[self.source].read_bytes()
        self.after()
        progress(0.5, "half")
        return str(content, "ascii")

    def go(self) -> str:
        return str(run_graph([self.stage], self.given, {}, self.store)[self.stage.name])


@WAYS
@pytest.mark.parametrize(("name", "source"), sorted({reader[1:] for reader in READERS}))
def test_other_content_is_refused_whichever_file_it_is(
    tmp_path: Path, name: str, source: str, change: Callable[[Path, bytes], None]
) -> None:
    reading = Reading(tmp_path, name, source)
    change(reading.path, WRONG)
    with pytest.raises(InputError, match="changed while it was read; ") as refused:
        reading.go()
    assert refused.value.where == str(reading.path)
    assert reading.ran == 0 and not reading.store.list()


@WAYS
def test_content_that_changes_while_it_is_read_is_not_stored(
    tmp_path: Path, change: Callable[[Path, bytes], None]
) -> None:
    reading = Reading(tmp_path)
    reading.before = lambda: change(reading.path, WRONG)
    with pytest.raises(InputError, match="changed while it was read"):
        reading.go()
    assert not reading.store.list()
    change(reading.path, RIGHT)
    reading.before = lambda: None
    assert reading.go() == str(RIGHT, "ascii"), "nothing wrong was kept for the right file"


@WAYS
def test_a_file_that_was_another_for_a_moment_is_read_again(
    tmp_path: Path, change: Callable[[Path, bytes], None]
) -> None:
    reading = Reading(tmp_path)

    def for_a_moment() -> None:
        if reading.ran == 1:
            change(reading.path, WRONG)

    reading.before, reading.after = for_a_moment, lambda: change(reading.path, RIGHT)
    with pytest.raises(InputError, match="changed while it was read"):
        reading.go()
    assert reading.ran == 2 and not reading.store.list()
    reading.ran, reading.after = 0, lambda: change(reading.path, RIGHT) if reading.ran == 1 else None
    assert reading.go() == str(RIGHT, "ascii") and reading.ran == 2


def test_a_long_reading_is_ended_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(source_module, "_GLANCE_EVERY_S", 0.0)
    reading = Reading(tmp_path)
    reading.after = lambda: replaced(reading.path, WRONG)
    ended = False

    def run(settings: Any, progress: Progress, **given: Any) -> str:
        nonlocal ended
        reading.run(settings, progress, **given)
        ended = True
        return ""

    reading.stage = Stage("stage", 1, NoSettings, (reading.source,), run, str)
    with pytest.raises(InputError, match="changed while it was read"):
        reading.go()
    assert not ended


def test_half_a_file_that_cannot_be_used_is_said_to_have_changed(tmp_path: Path) -> None:
    reading = Reading(tmp_path)

    def refuse() -> None:
        reading.path.write_bytes(RIGHT[:3])
        raise InputError("is no pose prior", reading.path)

    reading.before = refuse
    with pytest.raises(InputError, match="changed while it was read"):
        reading.go()


def test_the_list_beside_a_trc_counts_as_part_of_it(tmp_path: Path) -> None:
    path, listed = tmp_path / "a.trc", tmp_path / "a.filled.csv"
    path.write_bytes(RIGHT)
    alone = Source.file(path)
    assert alone.digest == alone.content == file_digest(path)
    listed.write_text("marker,first_row,last_row\n1,1,2\n")
    first = Source.file(path)
    listed.write_text("marker,first_row,last_row\n1,1,3\n")
    second = Source.file(path)
    assert len({alone.digest, first.digest, second.digest}) == 3
    assert second.content == alone.content, "the file itself holds what it held"


def large(path: Path, content: bytes) -> bytes:
    return content * (SMALL_BYTES // len(content) + 1)


@WAYS
@pytest.mark.parametrize("size", ["small", "large"])
def test_the_same_size_and_times_are_not_taken_for_the_same_content(
    tmp_path: Path, change: Callable[[Path, bytes], None], size: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("markerscope.solver.pipeline.digest_cache._SETTLED_S", -1.0)
    path, much = tmp_path / "video", size == "large"
    first, other = bytearray(large(path, RIGHT) if much else RIGHT), bytearray(large(path, RIGHT) if much else RIGHT)
    other[len(other) // 3] ^= 1
    path.write_bytes(first)
    os.utime(path, ns=(10**18, 10**18))
    cache = DigestCache(tmp_path / "cache.json")
    known = cache.digest(path)
    cache.save()
    time.sleep(0.02)  # a tick of the system's clock
    change(path, bytes(other))
    assert path.stat().st_mtime_ns == 10**18 and path.stat().st_size == len(first)
    for again in (cache, DigestCache(tmp_path / "cache.json")):
        assert again.digest(path) == file_digest(path) != known


def test_where_the_system_notes_no_change_samples_tell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("markerscope.solver.pipeline.digest_cache._SETTLED_S", -1.0)
    monkeypatch.setattr(
        "markerscope.solver.pipeline.digest_cache.stamp_of", lambda p: (0, 0, Path(p).stat().st_size, 0, 0)
    )
    path = tmp_path / "video"
    content = np.random.default_rng(0).bytes(SMALL_BYTES + 1)
    path.write_bytes(content)
    cache = DigestCache(tmp_path / "cache.json")
    known = cache.digest(path)
    path.write_bytes(content[::-1])
    assert cache.digest(path) != known


def test_a_small_file_is_read_whole_each_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("markerscope.solver.pipeline.digest_cache._SETTLED_S", -1.0)
    monkeypatch.setattr(
        "markerscope.solver.pipeline.digest_cache.stamp_of", lambda p: (0, 0, Path(p).stat().st_size, 0, 0)
    )
    path = tmp_path / "prior"
    content = bytearray(4 << 20)
    path.write_bytes(content)
    cache = DigestCache(tmp_path / "cache.json")
    known = cache.digest(path)
    content[20_000] = 1  # between two samples
    path.write_bytes(content)
    assert cache.digest(path) == file_digest(path) != known
