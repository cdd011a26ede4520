"""Digests tell different things apart and equal things not."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline import digest_cache
from markerscope.solver.pipeline.digest import digest_of, file_digest, result_key
from markerscope.solver.pipeline.digest_cache import DigestCache


@dataclass(frozen=True)
class Settings:
    threshold: float = 0.008
    name: str | None = None
    pairs: tuple[tuple[int, int], ...] = ()


def test_the_file_digest_is_sha256(tmp_path: Path) -> None:
    path = tmp_path / "a"
    path.write_bytes(b"markers" * 1000)
    assert file_digest(path) == hashlib.sha256(b"markers" * 1000).hexdigest()


@pytest.mark.parametrize("name", ["absent", "."])
def test_a_file_that_is_none_is_said(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError):
        file_digest(tmp_path / name)
    with pytest.raises(InputError):
        DigestCache(tmp_path / "cache.json").digest(tmp_path / name)


settings = st.builds(
    Settings,
    st.floats(allow_nan=False),
    st.one_of(st.none(), st.text()),
    st.lists(st.tuples(st.integers(), st.integers()), max_size=3).map(tuple),
)


@given(settings, settings)
def test_settings_have_the_same_digest_only_if_equal(a: Settings, b: Settings) -> None:
    assert (digest_of(a) == digest_of(b)) == (a == b)
    assert digest_of(a) == digest_of(replace(a))


def test_numbers_that_are_equal_have_the_same_digest() -> None:
    assert digest_of(Settings(threshold=1)) == digest_of(Settings(threshold=1.0))
    assert digest_of({"x": True}) != digest_of({"x": 1})
    assert digest_of(np.zeros(4)) != digest_of(np.zeros((2, 2)))
    assert digest_of(np.zeros(4)) != digest_of(np.zeros(4, dtype=np.float32))


def test_a_key_depends_on_everything_it_should() -> None:
    base = ("fit", 1, Settings(), {"markers": "a", "prior": "b"})
    keys = {
        result_key(*base),
        result_key("angles", *base[1:]),
        result_key("fit", 2, *base[2:]),
        result_key("fit", 1, Settings(threshold=0.01), base[3]),
        result_key("fit", 1, Settings(), {"markers": "b", "prior": "a"}),
    }
    assert len(keys) == 5
    assert result_key("fit", 1, Settings(), {"prior": "b", "markers": "a"}) == result_key(*base)


@pytest.fixture
def no_file_is_small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(digest_cache, "SMALL_BYTES", 0)
    monkeypatch.setattr(digest_cache, "_SAMPLE_BYTES", 1)


@pytest.mark.usefixtures("no_file_is_small")
def test_the_cache_reads_a_large_file_once_and_again_when_it_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path, read = tmp_path / "video", []
    monkeypatch.setattr(digest_cache, "file_digest", lambda p: read.append(p) or file_digest(p))
    monkeypatch.setattr(digest_cache, "_SETTLED_S", -1.0)
    path.write_bytes(b"one")
    cache = DigestCache(tmp_path / "cache.json")
    first = cache.digest(path)
    cache.save()
    assert DigestCache(tmp_path / "cache.json").digest(path) == first
    assert len(read) == 1
    path.write_bytes(b"two")
    assert cache.digest(path) == file_digest(path) != first


@pytest.mark.usefixtures("no_file_is_small")
def test_remembering_makes_no_folder(tmp_path: Path) -> None:
    path = tmp_path / "markers"
    path.write_bytes(b"one")
    os.utime(path, ns=(10**18, 10**18))
    cache = DigestCache(tmp_path / "sub" / "cache.json")
    cache.digest(path)
    cache.save()
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.usefixtures("no_file_is_small")
def test_a_file_that_just_changed_is_not_remembered(tmp_path: Path) -> None:
    # Within a time stamp's resolution, a second change of the same length would go unseen.
    path = tmp_path / "markers"
    path.write_bytes(b"one")
    cache = DigestCache(tmp_path / "cache.json")
    first, stamp = cache.digest(path), path.stat()
    path.write_bytes(b"two")
    os.utime(path, ns=(stamp.st_atime_ns, stamp.st_mtime_ns))
    assert cache.digest(path) != first


@pytest.mark.parametrize("content", ["", "[1]", '{"a": 3}', "\x00"])
def test_a_damaged_cache_counts_as_empty(tmp_path: Path, content: str) -> None:
    (tmp_path / "cache.json").write_text(content)
    path = tmp_path / "markers"
    path.write_bytes(b"one")
    assert DigestCache(tmp_path / "cache.json").digest(path) == file_digest(path)
