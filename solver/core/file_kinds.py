"""What kind a file is by its first bytes, for a file that was given where another kind is wanted."""

from __future__ import annotations

from pathlib import Path

from markerscope.solver.core.errors import InputError

_FIRST = (
    (b"%PDF-", "a PDF document"),
    (b"\x89PNG\r\n\x1a\n", "a PNG picture"),
    (b"\xff\xd8\xff", "a JPEG picture"),
    (b"GIF8", "a GIF picture"),
    (b"\x1aE\xdf\xa3", "a Matroska or WebM video"),
    (b"\x00\x00\x01\xba", "an MPEG video"),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 or MATLAB 7.3 file"),
    (b"MATLAB 5.0 MAT-file", "a MATLAB file"),
    (b"7z\xbc\xaf\x27\x1c", "a 7-Zip archive"),
    (b"Rar!\x1a\x07", "a RAR archive"),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", "an old Office document (xls, doc)"),
    (b"\x7fELF", "a program"),
    (b"SQLite format 3\x00", "an SQLite database"),
    (b"glTF", "a glTF model"),
    (b"Kaydara FBX Binary", "an FBX file"),
)
_RIFF = {b"AVI ": "an AVI video", b"WAVE": "a WAV sound", b"WEBP": "a WebP picture"}


def other_kind(data: bytes) -> str | None:
    """The kind of a file that neither holds markers nor a pose, with its article; None where its start tells none."""
    if data[:4] == b"RIFF" and data[8:12] in _RIFF:
        return _RIFF[data[8:12]]
    if data[4:8] == b"ftyp":
        return "an MP4 or MOV video"
    if data[:512].lstrip().lower().startswith((b"<!doctype html", b"<html")):
        return "a web page (HTML)"
    return next((kind for start, kind in _FIRST if data.startswith(start)), None)


def refuse_other_kind(data: bytes, path: str | Path, wanted: str) -> None:
    """Refuse a file by what it is, before a reader takes it for a damaged one of its own kind.

    Raises
    ------
    InputError : its first bytes say that it is of another kind than ``wanted``
    """
    if kind := other_kind(data):
        raise InputError(f"is {kind} by its first bytes, not {wanted}", path, "give the file that was meant")
