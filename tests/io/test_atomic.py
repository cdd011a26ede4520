"""Files appear whole or not at all, and refusals are one sentence."""

from __future__ import annotations

import errno
import os
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import atomic_path, make_folder, write_bytes_atomic, write_text_atomic


def test_replaces_the_old_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "a.txt"
    write_text_atomic(target, "one\n")
    write_text_atomic(target, "zwö\n")
    assert target.read_bytes() == "zwö\n".encode()
    assert [p.name for p in tmp_path.iterdir()] == ["a.txt"]


def test_a_failure_keeps_the_old_file(tmp_path: Path) -> None:
    target = tmp_path / "a.bin"
    write_bytes_atomic(target, b"old")
    with pytest.raises(ZeroDivisionError), atomic_path(target) as temporary:
        temporary.write_bytes(b"half of the n")
        1 / 0  # noqa: B018
    assert target.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["a.bin"]


def test_keeps_the_suffix_for_writers_that_add_one(tmp_path: Path) -> None:
    with atomic_path(tmp_path / "a.npz") as temporary:
        np.savez(temporary, x=np.arange(3))
    assert np.load(tmp_path / "a.npz")["x"].tolist() == [0, 1, 2]


@pytest.mark.parametrize(
    ("number", "word"),
    [(errno.ENOSPC, "full"), (errno.EACCES, "permission"), (errno.EROFS, "read-only"), (errno.ENXIO, "written")],
)
def test_file_system_errors_become_one_sentence(tmp_path: Path, number: int, word: str) -> None:
    target = tmp_path / "a.csv"
    with pytest.raises(InputError, match=word) as caught, atomic_path(target) as temporary:
        temporary.write_text("begun")
        raise OSError(number, os.strerror(number))
    assert str(target) in str(caught.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", ["no/such/folder/a.csv", "file/a.csv", "folder", "n" * 300])
def test_impossible_targets(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("x")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError):
        write_text_atomic(tmp_path / name, "x")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["file", "folder"]


def test_output_folder(tmp_path: Path) -> None:
    assert make_folder(tmp_path / "a" / "b").is_dir()
    (tmp_path / "file").write_text("x")
    for name in ("file", "file/below"):
        with pytest.raises(InputError):
            make_folder(tmp_path / name)
