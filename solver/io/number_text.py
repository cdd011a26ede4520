"""Tables of numbers as lines of text, a row at a time."""

from __future__ import annotations

import numpy as np


def number_lines(table: np.ndarray, number: str, separator: str, lost: str = "nan") -> list[str]:
    """Each row of a table as a line.

    Parameters
    ----------
    table : (rows, columns) numbers, NaN = lost
    number : how one is written, as ``%`` takes it: ``%.6f``
    separator : between the cells
    lost : what stands for NaN
    """
    line = separator.join([number] * table.shape[1])
    lines = [line % tuple(row) for row in table.tolist()]
    if lost != "nan":
        for i in np.flatnonzero(np.isnan(table).any(axis=1)):
            lines[i] = lines[i].replace("nan", lost)
    return lines
