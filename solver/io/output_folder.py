"""The folder that results go to: checked before long work, left clean after it was refused."""

from __future__ import annotations

import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import cannot_write

_PROBE_BYTES = 1 << 16


def check_output_folder(folder: str | Path) -> None:
    """Make sure that a folder can be made and written to, and leave no trace.

    Raises
    ------
    InputError : a file is in its place, or the file system refuses (read-only, full, no permission...)
    """
    folder = Path(folder).absolute()
    base = next(place for place in (folder, *folder.parents) if place.exists() or place.parent == place)
    if not base.is_dir():
        raise InputError("cannot be an output folder: a file of that name is there", base, "choose another name")
    probe = None
    try:
        probe = tempfile.mkdtemp(prefix=".markerscope-", dir=base)
        with open(Path(probe) / "probe", "wb") as file:
            file.write(bytes(_PROBE_BYTES))
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        raise cannot_write(folder, error) from error
    finally:
        if probe is not None:
            shutil.rmtree(probe, ignore_errors=True)


def remove_if_empty(folder: str | Path) -> None:
    """Remove a folder tree that holds no file."""
    for place, _, files in os.walk(folder, topdown=False):
        if not files:
            with suppress(OSError):  # holds a folder that was not empty
                os.rmdir(place)
