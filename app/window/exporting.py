"""Exports that need the window: the dialog, pictures of the views, and films of the scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PySide6.QtCore import QBuffer, QIODevice, Qt
from PySide6.QtGui import QImage
from PySide6.QtWidgets import QApplication, QDialog, QFileDialog, QProgressDialog, QWidget

from markerscope.app.models import exports
from markerscope.solver.core.errors import Cancelled
from markerscope.widgets.dialogs.export_dialog import ExportDialog, ExportFormat
from markerscope.widgets.images import to_rgb

if TYPE_CHECKING:
    from markerscope.app.window.main import MainWindow

_USUAL = {"angles", "mot", "c3d", "report"}
_RATE = 25.0
_TURN_S = 8.0


def ask_what_to_export(window: MainWindow, folder: Path) -> tuple[Path, Sequence[str]] | None:
    """Ask; None where the user would rather not."""
    formats = [
        ExportFormat(known.name, known.title, known.files, known.help, known.name in _USUAL)
        for known in exports.formats()
    ]
    start = window.bench.document.folder if not window.bench.document.untitled else folder
    dialog = ExportDialog(formats, str(start), window)
    files = {known.name: known.files for known in exports.formats()}

    def there(ids: list[str], where: str) -> None:
        dialog.set_existing([file for name in ids for file in files[name] if (Path(where) / file).exists()])

    def choose() -> None:
        chosen = QFileDialog.getExistingDirectory(dialog, "Export into", str(folder))
        if chosen:
            dialog.set_folder(chosen)

    answer: list[tuple[Path, list[str]]] = []

    def take(ids: list[str], where: str) -> None:
        answer.append((Path(where), ids))
        dialog.accept()

    dialog.changed.connect(there)
    dialog.folder_wanted.connect(choose)
    dialog.export_wanted.connect(take)
    there(dialog.chosen(), str(start))
    done = dialog.exec() == QDialog.DialogCode.Accepted
    dialog.deleteLater()
    return answer[-1] if done and answer else None


def png_of(image: QImage) -> bytes:
    """A picture as the bytes of a PNG file."""
    buffer = QBuffer()
    buffer.open(QIODevice.OpenModeFlag.WriteOnly)
    image.save(buffer, "PNG")  # type: ignore[call-overload]
    return bytes(buffer.data().data())


def report_pictures(window: MainWindow) -> list[Any]:
    """Views of the session as it is shown now."""
    from markerscope.solver.report.report_data import Picture

    window.draw_now()
    found = [Picture("The fitted body and the markers", png_of(window.scene.image(1.0, (900, 700))))]
    if window.bench.frames is not None:
        found.append(Picture("Markers and body projected into the video", png_of(window.video.image())))
    views: list[tuple[str, QWidget]] = [
        ("The session along its clock: presence of every marker, residual, video", window.dated["timelines"]),
        ("Which markers move rigidly together", window.dated["affinity"]),
    ]
    found += [Picture(words, png_of(view.grab().toImage())) for words, view in views if view.width() > 100]
    return found


def write_turntable(window: MainWindow, path: Path) -> None:
    """The scene turned once round, as MP4."""
    count = round(_TURN_S * _RATE)
    _write_film(window, path, "Turntable", window.scene.turntable(count, _even(window.scene)), count)


def write_playback(window: MainWindow, path: Path) -> None:
    """The scene as it plays, at the chosen speed, the range or the whole, as MP4."""
    clock = window.bench.clock
    clock.stop()
    start, stop = clock.loop or clock.span
    count = max(1, round((stop - start) / clock.speed * _RATE))
    before = clock.time
    size = _even(window.scene)  # asked once: a message that comes or goes changes the height of the scene

    def pictures() -> Iterator[np.ndarray]:
        for k in range(count):
            with clock.moved.block():  # the scene alone, not every curve and table
                clock.seek(start + k * clock.speed / _RATE)
            window.scene_binder.draw()
            yield to_rgb(window.scene.image(1.0, size))

    try:
        _write_film(window, path, "Playback", pictures(), count)
    finally:
        with clock.moved.block():
            clock.seek(before)
        clock.moved.emit(clock.time)


def _even(widget: QWidget) -> tuple[int, int]:
    """Its size in pixels that a video can have."""
    return max(320, widget.width() // 2 * 2), max(240, widget.height() // 2 * 2)


def _write_film(window: MainWindow, path: Path, what: str, frames: Iterator[np.ndarray], count: int) -> None:
    """Write the frames, with progress and a way to stop; nothing is left of a film that was stopped."""
    progress = QProgressDialog(f"{what}: {count} frames into {path.name}", "Stop", 0, count, window)
    progress.setWindowTitle(what)
    progress.setWindowModality(Qt.WindowModality.WindowModal)
    progress.setMinimumDuration(300)
    progress.setAutoReset(False)

    def watched() -> Iterator[np.ndarray]:
        for k, frame in enumerate(frames):
            progress.setValue(k)
            QApplication.processEvents()
            if progress.wasCanceled():
                raise Cancelled
            yield frame

    try:
        exports.write_video(path, watched(), _RATE)
    finally:
        close = getattr(frames, "close", None)
        if close is not None:
            close()  # at once: what turned the camera puts it back
        progress.close()
        progress.deleteLater()
