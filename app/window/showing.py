"""What the window shows of its own: views of the scene, panels, the search, the shortcut sheet, themes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from PySide6.QtWidgets import QApplication, QMessageBox

from markerscope.app.models.workbench import Said
from markerscope.app.window.exporting import write_playback, write_turntable
from markerscope.solver import __version__
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import cannot_write
from markerscope.widgets import theme
from markerscope.widgets.dialogs.command_palette import CommandPalette, PaletteEntry
from markerscope.widgets.dialogs.shortcut_sheet import ShortcutSheet

if TYPE_CHECKING:
    from markerscope.app.window.main import MainWindow


class Showing:
    """Carries out ``Asks.show``."""

    def __init__(self, window: MainWindow) -> None:
        self.window = window
        self.palette: CommandPalette | None = None
        self.sheet: ShortcutSheet | None = None

    def show(self, what: str) -> None:
        """Show one thing by its name."""
        kind, _, name = what.partition(".")
        if kind == "camera":
            self.window.draw_now()  # the camera frames what is drawn
        if what == "camera.selected":
            self.window.scene.frame_selected()
        elif kind == "camera":
            self.window.scene.view_from(name)
        elif kind == "theme":
            self._theme(name)
        elif kind == "text":
            self._text(int(name))
        elif kind == "panel":
            self.window.raise_dock(name)
        elif kind == "export":
            self._export(name)
        elif what == "window.layout":
            self.window.layout_anew()
        elif what == "window.history":
            self.window.raise_dock("history")
        elif what == "help.search":
            self._search()
        elif what == "help.shortcuts":
            self._shortcuts()
        elif what == "help.about":
            self._about()

    def _theme(self, name: str) -> None:
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        theme.apply(app, name, theme.font_scale(app))
        self.window.bench.document.home.prefer(theme=name)
        self.window.redraw()

    def _text(self, percent: int) -> None:
        app = QApplication.instance()
        assert isinstance(app, QApplication)
        theme.set_font_scale(app, percent / 100)
        self.window.bench.document.home.prefer(text=percent)
        self.window.redraw()

    def _export(self, name: str) -> None:
        files = {"picture": "scene.png", "turntable": "turntable.mp4", "playback": "playback.mp4"}
        path = self.window.asks.file_to_save(files[name])
        if path is not None:
            self.write(name, path)

    def write(self, name: str, path: Path) -> None:
        """Write a picture or a film of the scene."""
        self.window.draw_now()
        if name == "picture":
            try:
                self.window.scene.save_png(path, 2.0)
            except OSError as error:
                if error.errno is not None:
                    raise cannot_write(path, error) from None
                remedy = "choose a folder you may write to, and a name that ends in .png"
                raise InputError("cannot be written", path, remedy) from None
        elif name == "turntable":
            write_turntable(self.window, path)
        else:
            write_playback(self.window, path)
        self.window.bench.say(Said("note", f"{path.name} written", str(path.parent)))

    def _search(self) -> None:
        if self.palette is None:
            self.palette = CommandPalette(self.window)
            self.palette.chosen.connect(self._chosen)
        panels = [
            PaletteEntry(f"panel.{name}", f"Panel: {dock.windowTitle()}", help=f"{dock.toolTip()}.")
            for name, dock in self.window.docks.docks.items()
            if self.window.bench.document.is_open
        ]
        self.palette.open_with([*self.window.menus.entries(), *panels])

    def _chosen(self, name: str) -> None:
        if name.startswith("panel."):
            self.show(name)
        else:
            self.window.table.trigger(name)

    def _shortcuts(self) -> None:
        if self.sheet is not None:
            self.sheet.close()
            self.sheet.deleteLater()
        groups = self.window.menus.sheet()
        groups["In the scene"] = [
            ("Drag, wheel", "Orbit, zoom"), ("Right drag", "Pan"), ("Shift+drag", "Select by a box"),
            ("Click, Ctrl+click", "Select a marker, or one more"), ("Right click, Menu", "Edit its groups"),
            ("Ctrl+arrows", "Orbit"),
            ("Ctrl+Shift+arrows", "Pan"), ("+ and -", "Zoom"), ("0", "Show everything"),
        ]  # fmt: skip
        groups["In the timelines"] = [
            ("Wheel", "Zoom about the pointer"), ("Shift+wheel", "Pan"), ("Shift+drag", "Mark a range"),
            ("Ctrl+Left, Ctrl+Right", "Shift the video by 10 ms"),
        ]  # fmt: skip
        self.sheet = ShortcutSheet(groups, self.window)
        self.sheet.show()

    def _about(self) -> None:
        QMessageBox.about(
            self.window,
            "About Markerscope",
            f"<b>Markerscope {__version__}</b><p>From unlabelled optical markers and one video to a fitted body and "
            "joint angles.<p>Apache-2.0. The embedded body and networks and their licences are listed in NOTICE.",
        )
