"""How candidates are counted: from 1 wherever somebody reads it, from 0 in files, settings and arrays."""

from __future__ import annotations


def candidate_number(row: int) -> int:
    """The number by which the user knows the candidate in a row of the orientation."""
    return row + 1


def candidate_row(number: int) -> int:
    """The row, as files and settings have it, of the candidate that the user knows by a number."""
    return number - 1
