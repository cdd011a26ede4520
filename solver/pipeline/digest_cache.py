"""Digests of large files remembered, so that a long video is not read whole each time a session is looked at.

A size and a time of change prove nothing: both stay as they were when a file is replaced by a copy that keeps its
times. So a small file is read each time. A larger one is remembered by its place on the disk (device and inode), size,
time of change, and the time that the system itself notes of every change (ctime), which no program can set; and some
of its content is compared each time, for disks that keep no such time (FAT, some network drives). Before and after a
stage reads it, it is read whole in any case (``markerscope.solver.pipeline.source``).
"""

from __future__ import annotations

import hashlib
import json
import os
import time
from pathlib import Path
from typing import Any

from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.pipeline.digest import file_digest

SMALL_BYTES = 16 << 20
"""Read whole each time, which takes about ten milliseconds."""
_SETTLED_S = 2.0
"""A file changed this recently may change again without its time stamp showing it, so it is not remembered."""
_SAMPLES, _SAMPLE_BYTES = 64, 16 << 10
_SYSTEM_NOTES_CHANGES = os.name != "nt"
"""On Windows, ctime is the time of creation: there, a large file is read whole each time, too."""


def stamp_of(path: str | Path) -> tuple[int, ...]:
    """Device, inode, size in bytes, and the times of change (the writer's and the system's, ns) of a file.

    Raises
    ------
    OSError : it is not there
    """
    status = os.stat(path)
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns, status.st_ctime_ns


class DigestCache:
    """File digests, remembered where a file is large.

    Parameters
    ----------
    path : the JSON file they are kept in; a missing or damaged one counts as empty
    """

    def __init__(self, path: str | Path) -> None:
        self._path = Path(path)
        self._known: dict[str, list[Any]] = {}
        self._changed = False
        try:
            known = json.loads(self._path.read_text(encoding="utf-8"))
            self._known = {str(name): list(row) for name, row in known.items()}
        except (OSError, ValueError, AttributeError, TypeError):
            pass

    def digest(self, path: str | Path) -> str:
        """``file_digest(path)``, from memory if a large file is as it was."""
        name = str(Path(path).resolve())
        try:
            stamp = stamp_of(path)
            if stamp[2] <= SMALL_BYTES or not _SYSTEM_NOTES_CHANGES:
                return file_digest(path)
            row = [list(stamp), _sampled(path, stamp[2])]
        except OSError:
            return file_digest(path)
        known = self._known.get(name)
        if known is not None and known[:2] == row and len(known) == 3:
            return str(known[2])
        value = file_digest(path)
        if time.time_ns() - max(stamp[3:]) > _SETTLED_S * 1e9:
            self._known[name] = [*row, value]
            self._changed = True
        return value

    def save(self) -> None:
        """Write what was learned, if anything, and if its folder is there: a refused input must not make one."""
        if self._changed and self._path.parent.is_dir():
            write_text_atomic(self._path, json.dumps(self._known, indent=1, sort_keys=True) + "\n")
            self._changed = False


def _sampled(path: str | Path, size: int) -> str:
    """Digest of pieces spread evenly over a file, its beginning and end among them."""
    found = hashlib.sha256()
    with open(path, "rb") as file:
        for i in range(_SAMPLES):
            file.seek(i * (size - _SAMPLE_BYTES) // (_SAMPLES - 1))
            found.update(file.read(_SAMPLE_BYTES))
    return found.hexdigest()
