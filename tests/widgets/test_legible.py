"""Every example of the gallery's plots, tables, panels and dialogs: named for screen readers, and not clipped."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from PySide6.QtCore import Qt
from PySide6.QtWidgets import (
    QAbstractButton,
    QApplication,
    QComboBox,
    QLabel,
    QLineEdit,
    QPushButton,
    QSlider,
    QSpinBox,
    QToolButton,
    QWidget,
)

from markerscope.widgets import theme
from markerscope.widgets.gallery import dialogs as gallery_dialogs
from markerscope.widgets.gallery import panels as gallery_panels
from markerscope.widgets.gallery import plots as gallery_plots
from markerscope.widgets.gallery import tables as gallery_tables
from tests.widgets.drawn import distance, pixels

EXAMPLES = gallery_plots.EXAMPLES | gallery_tables.EXAMPLES | gallery_panels.EXAMPLES | gallery_dialogs.EXAMPLES


@pytest.fixture(params=[1.0, 1.5], ids=["100 %", "150 %"])
def scaled(qapp: QApplication, request: pytest.FixtureRequest) -> Iterator[QApplication]:
    theme.apply(qapp, "light", request.param)
    yield qapp
    theme.apply(qapp, "light", 1.0)


def shown(name: str, app: QApplication) -> QWidget:
    made = EXAMPLES[name]()
    made.resize(made.size().expandedTo(made.minimumSizeHint()))
    made.show()
    app.processEvents()
    return made


@pytest.mark.parametrize("name", EXAMPLES)
def test_no_text_is_clipped(scaled: QApplication, name: str) -> None:
    made = shown(name, scaled)
    clipped = []
    for part in made.findChildren(QWidget):
        if not part.isVisibleTo(made) or not isinstance(part, QLabel | QAbstractButton):
            continue
        text = part.text()
        if not text or (isinstance(part, QLabel) and part.sizePolicy().horizontalPolicy().name == "Ignored"):
            continue
        words = text.split() if isinstance(part, QLabel) and part.wordWrap() else text.splitlines()
        wide = max(part.fontMetrics().horizontalAdvance(line.replace("&", "")) for line in words)
        if isinstance(part, QLabel) and part.wordWrap():
            tall = part.heightForWidth(part.width())
        else:
            tall = part.fontMetrics().height() * len(text.splitlines())
        if part.width() < wide or part.height() < tall - 1:
            clipped.append((text, (part.width(), wide), (part.height(), tall)))
    made.close()
    assert not clipped


@pytest.mark.parametrize("name", EXAMPLES)
def test_what_takes_the_focus_has_a_name(qapp: QApplication, name: str) -> None:
    made = shown(name, qapp)
    controls = (QPushButton, QToolButton, QComboBox, QLineEdit, QSlider, QSpinBox)
    nameless = [
        type(part).__name__
        for part in made.findChildren(QWidget)
        if isinstance(part, controls)
        and part.isVisibleTo(made)
        and part.focusPolicy() != Qt.FocusPolicy.NoFocus
        and not part.objectName().startswith("qt_")
        and not part.accessibleName()
        and not (isinstance(part, QAbstractButton) and part.text())
    ]
    made.close()
    assert not nameless


@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_follows_another_theme(qapp: QApplication, name: str) -> None:
    theme.apply(qapp, "light")
    made = shown(name, qapp)
    light = pixels(made)
    theme.apply(qapp, "dark")
    qapp.processEvents()
    dark = pixels(made)
    made.close()
    theme.apply(qapp, "light")
    assert light.mean() - dark.mean() > 60
    assert distance(dark, theme.DARK.text).min() <= 30, "words in the dark theme's colour"
    assert (distance(dark, theme.LIGHT.window) <= 2).mean() < 0.02, "no ground of the light theme is left"
