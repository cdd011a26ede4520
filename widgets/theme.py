"""Light and dark: one set of colours each, for Qt's own controls and for what is drawn by hand.

A widget that draws by hand asks :func:`colours` as it paints, and is told of a change by Qt's ``PaletteChange`` event.
"""

from __future__ import annotations

from dataclasses import dataclass

from PySide6.QtCore import Qt
from PySide6.QtGui import QColor, QFont, QPalette
from PySide6.QtWidgets import QApplication

NAMES = ("light", "dark", "system")
Rgb = tuple[int, int, int]


@dataclass(frozen=True)
class Colours:
    """What a widget may draw with, sRGB.

    Attributes
    ----------
    name : "light" or "dark"
    window, base, raised : ground of the window, of tables and plots, of cards and buttons
    border, grid : lines between things, lines behind curves
    text, faint : words, and words of less weight (still 4.5:1 on every ground)
    accent, on_accent : what is active, and words upon it
    good, warning, error : always beside a word or a shape
    scene_top, scene_bottom, floor, floor_strong : the ground of the 3D scene and the lines of its floor
    body, bone, outline : the fitted body, its skeleton, and the line about a marker or a word in the scene
    """

    name: str
    window: Rgb
    base: Rgb
    raised: Rgb
    border: Rgb
    grid: Rgb
    text: Rgb
    faint: Rgb
    accent: Rgb
    on_accent: Rgb
    good: Rgb
    warning: Rgb
    error: Rgb
    scene_top: Rgb
    scene_bottom: Rgb
    floor: Rgb
    floor_strong: Rgb
    body: Rgb
    bone: Rgb
    outline: Rgb


LIGHT = Colours(
    name="light",
    window=(243, 244, 246), base=(255, 255, 255), raised=(250, 250, 251),
    border=(200, 204, 210), grid=(226, 229, 233), text=(28, 31, 36), faint=(88, 95, 106),
    accent=(0, 98, 160), on_accent=(255, 255, 255),
    good=(0, 118, 86), warning=(150, 92, 0), error=(186, 52, 0),
    scene_top=(226, 231, 237), scene_bottom=(250, 251, 252), floor=(206, 211, 218), floor_strong=(158, 166, 177),
    body=(205, 190, 178), bone=(60, 66, 76), outline=(255, 255, 255),
)  # fmt: skip
DARK = Colours(
    name="dark",
    window=(32, 34, 38), base=(24, 26, 29), raised=(42, 45, 50),
    border=(66, 70, 78), grid=(50, 53, 59), text=(232, 234, 237), faint=(160, 167, 177),
    accent=(86, 180, 233), on_accent=(12, 20, 28),
    good=(60, 196, 150), warning=(240, 178, 60), error=(255, 132, 80),
    scene_top=(22, 24, 28), scene_bottom=(44, 48, 54), floor=(62, 67, 75), floor_strong=(98, 105, 116),
    body=(186, 170, 158), bone=(214, 219, 226), outline=(16, 18, 21),
)  # fmt: skip

_state: dict[str, Colours | str] = {"colours": LIGHT, "asked": "light"}


def colours() -> Colours:
    """The colours that hold now."""
    found = _state["colours"]
    assert isinstance(found, Colours)
    return found


def apply(app: QApplication, name: str = "system", font_scale: float = 1.0) -> Colours:
    """Give the whole application one look, and return its colours.

    Parameters
    ----------
    name : "light", "dark", or "system" (what the desktop says, followed as it changes)
    font_scale : times the desktop's own font size
    """
    if name not in NAMES:
        raise ValueError(f"no theme is called {name}; there are {', '.join(NAMES)}")
    first = app.property("markerscope_font_size")
    if first is None:
        app.setStyle("Fusion")
        first = app.font().pointSizeF()
        app.setProperty("markerscope_font_size", first)
        app.styleHints().colorSchemeChanged.connect(lambda _scheme: _desktop_changed(app))
    font = QFont(app.font())
    font.setPointSizeF(float(first) * font_scale)
    app.setFont(font)
    _state["asked"] = name
    _paint(app, _dark(app) if name == "system" else name == "dark")
    return colours()


def set_font_scale(app: QApplication, scale: float) -> None:
    """Make words larger or smaller, in the look there is."""
    asked = _state["asked"]
    assert isinstance(asked, str)
    apply(app, asked, scale)


def font_scale(app: QApplication) -> float:
    """How much larger than the desktop's own the font is."""
    first = app.property("markerscope_font_size")
    return 1.0 if first is None else app.font().pointSizeF() / float(first)


def qcolour(rgb: tuple[int, ...], alpha: int = 255) -> QColor:
    """Qt's colour for a triple (or, with its own alpha, four)."""
    red, green, blue, own = (*(int(part) for part in rgb), alpha)[:4]
    return QColor(red, green, blue, own)


def _desktop_changed(app: QApplication) -> None:
    if _state["asked"] == "system":
        _paint(app, _dark(app))


def _dark(app: QApplication) -> bool:
    return app.styleHints().colorScheme() == Qt.ColorScheme.Dark


def _paint(app: QApplication, dark: bool) -> None:
    _state["colours"] = look = DARK if dark else LIGHT
    app.setPalette(_palette(look))
    app.setStyleSheet(_style(look))


def _palette(look: Colours) -> QPalette:
    role = QPalette.ColorRole
    palette = QPalette()
    for which, rgb in {
        role.Window: look.window, role.WindowText: look.text, role.Base: look.base, role.AlternateBase: look.raised,
        role.Text: look.text, role.Button: look.raised, role.ButtonText: look.text, role.BrightText: look.error,
        role.Highlight: look.accent, role.HighlightedText: look.on_accent, role.Accent: look.accent,
        role.Link: look.accent, role.LinkVisited: look.accent, role.ToolTipBase: look.raised,
        role.ToolTipText: look.text, role.PlaceholderText: look.faint, role.Mid: look.border, role.Midlight: look.grid,
        role.Dark: look.border, role.Light: look.raised, role.Shadow: look.border,
    }.items():  # fmt: skip
        palette.setColor(which, qcolour(rgb))
    for which in (role.WindowText, role.Text, role.ButtonText):
        palette.setColor(QPalette.ColorGroup.Disabled, which, qcolour(look.faint, 150))
    palette.setColor(QPalette.ColorGroup.Disabled, role.Highlight, qcolour(look.border))
    return palette


def _style(look: Colours) -> str:
    def css(rgb: Rgb) -> str:
        return f"rgb{rgb}"

    return f"""
        QToolTip {{ color: {css(look.text)}; background: {css(look.raised)}; border: 1px solid {css(look.border)};
                    padding: 4px; }}
        QCheckBox::indicator:unchecked {{ border: 1px solid {css(look.faint)}; border-radius: 2px;
                    background: {css(look.base)}; width: 11px; height: 11px; }}
        QToolButton:focus, QPushButton:focus {{ border: 1px solid {css(look.accent)}; border-radius: 3px; }}
        QToolButton {{ border: 1px solid transparent; border-radius: 3px; padding: 3px; }}
        QToolButton:hover {{ background: {css(look.grid)}; }}
        QToolButton:checked {{ background: {css(look.border)}; }}
    """
