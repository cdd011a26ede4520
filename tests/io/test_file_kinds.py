"""A file of another kind is called what it is, by its first bytes, whatever its name says."""

from __future__ import annotations

from pathlib import Path

import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.file_kinds import other_kind
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.safe_pickle.files import load_untrusted

KINDS = {
    "a PDF document": b"%PDF-1.7\n1 0 obj\n",
    "a PNG picture": b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    "an MP4 or MOV video": b"\0\0\0\x20ftypisom\0\0\2\0",
    "an AVI video": b"RIFF\x24\0\0\0AVI LIST",
    "a web page": b"\n<!DOCTYPE html><title>404</title>",
    "an HDF5": b"\x89HDF\r\n\x1a\n\0\0",
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", ["trial.c3d", "trial.trc", "trial.csv"])
def test_no_marker_file_is_called_damaged(kind: str, name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(KINDS[kind] + bytes(600))
    with pytest.raises(InputError, match=f"is {kind}.*not a marker file") as said:
        load_markers(tmp_path / name)
    assert "damaged" not in str(said.value)


@pytest.mark.parametrize("kind", KINDS)
def test_nor_a_pose_file(kind: str, tmp_path: Path) -> None:
    (tmp_path / "prior.npz").write_bytes(KINDS[kind] + bytes(600))
    with pytest.raises(InputError, match=f"is {kind}.*not a file of arrays"):
        load_untrusted(tmp_path / "prior.npz")


def test_what_the_readers_know_is_no_other_kind() -> None:
    for start in (b"PK\3\4", b"\x93NUMPY", b"\x80\4\x95", b"\1\x50", b"PathFileType\t4", b"Frame,Time", b"\x1f\x8b"):
        assert other_kind(start + bytes(100)) is None
