"""What to write, where, and which files that makes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSize, Signal
from PySide6.QtWidgets import (
    QCheckBox,
    QDialog,
    QDialogButtonBox,
    QFrame,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPushButton,
    QScrollArea,
    QVBoxLayout,
    QWidget,
)

from markerscope.widgets.icons import icon
from markerscope.widgets.theme import colours


@dataclass(frozen=True)
class ExportFormat:
    """One thing that can be written.

    Attributes
    ----------
    id : given back
    title : in words
    files : their names
    help : what is in them, with units
    chosen : ticked at the start
    why_not : why it cannot be written now, "" if it can
    """

    id: str
    title: str
    files: tuple[str, ...]
    help: str = ""
    chosen: bool = False
    why_not: str = ""


class ExportDialog(QDialog):
    """A box for each format, a folder, and the files that will be there.

    Signals
    -------
    folder_wanted() : the user looks for a folder; answer with :meth:`set_folder`
    changed(ids, folder) : so that whoever writes can say which files are there already, by :meth:`set_existing`
    export_wanted(ids, folder)
    """

    folder_wanted = Signal()
    changed = Signal(list, str)
    export_wanted = Signal(list, str)

    def __init__(self, formats: Sequence[ExportFormat], folder: str = "", parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.setWindowTitle("Export")
        self.setAccessibleName("Export")
        self._formats = {entry.id: entry for entry in formats}
        self.boxes: dict[str, QCheckBox] = {}
        self._existing: frozenset[str] = frozenset()
        inner = QWidget()
        column = QVBoxLayout(inner)
        column.setContentsMargins(8, 8, 8, 8)
        look = colours()
        for entry in formats:
            box, text = QCheckBox(entry.title), QLabel(entry.why_not or entry.help)
            box.setChecked(entry.chosen and not entry.why_not)
            box.setEnabled(not entry.why_not)
            box.setToolTip(", ".join(entry.files))
            box.toggled.connect(self._tell)
            text.setWordWrap(True)
            text.setIndent(24)
            text.setStyleSheet(f"color: rgb{look.warning if entry.why_not else look.faint}")
            column.addWidget(box)
            column.addWidget(text)
            self.boxes[entry.id] = box
        column.addStretch(1)
        scroll = QScrollArea()
        scroll.setWidgetResizable(True)
        scroll.setFrameShape(QFrame.Shape.StyledPanel)
        scroll.setWidget(inner)
        self.folder = QLineEdit(folder)
        self.folder.setAccessibleName("Folder")
        self.folder.textChanged.connect(self._tell)
        label = QLabel("Folder")
        label.setBuddy(self.folder)
        self.browse_button = QPushButton(icon("open"), "Browse...")
        self.browse_button.clicked.connect(self.folder_wanted)
        where = QHBoxLayout()
        where.addWidget(label)
        where.addWidget(self.folder, 1)
        where.addWidget(self.browse_button)
        self._files = QLabel()
        self._files.setWordWrap(True)
        self.buttons = QDialogButtonBox()
        self.export_button = self.buttons.addButton("Export", QDialogButtonBox.ButtonRole.AcceptRole)
        self.buttons.addButton(QDialogButtonBox.StandardButton.Cancel)
        self.buttons.accepted.connect(self._export)
        self.buttons.rejected.connect(self.reject)
        layout = QVBoxLayout(self)
        layout.addWidget(scroll, 1)
        layout.addLayout(where)
        layout.addWidget(self._files)
        layout.addWidget(self.buttons)
        self._inner, self._column = inner, column
        self._say()

    def chosen(self) -> list[str]:
        """Ids that are ticked."""
        return [name for name, box in self.boxes.items() if box.isChecked()]

    def set_folder(self, folder: str) -> None:
        """Show which folder was chosen."""
        self.folder.setText(folder)

    def set_existing(self, files: Sequence[str]) -> None:
        """Say which of the files are there already and would be replaced."""
        self._existing = frozenset(files)
        self._say()

    def sizeHint(self) -> QSize:
        """All formats where the screen allows."""
        line = self.fontMetrics().height()
        tall = self._column.totalHeightForWidth(36 * line)
        return QSize(40 * line, min(tall + 10 * line, 56 * line))

    def _say(self) -> None:
        files = list(dict.fromkeys(name for entry in self.chosen() for name in self._formats[entry].files))
        replaced = [name for name in files if name in self._existing]
        text = f"Will write {', '.join(files)}." if files else "Choose what to write."
        if replaced:
            text += f" There already, and replaced: {', '.join(replaced)}."
        self._files.setText(text)
        self.export_button.setEnabled(bool(files) and bool(self.folder.text().strip()))
        self.export_button.setToolTip("" if self.folder.text().strip() else "Choose a folder")

    def _tell(self, *_: object) -> None:
        self._say()
        self.changed.emit(self.chosen(), self.folder.text().strip())

    def _export(self) -> None:
        self.export_wanted.emit(self.chosen(), self.folder.text().strip())
        self.accept()
