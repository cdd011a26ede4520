"""Errors that a user can act on."""

from __future__ import annotations

from pathlib import Path


class MarkerscopeError(Exception):
    """Anything Markerscope refuses to do, said in one sentence."""


class InputError(MarkerscopeError):
    """An input that cannot be used: what is wrong, where, and what to do about it.

    Parameters
    ----------
    what : what was found, without a closing full stop ("the file is truncated after frame 12")
    where : the file, setting or marker it was found in
    remedy : what the user can do, as an imperative clause ("export it again")
    """

    def __init__(self, what: str, where: str | Path | None = None, remedy: str = "") -> None:
        self.what = what
        self.where = None if where is None else str(where)
        self.remedy = remedy
        place = f"{self.where}: " if self.where else ""
        super().__init__(f"{place}{what}{f'; {remedy}' if remedy else ''}.")

    def __reduce__(self) -> tuple[type, tuple[str, str | None, str]]:
        """Travel from a worker process whole."""
        return type(self), (self.what, self.where, self.remedy)


class Cancelled(MarkerscopeError):
    """The user stopped the work; nothing was written."""
