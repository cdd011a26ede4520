"""Several files written all or none: made in a folder of their own first, then moved, and moved back where that fails.

All that can fail (a value that cannot be written, a full disk, an interruption) fails while the files are made, when
none of the old ones has been touched.
"""

from __future__ import annotations

import errno
import os
import secrets
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import cannot_write, make_folder


@contextmanager
def together(folder: str | Path, gone: Sequence[str] = (), staging: Path | None = None) -> Iterator[Path]:
    """A folder to write in, whose files take their places in ``folder`` when the block ends well.

    Parameters
    ----------
    folder : made where it is not there; subfolders of the staging folder are merged into it
    gone : names in ``folder`` that are taken away where no new file has them: what an earlier run left
    staging : the folder to write in, on the same disk; by default one beside the files

    Raises
    ------
    InputError : the file system refuses; every file is as it was
    """
    folder = Path(folder)
    new = next((place for place in (*reversed(folder.parents), folder) if not place.exists()), None)
    own = staging or folder / f".tmp-{os.getpid()}-{secrets.token_hex(4)}"
    inner: list[Path] = []
    try:
        make_folder(folder)
        own.mkdir(parents=True)
        yield own
        # In the order they were written: a folder that holds the last one holds all.
        made = sorted((path for path in own.rglob("*") if path.is_file()), key=lambda path: path.stat().st_mtime_ns)
        moves: list[tuple[Path | None, Path]] = [(path, folder / path.relative_to(own)) for path in made]
        targets = {target for _, target in moves}
        moves += [(None, folder / name) for name in gone if folder / name not in targets]
        inner = sorted({target.parent for _, target in moves if not target.parent.exists()})
        for place in inner:
            make_folder(place)
        move_all(moves, make_folder(own / ".before"))
    except BaseException as error:
        shutil.rmtree(own, ignore_errors=True)
        for place in (*inner, *([new] if new is not None else [])):
            _remove_empty(place)
        if isinstance(error, OSError) and error.errno is not None:
            raise cannot_write(folder, error) from error
        raise
    shutil.rmtree(own, ignore_errors=True)


def move_all(moves: Sequence[tuple[Path | None, Path]], before: Path) -> None:
    """Put finished files in their places, or take files away (None), all or none of them.

    Parameters
    ----------
    before : an empty folder on the same disk, for what was there

    Raises
    ------
    InputError : the file system refuses; every file is as it was
    """
    done: list[tuple[Path, Path]] = []
    try:
        for number, (source, target) in enumerate(moves):
            _may_be_replaced(target)
            kept = before / str(number)
            if target.exists():
                _keep(target, kept)
            done.append((target, kept))
            if source is not None:
                os.replace(source, target)
            else:
                target.unlink(missing_ok=True)
    except BaseException as error:
        for target, kept in reversed(done):
            with suppress(OSError):
                if kept.exists():
                    os.replace(kept, target)
                else:
                    target.unlink(missing_ok=True)
        if isinstance(error, PermissionError):
            what = "close the program that has it open, or choose another folder"
            raise InputError("cannot be replaced", moves[len(done) - 1][1], what) from error
        if isinstance(error, OSError):
            raise cannot_write(moves[max(len(done) - 1, 0)][1], error) from error
        raise


def _may_be_replaced(target: Path) -> None:
    if target.is_dir():
        raise cannot_write(target, IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR)))


def _keep(target: Path, kept: Path) -> None:
    """Have what is there twice; a disk without links has it moved away for the moment."""
    try:
        os.link(target, kept)
    except OSError:
        os.replace(target, kept)


def _remove_empty(folder: Path) -> None:
    for place, _, _ in os.walk(folder, topdown=False):
        with suppress(OSError):  # holds something
            os.rmdir(place)
