"""Themes and icons: read everywhere, changed at once."""

from __future__ import annotations

import numpy as np
import pytest
from PySide6.QtCore import QEvent
from PySide6.QtGui import QIcon, QImage, QPalette
from PySide6.QtWidgets import QApplication, QWidget

from markerscope.widgets import icons, palette, theme


def pixels(icon: QIcon, size: int = 32) -> np.ndarray:
    """(H, W, 4) RGBA of an icon as it is painted."""
    picture = icon.pixmap(size, size).toImage().convertToFormat(QImage.Format.Format_RGBA8888)
    return np.frombuffer(picture.constBits(), np.uint8).reshape(picture.height(), -1, 4).copy()


@pytest.mark.parametrize("look", [theme.LIGHT, theme.DARK])
def test_words_are_read_on_every_ground(look: theme.Colours) -> None:
    for ground in (look.window, look.base, look.raised):
        for words in (look.text, look.faint, look.good, look.warning, look.error, look.accent):
            assert palette.contrast(words, ground) >= 4.5, (look.name, words, ground)
    assert palette.contrast(look.accent, look.on_accent) >= 4.5


def test_a_change_of_theme_reaches_every_widget(qapp: QApplication) -> None:
    class Listener(QWidget):
        def __init__(self) -> None:
            super().__init__()
            self.heard: list[str] = []

        def changeEvent(self, event: QEvent) -> None:
            if event.type() == QEvent.Type.PaletteChange:
                self.heard.append(theme.colours().name)

    widget = Listener()
    widget.show()
    try:
        assert theme.apply(qapp, "dark") is theme.DARK
        qapp.processEvents()
        assert widget.heard[-1] == "dark"
        assert widget.palette().color(QPalette.ColorRole.Window).getRgb()[:3] == theme.DARK.window
    finally:
        theme.apply(qapp, "light")
    qapp.processEvents()
    assert widget.heard[-1] == "light"
    with pytest.raises(ValueError, match="sepia"):
        theme.apply(qapp, "sepia")


def test_the_font_grows_from_the_desktops_own(qapp: QApplication) -> None:
    first = qapp.font().pointSizeF()
    try:
        for _ in range(2):
            theme.apply(qapp, "light", font_scale=1.5)
        assert qapp.font().pointSizeF() == pytest.approx(1.5 * first)
        assert theme.font_scale(qapp) == pytest.approx(1.5)
    finally:
        theme.apply(qapp, "light")
    assert qapp.font().pointSizeF() == pytest.approx(first)


@pytest.mark.parametrize("name", sorted(icons.GLYPHS))
def test_every_icon_draws_something_that_fits(qapp: QApplication, name: str) -> None:
    alpha = pixels(icons.icon(name))[..., 3]
    assert 0.02 < (alpha > 127).mean() < 0.9
    assert not alpha[[0, -1]].all(axis=1).any(), "cut off"


def test_an_icon_follows_the_theme_and_fades_when_disabled(qapp: QApplication) -> None:
    picture = icons.icon("play")
    try:
        for name in ("light", "dark"):
            look = theme.apply(qapp, name)
            got = pixels(picture)
            inside = got[got[..., 3] == 255][:, :3]
            assert np.all(inside == look.text), name
            red = pixels(icons.icon("error", "error"))
            assert np.all(red[red[..., 3] == 255][:, :3] == look.error)
    finally:
        theme.apply(qapp, "light")
    faded = picture.pixmap(32, 32, QIcon.Mode.Disabled).toImage()
    assert 0 < faded.pixelColor(16, 16).alpha() < 200
    with pytest.raises(KeyError):
        icons.icon("unicorn")
