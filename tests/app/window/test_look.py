"""How the window looks and is reached: titles, sizes of text, light and dark, the search, every control by keyboard."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PySide6.QtCore import QEvent, QMimeData, QPoint, QPointF, Qt, QUrl
from PySide6.QtGui import QDragEnterEvent, QDropEvent, QKeyEvent
from PySide6.QtWidgets import QAbstractButton, QApplication, QLabel, QWidget

from markerscope.app.actions import ACTIONS
from markerscope.app.window.main import MainWindow
from markerscope.solver.pipeline.session import Session
from markerscope.widgets import theme
from markerscope.widgets.images import to_rgb

Spin = Callable[..., None]


@pytest.fixture
def plain(qapp: QApplication) -> Iterator[None]:
    """Whatever is changed, the other tests find the look as it was."""
    yield
    theme.apply(qapp, "light", 1.0)


def solved(open_window: Callable[..., MainWindow], spin: Spin, session: Session) -> MainWindow:
    window = open_window()
    window.open_path(session.folder)
    spin(lambda: window.shown.track is not None and window.shown.get("angles") is not None, "the results")
    return window


def key(widget: QWidget, code: Qt.Key, held: Qt.KeyboardModifier = Qt.KeyboardModifier.NoModifier) -> None:
    for kind in (QEvent.Type.KeyPress, QEvent.Type.KeyRelease):
        QApplication.sendEvent(widget, QKeyEvent(kind, code, held))


def test_each_panel_says_its_title_once(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, plain: None
) -> None:
    window = solved(open_window, spin, session)
    docks = window.docks.docks
    spin(lambda: docks["affinity"].titleBarWidget() is not None, "the titles")
    bare = {name for name, dock in docks.items() if dock.titleBarWidget() is not None}
    assert bare == set(docks) - {"video"}, "who has a tab needs no title"
    docks["markers"].setFloating(True)
    spin(lambda: docks["markers"].titleBarWidget() is None, "the title of a window of its own")
    docks["markers"].setFloating(False)
    spin(lambda: docks["markers"].titleBarWidget() is not None, "the tab")
    docks["history"].close()
    spin(lambda: docks["stages"].titleBarWidget() is None, "the title of what stands alone")
    window.table.trigger("window.layout")
    spin(lambda: docks["stages"].titleBarWidget() is not None, "the first places")
    assert {name for name, dock in docks.items() if dock.isHidden()} == set()

    # Larger words, then the dark: both at once, and kept.
    before = to_rgb(window.grab().toImage()).astype(float)
    height = window.stages.card("fit").height()
    assert window.table.is_on("text.100")
    window.table.trigger("text.150")
    spin()
    assert theme.font_scale(QApplication.instance()) == pytest.approx(1.5)  # type: ignore[arg-type]
    assert window.stages.card("fit").height() > 1.15 * height
    assert window.table.is_on("text.150") and not window.table.is_on("text.100")
    window.table.trigger("theme.dark")
    spin()
    assert theme.font_scale(QApplication.instance()) == pytest.approx(1.5)  # type: ignore[arg-type]
    dark = to_rgb(window.grab().toImage()).astype(float)
    assert before.mean() > 200 > 90 > dark.mean()
    assert {name: window.bench.document.home.preferences()[name] for name in ("theme", "text")} == {
        "theme": "dark",
        "text": 150,
    }
    clipped = [
        (label.text(), label.width())
        for label in window.findChildren(QLabel)
        if label.isVisible() and not label.wordWrap() and label.text() and "<" not in label.text()
        if label.sizePolicy().horizontalPolicy().name != "Ignored"
        if label.fontMetrics().horizontalAdvance(label.text().splitlines()[0]) > label.width() + 1
    ]
    assert not clipped


def test_the_search_and_the_sheet_reach_everything(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session
) -> None:
    window = solved(open_window, spin, session)
    window.table.trigger("help.search")
    palette = window.asks.showing.palette  # type: ignore[attr-defined]
    assert set(palette.shown()) == {action.id for action in ACTIONS} | {f"panel.{name}" for name in window.docks.docks}
    palette.line.setText("panel angles")
    assert palette.shown()[0] == "panel.angles"
    key(palette.line, Qt.Key.Key_Return)
    spin()
    assert not palette.isVisible() and window.angles.isVisible()
    window.bench.selection.clear()
    window.table.trigger("help.search")
    palette.line.setText("merge groups")
    key(palette.line, Qt.Key.Key_Return)
    assert palette.isVisible(), "what cannot be done is not chosen"
    key(palette.line, Qt.Key.Key_Escape)
    assert not palette.isVisible()

    keys = Counter(key for action in ACTIONS for key in action.keys)
    assert [key for key, times in keys.items() if times > 1] == []
    window.table.trigger("help.shortcuts")
    sheet = window.asks.showing.sheet  # type: ignore[attr-defined]
    spin()
    words = {label.text() for label in sheet.findChildren(QLabel)}
    assert {action.title.rstrip(".") for action in ACTIONS if action.keys} <= words
    sheet.close()
    assert window.table.trigger("run.all") is True
    assert not window.table.trigger("groups.merge")
    assert window.messages.messages()[0].level == "info", "that something cannot be done now is no error"


def test_every_control_is_reached_by_tab(open_window: Callable[..., MainWindow], spin: Spin, session: Session) -> None:
    window = solved(open_window, spin, session)
    window.activateWindow()
    window.scene.setFocus()
    spin()
    reached: set[QWidget] = set()
    for _ in range(600):
        focus = QApplication.focusWidget()
        assert focus is not None
        if focus in reached and focus is window.scene and len(reached) > 10:
            break
        reached.add(focus)
        key(focus, Qt.Key.Key_Tab)
    wanted = [
        button
        for part in (window.transport, window.stages, window.candidates, window.convergence, window.angles)
        for button in part.findChildren(QAbstractButton)
        if button.isVisible() and button.isEnabled() and button.focusPolicy() & Qt.FocusPolicy.TabFocus
    ]
    assert len(wanted) > 10
    missed = [button.accessibleName() or button.text() for button in wanted if button not in reached]
    assert not missed
    for view in (window.scene, window.affinity, window.timelines):
        assert view in reached, view.accessibleName()
    mute = [
        type(widget).__name__
        for widget in reached
        if not widget.accessibleName() and not (isinstance(widget, QAbstractButton) and widget.text())
        if widget.metaObject().className() not in ("QTabBar", "QMainWindowTabBar")
    ]
    assert not mute, "a screen reader has nothing to say of these"


def test_recent_sessions_and_files_that_are_dropped(
    open_window: Callable[..., MainWindow], spin: Spin, session: Session, tmp_path: Path
) -> None:
    window = open_window()
    window.bench.document.home.add_recent(tmp_path / "gone.markerscope")
    mime = QMimeData()
    mime.setUrls([QUrl.fromLocalFile(str(session.folder))])
    copy, left, held = Qt.DropAction.CopyAction, Qt.MouseButton.LeftButton, Qt.KeyboardModifier.NoModifier
    enter = QDragEnterEvent(QPoint(50, 50), copy, mime, left, held)
    QApplication.sendEvent(window.welcome, enter)
    assert enter.isAccepted()
    QApplication.sendEvent(window.welcome, QDropEvent(QPointF(50, 50), copy, mime, left, held))
    spin(lambda: window.bench.clock.timing.frames > 0, "the session")
    assert window.bench.document.folder == session.folder and window.pages.currentIndex() == 1
    window.table.trigger("session.close")
    spin()
    assert window.pages.currentWidget() is window.welcome
    buttons = {button.text().split("   ")[0]: button for button in window.welcome.recent_buttons()}
    assert list(buttons) == ["mine", "gone"]
    assert buttons["mine"].isEnabled() and not buttons["gone"].isEnabled() and "not found" in buttons["gone"].text()
    title = to_rgb(window.welcome._title.grab().toImage()).astype(int)
    ink = (np.abs(title - theme.colours().window).max(axis=-1) > 100).any(axis=1).sum()
    assert ink > 1.2 * window.fontMetrics().ascent(), "the name is written large"
    buttons["mine"].click()
    spin(lambda: window.bench.clock.timing.frames > 0, "the session again")
