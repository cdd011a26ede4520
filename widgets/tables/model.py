"""Columns as Qt's model, sorted and filtered."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QObject, QPersistentModelIndex, QSortFilterProxyModel, Qt
from PySide6.QtGui import QFont

from markerscope.widgets.icons import icon
from markerscope.widgets.plots.ink import colour
from markerscope.widgets.tables.columns import Column, absent, natural

Index = QModelIndex | QPersistentModelIndex
BAR = int(Qt.ItemDataRole.UserRole) + 1
SWATCH = BAR + 1
_Role = Qt.ItemDataRole


class ArrayModel(QAbstractTableModel):
    """Rows of columns; new rows are appended to those that are there, so that what is selected stays."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self.columns: tuple[Column, ...] = ()
        self.pinned = -1
        self._rows = 0

    def set_columns(self, columns: Sequence[Column]) -> None:
        """Show these, all of one length."""
        rows = len(columns[0].values) if columns else 0
        if any(len(column.values) != rows for column in columns):
            raise ValueError("the columns of a table must be of one length")
        if [c.heading for c in columns] != [c.heading for c in self.columns] or rows < self._rows:
            self.beginResetModel()
            self.columns, self._rows = tuple(columns), rows
            self.endResetModel()
            return
        before = self._rows
        self.columns = tuple(columns)
        if rows > before:
            self.beginInsertRows(QModelIndex(), before, rows - 1)
            self._rows = rows
            self.endInsertRows()
        if before:
            self.dataChanged.emit(self.index(0, 0), self.index(before - 1, len(columns) - 1))

    def set_pinned(self, row: int) -> None:
        """Mark a row, -1 for none."""
        before, self.pinned = self.pinned, row
        for changed in {before, row}:
            if 0 <= changed < self._rows:
                self.dataChanged.emit(self.index(changed, 0), self.index(changed, len(self.columns) - 1))

    def rowCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008
        """Rows that are there."""
        return 0 if parent.isValid() else self._rows

    def columnCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008
        """Columns."""
        return 0 if parent.isValid() else len(self.columns)

    def headerData(self, section: int, orientation: Qt.Orientation, role: int = _Role.DisplayRole) -> Any:
        """Title, unit and meaning."""
        if orientation != Qt.Orientation.Horizontal or section >= len(self.columns):
            return None
        column = self.columns[section]
        if role == _Role.DisplayRole:
            return column.heading
        if role == _Role.ToolTipRole:
            unit = f", in {column.unit}" if column.unit else ""
            return f"{column.tooltip or column.title}{unit}"
        return None

    def data(self, index: Index, role: int = _Role.DisplayRole) -> Any:
        """Text, place, bar, swatch and mark of a cell."""
        column, row = self.columns[index.column()], index.row()
        if role == _Role.DisplayRole:
            return column.text(row)
        if role == _Role.ToolTipRole:
            text = column.text(row)
            if row < len(column.tips) and column.tips[row]:
                return column.tips[row]
            return (
                f"{text} {column.unit}".rstrip() if column.tooltip == "" else f"{text} {column.unit}: {column.tooltip}"
            )
        if role == _Role.TextAlignmentRole:
            side = Qt.AlignmentFlag.AlignRight if column.is_number(row) else Qt.AlignmentFlag.AlignLeft
            return int(side | Qt.AlignmentFlag.AlignVCenter)
        if role == BAR:
            return column.filled(row)
        if role == SWATCH:
            return None if column.colours is None else colour(column.colours[row])
        if role == _Role.DecorationRole and row == self.pinned and index.column() == 0:
            return icon("pin", "accent")
        if role == _Role.FontRole and row == self.pinned:
            font = QFont()
            font.setBold(True)
            return font
        return None


class SortFilter(QSortFilterProxyModel):
    """Numbers as numbers, names as people count, what is absent always last."""

    def __init__(self, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._text = ""
        self._kept: frozenset[int] | None = None

    def set_text(self, text: str) -> None:
        """Keep rows that hold all of the words somewhere."""
        self.beginFilterChange()
        self._text = text.casefold()
        self.endFilterChange(QSortFilterProxyModel.Direction.Rows)

    def set_kept(self, rows: frozenset[int] | None) -> None:
        """Keep only these rows, None for all."""
        self.beginFilterChange()
        self._kept = rows
        self.endFilterChange(QSortFilterProxyModel.Direction.Rows)

    def filterAcceptsRow(self, row: int, parent: Index) -> bool:
        """Whether a row is kept, and holds the words."""
        if self._kept is not None and row not in self._kept:
            return False
        if not self._text:
            return True
        source = self.sourceModel()
        assert isinstance(source, ArrayModel)
        held = "\n".join(column.text(row) for column in source.columns).casefold()
        return all(word in held for word in self._text.split())

    def lessThan(self, left: Index, right: Index) -> bool:
        """By value."""
        source = self.sourceModel()
        assert isinstance(source, ArrayModel)
        a, b = (source.columns[left.column()].values[index.row()] for index in (left, right))
        if absent(a) or absent(b):
            first = absent(b) and not absent(a)
            return first if self.sortOrder() == Qt.SortOrder.AscendingOrder else not first and absent(a) != absent(b)
        if isinstance(a, str) or isinstance(b, str):
            return natural(str(a)) < natural(str(b))
        return bool(a < b)
