"""The questions that the actions put to the user, as dialogs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PySide6.QtWidgets import QFileDialog, QInputDialog, QMessageBox

from markerscope.app.window.exporting import ask_what_to_export, report_pictures
from markerscope.app.window.importing import ask_how_to_import
from markerscope.app.window.showing import Showing
from markerscope.app.window.videos import dialog_filter

if TYPE_CHECKING:
    from markerscope.app.window.main import MainWindow

_FILES = {
    "markers": ("Open markers", "Markers (*.c3d *.trc *.csv *.tsv *.txt *.C3D *.TRC *.CSV *.TSV *.TXT);;All files (*)"),
    "video": ("Add video", dialog_filter()),
    "prior": ("Add pose prior", "Poses (*.npz *.pkl *.pth *.pt *.npy *.json);;All files (*)"),
    "camera": ("Add camera", "Camera (camera.json *.json);;All files (*)"),
    "neutral": ("Static trial for the neutral pose", "Markers (*.c3d *.trc *.csv *.tsv);;All files (*)"),
    "body": ("Use another body", "SMPL-layout models (*.npz *.pkl);;All files (*)"),
}


class WindowAsks:
    """The window's side of ``markerscope.app.actions.Asks``."""

    def __init__(self, window: MainWindow) -> None:
        self.window = window
        self.showing = Showing(window)

    def file_to_open(self, what: str) -> Path | None:
        """Which file, or which session's folder."""
        if what == "session":
            chosen = QFileDialog.getExistingDirectory(self.window, "Open session", self._folder("session"))
        else:
            title, kinds = _FILES[what]
            chosen, _ = QFileDialog.getOpenFileName(self.window, title, self._folder(what), kinds)
        return self._remembered(what, chosen)

    def folder_to_save(self, name: str) -> Path | None:
        """Which folder a session is to be saved in."""
        proposed = str(Path(self._folder("session")) / f"{name}.markerscope")
        chosen, _ = QFileDialog.getSaveFileName(self.window, "Save session as", proposed, "Sessions (*.markerscope)")
        if not chosen:
            return None
        path = Path(chosen)
        self._remembered("session", str(path))
        return path if path.suffix == ".markerscope" else path.with_name(f"{path.name}.markerscope")

    def file_to_save(self, name: str) -> Path | None:
        """Which file to write."""
        dialog = QFileDialog(self.window, f"Write {name}", self._folder("export"))
        dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
        dialog.setDefaultSuffix(Path(name).suffix[1:])  # before it asks whether a file may be replaced
        dialog.selectFile(name)
        chosen = dialog.selectedFiles() if dialog.exec() == QFileDialog.DialogCode.Accepted else []
        dialog.deleteLater()
        return self._remembered("export", chosen[0] if chosen else "")

    def how_to_import(self, path: Path) -> Mapping[str, Any] | None:
        """How to read a marker file."""
        return ask_how_to_import(self.window, path, lambda: self.file_to_open("video"), self.window.dropped_video)

    def what_to_export(self) -> tuple[Path, Sequence[str]] | None:
        """Which folder, and which formats."""
        return ask_what_to_export(self.window, Path(self._folder("export")))

    def save_first(self) -> bool | None:
        """Whether to save before closing."""
        box = QMessageBox(self.window)
        box.setIcon(QMessageBox.Icon.Question)
        name = self.window.bench.document.name
        box.setText(f"Save what was decided in {name}?")
        box.setInformativeText("What is not saved is given up; results that were computed belong to the session.")
        save = box.addButton("Save", QMessageBox.ButtonRole.AcceptRole)
        drop = box.addButton("Do not save", QMessageBox.ButtonRole.DestructiveRole)
        box.addButton(QMessageBox.StandardButton.Cancel)
        box.setDefaultButton(save)
        box.exec()
        clicked = box.clickedButton()
        return True if clicked is save else False if clicked is drop else None

    def stop_running(self) -> bool:
        """Whether to stop what runs."""
        box = QMessageBox(self.window)
        box.setIcon(QMessageBox.Icon.Question)
        box.setText("Stages are running. Stop them?")
        box.setInformativeText(
            "What was finished stays. The stage at work begins anew the next time; watching the video goes on."
        )
        stop = box.addButton("Stop and close", QMessageBox.ButtonRole.DestructiveRole)
        box.setDefaultButton(box.addButton("Go on running", QMessageBox.ButtonRole.RejectRole))
        box.exec()
        return box.clickedButton() is stop

    def number(self, question: str, value: float, unit: str) -> float | None:
        """A number."""
        found, given = QInputDialog.getDouble(self.window, question, f"{question} ({unit})", value, -1e6, 1e6, 4)
        return found if given else None

    def choice(self, question: str, options: Sequence[str]) -> int | None:
        """Which of several."""
        text, given = QInputDialog.getItem(self.window, question, question, list(options), 0, False)
        return list(options).index(text) if given else None

    def pictures(self) -> Sequence[Any]:
        """Views of the session, for the report."""
        return report_pictures(self.window)

    def show(self, what: str) -> None:
        """Show something of the window's own."""
        self.showing.show(what)

    def quit(self) -> None:
        """Close the window; whoever asks has had all questions answered."""
        self.window.leave()

    def _folder(self, what: str) -> str:
        known = self.window.bench.document.home.preferences().get("folders")
        folder = known.get(what) if isinstance(known, dict) else None
        return folder if isinstance(folder, str) and Path(folder).is_dir() else str(Path.home())

    def _remembered(self, what: str, chosen: str) -> Path | None:
        if not chosen:
            return None
        home = self.window.bench.document.home
        known = home.preferences().get("folders")
        folders = known if isinstance(known, dict) else {}
        home.prefer(folders={**folders, what: str(Path(chosen).parent)})
        return Path(chosen)
