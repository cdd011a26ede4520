"""Write a file whole or not at all, and say in one sentence why it could not be written."""

from __future__ import annotations

import errno
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import shown

_REASONS = {
    errno.ENOSPC: ("the disk is full", "free some space or choose another disk"),
    errno.EDQUOT: ("the disk quota is used up", "free some space or choose another disk"),
    errno.EFBIG: ("the file is larger than the disk or the system allows", "choose another disk"),
    errno.EACCES: ("no permission to write there", "choose a folder you may write to"),
    errno.EPERM: ("no permission to write there", "choose a folder you may write to"),
    errno.EROFS: ("the disk is read-only", "choose another folder"),
    errno.ENOENT: ("its folder does not exist", "create the folder or choose another"),
    errno.ENOTDIR: ("a part of its path is a file, not a folder", "choose another folder"),
    errno.EISDIR: ("a folder of that name is there already", "choose another name"),
    errno.ENAMETOOLONG: ("its name is too long", "choose a shorter name"),
    errno.EBUSY: ("it is open in another program", "close that program"),
    errno.EIO: ("the disk reports an input/output error", "choose another disk"),
}


def cannot_write(target: str | Path, error: OSError) -> InputError:
    """The one sentence for a failure of the file system while writing ``target``."""
    reason, remedy = _REASONS.get(error.errno or 0, (error.strerror or str(error), "choose another place"))
    return InputError(f"cannot be written: {reason}", target, remedy)


@contextmanager
def atomic_path(target: str | Path) -> Iterator[Path]:
    """A temporary path beside ``target`` that becomes ``target`` when the block ends well.

    The temporary name keeps the suffix, since some writers (``numpy.savez``) add one where it is absent.
    Whatever fails inside the block, the old ``target`` is left as it was and nothing new stays behind.

    Raises
    ------
    InputError : the file system refuses (full, read-only, no such folder...)
    """
    target = Path(target)
    temporary = target.with_name(f".{target.stem[:40]}.{secrets.token_hex(4)}{target.suffix}")
    try:
        if target.is_dir():
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        yield temporary
        _flush_to_disk(temporary)
        os.replace(temporary, target)
    except OSError as error:
        raise cannot_write(target, error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def write_bytes_atomic(target: str | Path, data: bytes) -> None:
    """Replace ``target`` by ``data``, whole or not at all."""
    with atomic_path(target) as temporary:
        temporary.write_bytes(data)


def write_text_atomic(target: str | Path, text: str) -> None:
    r"""Replace ``target`` by ``text`` in UTF-8 with bare line feeds, whole or not at all.

    Bytes of file names that are not UTF-8 stand in it as ``\xff``.
    """
    write_bytes_atomic(target, shown(text).encode("utf-8"))


def make_folder(path: str | Path) -> Path:
    """Create an output folder (and its parents) unless it is there."""
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError as error:
        raise InputError(
            "cannot be an output folder: a file of that name is there", folder, "choose another name"
        ) from error
    except OSError as error:
        raise cannot_write(folder, error) from error
    return folder


def _flush_to_disk(path: Path) -> None:
    """Have the data on disk before the rename, or a crash could leave an empty file under the final name."""
    handle = os.open(path, os.O_RDWR)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
