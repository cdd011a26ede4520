"""The import dialog: a marker file as it would be read, until the user agrees."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, cast

from PySide6.QtWidgets import QDialog, QWidget

from markerscope.app.models.imports import new_session
from markerscope.app.views.preview import preview_of
from markerscope.app.window.videos import videos_beside
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import UpAxis
from markerscope.widgets.dialogs.import_data import ImportChoice
from markerscope.widgets.dialogs.import_dialog import ImportDialog


class Importing:
    """Answers every change of the dialog with the file as it then would be read."""

    def __init__(self, dialog: ImportDialog, path: Path) -> None:
        from markerscope.solver.io.markers_in import read_raw

        self.dialog, self.path = dialog, path
        self.raw = read_raw(path)
        self.up: UpAxis | None = None
        self.units: str | None = None
        self.subject: str | None = None
        self.rate: float | None = None
        self.preview = preview_of(self.raw, path)
        dialog.set_shown(self.preview)
        dialog.changed.connect(self._changed)

    def _changed(self, choice: ImportChoice) -> None:
        now = self.preview
        self.up = cast(UpAxis, choice.up) if choice.up != now.up or self.up is not None else None
        self.units = choice.units if choice.units != now.units or self.units is not None else None
        self.subject = choice.subject if choice.subject and choice.subject != now.subject else self.subject
        said = choice.rate != now.rate or not now.rate_known or self.rate is not None
        self.rate = choice.rate if choice.rate > 0 and said else None
        try:
            self.preview = preview_of(
                self.raw,
                self.path,
                up=self.up,
                units=cast(Any, self.units),
                subject=self.subject,
                rate=self.rate,
            )
        except InputError as error:
            from dataclasses import replace

            self.preview = replace(self.preview, problem=str(error))
        self.dialog.set_shown(self.preview)

    def session(self) -> Mapping[str, Any]:
        """Arguments of ``Document.new``."""
        choice = self.dialog.choice()
        labels = self.preview.markers.labels
        unwanted = [column for column, label in enumerate(labels) if label in set(choice.left_out)]
        return new_session(
            self.path,
            video=Path(choice.video) if choice.video else None,
            up=self.up,
            units=cast(Any, self.units),
            subject=self.subject or (self.preview.subject or None if len(self.preview.subjects) > 1 else None),
            rate=self.rate,
            left_out=unwanted,
        )


def ask_how_to_import(
    parent: QWidget, path: Path, video: Callable[[], Path | None], proposed: Path | None = None
) -> Mapping[str, Any] | None:
    """Ask; None where the user would rather not."""
    dialog = ImportDialog(parent)
    dialog.setWindowTitle(f"Open {path.name}")
    importing = Importing(dialog, path)

    def choose_video() -> None:
        chosen = video()
        if chosen is not None:
            dialog.set_video(str(chosen))

    dialog.video_wanted.connect(choose_video)
    beside = videos_beside(path)
    if proposed is not None or beside:
        dialog.set_video(str(proposed or beside[0]))
    agreed = dialog.exec() == QDialog.DialogCode.Accepted
    found = importing.session() if agreed else None
    dialog.deleteLater()
    return found
