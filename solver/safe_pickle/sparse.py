"""Sparse matrices as plain arrays: checked, and dense where wanted, without scipy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.safe_pickle.limits import Damaged


@dataclass(frozen=True)
class Sparse:
    """A matrix in coordinate form.

    Attributes
    ----------
    shape : (rows, columns)
    row, column : (N,) indices of the entries
    data : (N,) entries; those at one place add up
    """

    shape: tuple[int, int]
    row: np.ndarray
    column: np.ndarray
    data: np.ndarray

    def toarray(self) -> np.ndarray:
        """(rows, columns) float64."""
        dense = np.zeros(self.shape)
        np.add.at(dense, (self.row, self.column), self.data)
        return dense


def sparse_from_state(layout: str, state: dict) -> Sparse:
    """The attributes of a scipy ``csc``, ``csr`` or ``coo`` matrix, with every index checked."""
    rows, columns = (int(n) for n in state.get("_shape", state.get("shape", ())))
    if rows < 0 or columns < 0:
        raise Damaged("a sparse matrix in it has a negative shape")
    data = np.asarray(state["data"]).astype(float)
    if layout == "coo":
        row, column = state["coords"] if "coords" in state else (state["row"], state["col"])
    else:
        starts = np.asarray(state["indptr"]).astype(np.int64)
        minor = state["indices"]
        count = columns if layout == "csc" else rows
        if len(starts) != count + 1 or starts[0] != 0 or starts[-1] != len(data) or (np.diff(starts) < 0).any():
            raise Damaged("a sparse matrix in it has impossible index pointers")
        major = np.repeat(np.arange(count), np.diff(starts))
        row, column = (minor, major) if layout == "csc" else (major, minor)
    row, column = np.asarray(row).astype(np.int64), np.asarray(column).astype(np.int64)
    if not (row.shape == column.shape == data.shape == (len(data),)):
        raise Damaged("a sparse matrix in it has index lists of different lengths")
    if len(data) and (row.min() < 0 or row.max() >= rows or column.min() < 0 or column.max() >= columns):
        raise Damaged("a sparse matrix in it has entries outside its shape")
    return Sparse((rows, columns), row, column, data)
