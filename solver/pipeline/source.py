"""Files as inputs of stages: known by what they hold, and held to it while they are read.

A digest is taken before the file is read, often long before. What is computed from other content must not be stored
under it, so a stage that reads files is surrounded by a ``Watch``: the content is compared with the digest before and
after, and the file's stamp, which shows a content that was there for a moment only, all the while.
"""

from __future__ import annotations

import hashlib
import time
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.filled_list import filled_list_path
from markerscope.solver.pipeline.digest import file_digest
from markerscope.solver.pipeline.digest_cache import DigestCache, stamp_of

_GLANCE_EVERY_S = 0.2


@dataclass(frozen=True)
class Source:
    """Something given from outside: a file (or None where the user has none), known by what it holds.

    Attributes
    ----------
    value : what a stage is given, a file's path
    digest : of all that is read with it, in the keys of results
    content : SHA-256 of the file alone, empty where it is not known
    """

    value: Any
    digest: str
    content: str = ""

    @staticmethod
    def file(path: str | Path | None, cache: DigestCache | None = None) -> Source:
        """A file as a source; its name and place do not matter to the results."""
        if path is None:
            return Source(None, "none")
        digest = file_digest if cache is None else cache.digest
        content = digest(path)
        return Source(Path(path), _together(content, [digest(other) for other in beside(Path(path))]), content)

    def require(self) -> None:
        """Make sure that a file holds what its digest says.

        Raises
        ------
        InputError : it does not
        """
        if isinstance(self.value, Path) and Source.file(self.value).digest != self.digest:
            raise changed(self.value)


def beside(path: Path) -> tuple[Path, ...]:
    """Files that are read with a file, by their names: the list of filled positions of a TRC file."""
    others = (filled_list_path(path),) if path.suffix.lower() == ".trc" else ()
    return tuple(other for other in others if other.is_file())


def _together(content: str, others: Iterable[str]) -> str:
    joined = [content, *others]
    return content if len(joined) == 1 else hashlib.sha256(" ".join(joined).encode()).hexdigest()


def contents(sources: Mapping[str, Source]) -> dict[str, str]:
    """SHA-256 of each file, by the name of its source, as far as they are known."""
    return {name: source.content for name, source in sources.items() if source.content}


class Touched(Exception):
    """A file that is being read holds what it did, but may have held something else for a moment."""


class Changed(InputError):
    """A file does not hold what it held when its digest was taken."""


def changed(path: str | Path) -> Changed:
    """The one sentence for it."""
    return Changed("changed while it was read", path, "leave it as it is until the work has ended, and try again")


class Watch:
    """Files while they are read.

    Parameters
    ----------
    sources : those that are files

    Raises
    ------
    InputError : one holds something else than its digest says
    """

    def __init__(self, sources: Iterable[Source]) -> None:
        self._sources = [source for source in sources if isinstance(source.value, Path)]
        self._looked = 0.0
        self._stamps = self._read_stamps()
        self._compare()

    def glance(self) -> None:
        """Look at the stamps, unless that was done a moment ago.

        Raises
        ------
        InputError : a file holds something else
        Touched : it holds the same, and may have held something else
        """
        now = time.monotonic()
        if self._sources and now - self._looked >= _GLANCE_EVERY_S:
            self._looked = now
            self.look()

    def look(self) -> None:
        """The same, whenever the last look was."""
        if self._read_stamps() != self._stamps:
            self._compare()
            raise Touched

    def end(self) -> None:
        """Make sure that what was read is what the digests say; raises as ``glance`` does."""
        self._compare()
        self.look()

    def _compare(self) -> None:
        for source in self._sources:
            source.require()

    def _read_stamps(self) -> list[tuple[int, ...] | None]:
        files = [file for source in self._sources for file in (source.value, *beside(source.value))]
        return [_stamp(file) for file in files]


def _stamp(path: Path) -> tuple[int, ...] | None:
    try:
        return stamp_of(path)
    except OSError:
        return None
