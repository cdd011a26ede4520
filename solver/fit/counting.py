"""How candidates are counted: from 1 wherever somebody reads it, from 0 in files, settings and arrays."""

from __future__ import annotations


def candidate_number(row: int) -> int:
    """The number by which the user knows the candidate in a row of the orientation."""
    return row + 1
