"""Every widget alone, on made-up data.

    python -m markerscope.widgets.gallery.__main__                    list the examples
    python -m markerscope.widgets.gallery.__main__ NAME [NAME ...]    show them (with --theme light, dark or system)
    python -m markerscope.widgets.gallery.__main__ --shots DIR [NAME ...] [--scale 1.5] [--font-scale 1.5]
                                                 write pictures, light and dark, without a display

An example is a function without arguments that returns a widget, listed in ``EXAMPLES`` of a ``widgets/gallery/*.py``.
"""

from __future__ import annotations

import argparse
import importlib
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PySide6.QtWidgets import QApplication, QWidget

SETTLE_MS, LONGEST_MS = 200, 5000
"""How long a widget gets for what it defers to the event loop before its picture is taken, and how much longer at most
where it, or a widget in it, has an attribute ``settled`` that is False."""


def examples() -> dict[str, Callable[[], QWidget]]:
    """All examples by name, in the order of the modules' names."""
    found: dict[str, Callable[[], QWidget]] = {}
    for path in sorted(Path(__file__).parent.glob("[a-z]*.py")):
        module = importlib.import_module(f"markerscope.widgets.gallery.{path.stem}")
        twice = found.keys() & module.EXAMPLES.keys()
        if twice:
            raise ValueError(f"{path.name} names an example again: {', '.join(sorted(twice))}")
        found |= module.EXAMPLES
    return found


def take_shots(app: QApplication, names: Iterable[str], folder: Path, themes: Iterable[str]) -> Iterator[Path]:
    """Write a picture of each example in each theme, and yield the files."""
    from PySide6.QtCore import QCoreApplication, QEvent

    from markerscope.widgets import theme

    folder.mkdir(parents=True, exist_ok=True)
    known, font_scale = examples(), theme.font_scale(app)
    for name in names:
        for look in themes:
            theme.apply(app, look, font_scale)
            widget = known[name]()
            widget.show()
            _settle(app, widget)
            picture = widget.grab()
            path = folder / f"{name}_{look}_{picture.devicePixelRatio():g}x.png"
            if not picture.save(str(path)):
                raise OSError(f"{path} cannot be written")
            widget.close()
            widget.deleteLater()
            # Gone before the next one comes, which a nested event loop would not do.
            QCoreApplication.sendPostedEvents(None, QEvent.Type.DeferredDelete)
            yield path


def main(arguments: list[str] | None = None) -> int:
    """Show examples, or write their pictures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME")
    parser.add_argument("--shots", type=Path, metavar="DIR")
    parser.add_argument("--theme", choices=("light", "dark", "system"))
    parser.add_argument("--scale", type=float, default=None, help="pixels of the screen to one of the window's")
    parser.add_argument("--font-scale", type=float, default=1.0)
    options = parser.parse_args(arguments)
    known = examples()
    unknown = [name for name in options.names if name not in known]
    if unknown or not (options.names or options.shots):
        if unknown:
            print(f"there is no example called {', '.join(unknown)}; there are:", file=sys.stderr)
        print("\n".join(known), file=sys.stderr if unknown else sys.stdout)
        return 2 if unknown else 0
    if options.scale:
        os.environ["QT_SCALE_FACTOR"] = f"{options.scale:g}"
    if options.shots:
        os.environ["QT_QPA_PLATFORM"] = "offscreen"
    from PySide6.QtWidgets import QApplication

    from markerscope.widgets import theme

    app = QApplication([])
    theme.apply(app, options.theme or "system", options.font_scale)
    names = options.names or list(known)
    if options.shots:
        for path in take_shots(app, names, options.shots, [options.theme] if options.theme else ("light", "dark")):
            print(path)
        return 0
    shown = [known[name]() for name in names]
    for name, widget in zip(names, shown):
        widget.setWindowTitle(name)
        widget.show()
    return app.exec()


def _settle(app: QApplication, widget: QWidget) -> None:
    from PySide6.QtCore import QEventLoop, QTimer
    from PySide6.QtWidgets import QWidget

    for _ in range(LONGEST_MS // SETTLE_MS):
        loop = QEventLoop()
        QTimer.singleShot(SETTLE_MS, loop.quit)
        loop.exec()
        app.processEvents()
        if all(getattr(part, "settled", True) for part in [widget, *widget.findChildren(QWidget)]):
            return


if __name__ == "__main__":
    raise SystemExit(main())
