"""A table to sort, filter, select in and copy from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from PySide6.QtCore import QEvent, QItemSelection, QItemSelectionModel, QRect, QSize, Qt, QTimer, Signal
from PySide6.QtGui import QContextMenuEvent, QGuiApplication, QKeyEvent, QKeySequence, QPainter
from PySide6.QtWidgets import (
    QAbstractItemView,
    QHBoxLayout,
    QHeaderView,
    QLabel,
    QLineEdit,
    QMenu,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTableView,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.allow import allow
from markerscope.widgets.icons import icon
from markerscope.widgets.tables.columns import Column
from markerscope.widgets.tables.model import BAR, SWATCH, ArrayModel, Index, SortFilter
from markerscope.widgets.theme import colours, qcolour


class BarDelegate(QStyledItemDelegate):
    """Cells with a bar below the number or a swatch before the name."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: Index) -> None:
        """Draw the bar, then the cell as always."""
        part, swatch = index.data(BAR), index.data(SWATCH)
        super().paint(painter, option, index)
        rect: QRect = option.rect
        if part is not None:
            chosen = option.state & QStyle.StateFlag.State_Selected
            ink = colours().on_accent if chosen else colours().accent
            wide = round(part * (rect.width() - 8))
            painter.fillRect(QRect(rect.left() + 4, rect.bottom() - 3, rect.width() - 8, 2), qcolour(ink, 50))
            painter.fillRect(QRect(rect.left() + 4, rect.bottom() - 3, wide, 2), qcolour(ink))
        if swatch is not None:
            painter.fillRect(QRect(rect.left() + 1, rect.top() + 3, 6, rect.height() - 6), swatch)

    def initStyleOption(self, option: QStyleOptionViewItem, index: Index) -> None:
        """Make room for the swatch, and between a number and the word after it."""
        super().initStyleOption(option, index)
        text = option.text
        option.text = f"  {text}" if index.data(SWATCH) is not None else f" {text} "


class _View(QTableView):
    def __init__(self, table: ArrayTable) -> None:
        super().__init__(table)
        self._table = table

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Copy, pin and activate by keys."""
        if event.matches(QKeySequence.StandardKey.Copy):
            QGuiApplication.clipboard().setText(self._table.as_text(selected=True))
        elif event.key() in (Qt.Key.Key_Return, Qt.Key.Key_Enter) and self._table.current_row() >= 0:
            self._table.row_activated.emit(self._table.current_row())
        elif event.key() == Qt.Key.Key_P and self._table.can_pin and self._table.current_row() >= 0:
            self._table.pin_requested.emit(self._table.current_row())
        elif event.key() in (Qt.Key.Key_Space, Qt.Key.Key_Left, Qt.Key.Key_Right, Qt.Key.Key_Home, Qt.Key.Key_End):
            event.ignore()  # the clock's
        else:
            super().keyPressEvent(event)

    def contextMenuEvent(self, event: QContextMenuEvent) -> None:
        """Offer what can be done with the rows."""
        menu = self._table.menu()
        menu.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
        menu.popup(event.globalPos())


class ArrayTable(QWidget):
    """Columns below a line to filter by. Rows are named by their number in the columns, however they are sorted.

    Ctrl+C copies the selected rows with their header as tab-separated text, Enter activates a row, P pins it.

    Signals
    -------
    row_selected(row) : the current row changed, -1 for none
    rows_selected(rows) : the selection changed
    row_activated(row) : double click or Enter
    pin_requested(row)
    """

    row_selected = Signal(int)
    rows_selected = Signal(list)
    row_activated = Signal(int)
    pin_requested = Signal(int)

    def __init__(self, name: str, can_pin: bool = False, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setAccessibleName(name)
        self.can_pin = can_pin
        self._unpinnable: Mapping[int, str] = {}
        self.model = ArrayModel(self)
        self._sorted = SortFilter(self)
        self._sorted.setSourceModel(self.model)
        self.view = _View(self)
        self.view.setAccessibleName(name)
        self.view.setModel(self._sorted)
        self.view.setSortingEnabled(True)
        self._sorted.sort(-1)
        self.view.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.view.setSelectionMode(QAbstractItemView.SelectionMode.ExtendedSelection)
        self.view.setHorizontalScrollMode(QAbstractItemView.ScrollMode.ScrollPerPixel)
        self.view.setItemDelegate(BarDelegate(self.view))
        self.view.setAlternatingRowColors(True)
        self.view.setShowGrid(False)
        self.view.setWordWrap(False)
        self.view.setTabKeyNavigation(False)
        self.view.verticalHeader().hide()
        self.view.horizontalHeader().setHighlightSections(False)
        self.view.horizontalHeader().setSortIndicator(-1, Qt.SortOrder.AscendingOrder)
        self.view.horizontalHeader().setSortIndicatorClearable(True)
        self.view.horizontalHeader().setSectionsMovable(True)
        self.view.doubleClicked.connect(lambda index: self.row_activated.emit(self._row(index)))
        self.view.selectionModel().selectionChanged.connect(self._selected)
        self.filter = QLineEdit()
        self.filter.setPlaceholderText("Filter")
        self.filter.setAccessibleName(f"{name}: filter")
        self.filter.setClearButtonEnabled(True)
        self.filter.addAction(icon("search", "faint"), QLineEdit.ActionPosition.LeadingPosition)
        self.filter.textChanged.connect(self._filter)
        self._count = QLabel()
        self.top = QHBoxLayout()
        self.top.addWidget(self.filter, 1)
        self.top.addWidget(self._count)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(self.top)
        layout.addWidget(self.view, 1)
        self._quiet = False
        self._told: list[int] = []
        self._fitted, self._line = False, 0
        self._refit = QTimer(self, singleShot=True, interval=0)  # once the view has the font, too
        self._refit.timeout.connect(self._fit_font)
        for signal in (self._sorted.rowsInserted, self._sorted.rowsRemoved, self._sorted.modelReset):
            signal.connect(lambda *_: self._say_count())

    def set_columns(self, columns: Sequence[Column], pinned: int | None = None) -> None:
        """Show these; rows that come in addition leave the selection and the order as they are."""
        again = [c.heading for c in columns] == [c.heading for c in self.model.columns]
        chosen, current = self.selected_rows(), self.current_row()
        self.model.set_columns(columns)
        if not again or not self._fitted:
            self._fitted = bool(columns) and bool(len(columns[0].values))
            self._fit()
        if again and chosen != self.selected_rows():
            self.set_selected(row for row in [current, *chosen] if 0 <= row < self.model.rowCount())
        if pinned is not None:
            self.set_pinned(pinned)
        self._say_count()

    def set_unpinnable(self, reasons: Mapping[int, str]) -> None:
        """Say of rows why they cannot be pinned, or let go of, now."""
        self._unpinnable = dict(reasons)

    def set_pinned(self, row: int) -> None:
        """Mark the row that is held, -1 for none."""
        self.model.set_pinned(row)

    def set_kept(self, rows: frozenset[int] | None) -> None:
        """Show only these rows, None for all."""
        self._sorted.set_kept(rows)
        self._say_count()

    def set_selected(self, rows: Iterable[int]) -> None:
        """Select rows, the first of them current, and bring it into sight; nothing is emitted."""
        self._quiet = True
        wanted = list(dict.fromkeys(rows))
        chosen = QItemSelection()
        indices = [self._sorted.mapFromSource(self.model.index(row, 0)) for row in wanted]
        for index in indices:
            if index.isValid():
                chosen.select(index, index)
        flags = QItemSelectionModel.SelectionFlag
        self.view.selectionModel().select(chosen, flags.ClearAndSelect | flags.Rows)
        if indices and indices[0].isValid():
            self.view.selectionModel().setCurrentIndex(indices[0], flags.NoUpdate)
            self.view.scrollTo(indices[0])
        self._quiet = False

    def selected_rows(self) -> list[int]:
        """Rows that are selected, in the order shown."""
        shown = sorted(self.view.selectionModel().selectedRows(), key=lambda index: index.row())
        return [self._row(index) for index in shown]

    def current_row(self) -> int:
        """The row that keys act on, -1 for none."""
        index = self.view.selectionModel().currentIndex()
        return self._row(index) if index.isValid() else -1

    def shown_rows(self) -> list[int]:
        """All rows that pass the filter, top down."""
        return [self._row(self._sorted.index(k, 0)) for k in range(self._sorted.rowCount())]

    def as_text(self, selected: bool = False) -> str:
        """The header and the rows, tab-separated, as they are sorted and filtered."""
        rows = self.selected_rows() if selected else self.shown_rows()
        head = [f"{c.title} ({c.unit})" if c.unit else c.title for c in self.model.columns]
        lines = [[column.text(row) for column in self.model.columns] for row in rows]
        return "\n".join("\t".join(line) for line in [head, *lines])

    def menu(self) -> QMenu:
        """What can be done with the rows."""
        menu = QMenu(self)
        if self.can_pin and (row := self.current_row()) >= 0:
            text = "Unpin" if row == self.model.pinned else "Pin, and go on from it"
            pin = menu.addAction(icon("pin"), text, lambda: self.pin_requested.emit(row))
            pin.setShortcut(QKeySequence(Qt.Key.Key_P))
            menu.setToolTipsVisible(True)
            allow(pin, self._unpinnable.get(row, ""), text)
        board = QGuiApplication.clipboard()
        copy = menu.addAction(icon("copy"), "Copy", lambda: board.setText(self.as_text(selected=True)))
        copy.setEnabled(bool(self.selected_rows()))
        menu.addAction(icon("table"), "Copy the whole table", lambda: board.setText(self.as_text()))
        return menu

    def sizeHint(self) -> QSize:
        """A dozen rows."""
        line = self.fontMetrics().height()
        return QSize(self.view.horizontalHeader().length() + 30, 20 * line)

    def minimumSizeHint(self) -> QSize:
        """Header and three rows."""
        return QSize(180, 9 * self.fontMetrics().height())

    def changeEvent(self, event: QEvent) -> None:
        """Follow another font."""
        super().changeEvent(event)
        if event.type() in (QEvent.Type.FontChange, QEvent.Type.StyleChange) and hasattr(self, "_refit"):
            self._refit.start()

    def _fit_font(self) -> None:
        """Fit rows and columns where the font is another one; columns that were dragged stay otherwise."""
        if self._fitted and self.fontMetrics().height() != self._line:
            self._fit()

    def _row(self, index: Index) -> int:
        return self._sorted.mapToSource(index).row()

    def _fit(self) -> None:
        self._line = line = self.fontMetrics().height()
        self.view.verticalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Fixed)
        self.view.verticalHeader().setDefaultSectionSize(round(1.45 * line))
        header = self.view.horizontalHeader()
        self.view.resizeColumnsToContents()
        for k in range(header.count()):
            header.resizeSection(k, min(max(header.sectionSize(k) + 2, 3 * line), 18 * line))
        header.setStretchLastSection(False)

    def _filter(self, text: str) -> None:
        self._sorted.set_text(text)
        self._say_count()

    def _say_count(self) -> None:
        shown, rows = self._sorted.rowCount(), self.model.rowCount()
        self._count.setText(f"{shown} of {rows}" if shown != rows else f"{rows}")

    def _selected(self, *_: object) -> None:
        chosen = self.selected_rows()
        if not self._quiet and chosen != self._told:
            current = self.current_row()
            self.rows_selected.emit(chosen)
            self.row_selected.emit(current if current in chosen else (chosen[0] if chosen else -1))
        self._told = chosen
