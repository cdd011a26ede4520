"""What a file may ask for, and the two ways in which it is turned down."""

from __future__ import annotations

SLACK = 64 << 20
"""Bytes that any file may claim, however small it is."""

EXPANSION = 50
"""How many times its own size a file may grow to while it is decompressed."""

DEPTH = 16
"""How deep pickles may be nested inside pickles (object arrays, storages)."""


class Forbidden(Exception):
    """The file names something that is not on the allow-list."""

    def __init__(self, name: str) -> None:
        super().__init__("".join(c for c in name if c.isprintable())[:80])


class Damaged(Exception):
    """The file is not what its first bytes promised: what is wrong, as a clause."""


class Budget:
    """Bytes that may still be made from a file, so that a size claimed in it cannot exhaust the memory."""

    def __init__(self, size: int) -> None:
        self._left = size

    def spend(self, size: int) -> None:
        """Take ``size`` bytes, or raise ``Damaged`` where the file claims more than it can hold."""
        self._left -= size
        if self._left < 0:
            raise Damaged("it claims far more data than a file of its size can hold")
