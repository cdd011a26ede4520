"""NumPy arrays that VTK draws from in place: written again each frame, allocated only when their size changes."""

from __future__ import annotations

from typing import Any

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData


class Geometry:
    """Points with what belongs to them, and cells of one kind (triangles or line pieces).

    Attributes
    ----------
    data : the vtkPolyData that a mapper draws
    """

    def __init__(self) -> None:
        self.data: Any = vtkPolyData()
        self._points: Any = vtkPoints()
        self.data.SetPoints(self._points)
        self._kept: dict[str, np.ndarray] = {}

    def set_points(self, points: np.ndarray) -> None:
        """Positions (N, 3) m."""
        wanted = np.ascontiguousarray(points, dtype=np.float32).reshape(-1, 3)
        if self._reuse("points", wanted):
            self._points.GetData().Modified()
        else:
            self._points.SetData(self._array("points", wanted))
        self._points.Modified()
        self.data.Modified()

    def set_normals(self, normals: np.ndarray) -> None:
        """Unit normals (N, 3)."""
        table = self.data.GetPointData()
        if self._reuse("normals", normals):
            table.GetNormals().Modified()
        else:
            table.SetNormals(self._array("normals", np.ascontiguousarray(normals, dtype=np.float32)))

    def set_colours(self, colours: np.ndarray | None) -> None:
        """Colours (N, 3 or 4) uint8 of the points, taken as they are; None for the actor's own."""
        table = self.data.GetPointData()
        if colours is None:
            table.SetScalars(None)
            self._kept.pop("colours", None)
        elif self._reuse("colours", colours):
            table.GetScalars().Modified()
        else:
            table.SetScalars(self._array("colours", np.ascontiguousarray(colours, dtype=np.uint8)))

    def set_values(self, name: str, values: np.ndarray) -> None:
        """A number (N) for each point, by name."""
        table = self.data.GetPointData()
        if self._reuse(name, values):
            table.GetArray(name).Modified()
        else:
            table.AddArray(self._array(name, np.ascontiguousarray(values, dtype=np.float32)))

    def set_cells(self, cells: np.ndarray, kind: str) -> None:
        """Cells (C, 3) "triangles" or (C, 2) "lines" by point index; nothing happens where they are as before."""
        before = self._kept.get(kind)
        if before is not None and before.shape == cells.shape and (before is cells or np.array_equal(before, cells)):
            return
        self._kept[kind] = cells
        count, size = cells.shape
        table = vtkCellArray()
        starts = np.arange(0, size * count + 1, size, dtype=np.int64)
        table.SetData(
            numpy_to_vtkIdTypeArray(starts, deep=1),
            numpy_to_vtkIdTypeArray(np.ascontiguousarray(cells, dtype=np.int64).ravel(), deep=1),
        )
        (self.data.SetPolys if kind == "triangles" else self.data.SetLines)(table)

    def _reuse(self, name: str, values: np.ndarray) -> bool:
        kept = self._kept.get(name)
        if kept is None or kept.shape != values.shape:
            return False
        np.copyto(kept, values, casting="unsafe")
        return True

    def _array(self, name: str, values: np.ndarray) -> Any:
        own = values.copy()  # VTK draws from it, so nobody else may hold it
        self._kept[name] = own
        array = numpy_to_vtk(own)
        array.SetName(name)
        return array
