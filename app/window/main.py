"""The main window: widgets, models and actions put together."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from PySide6.QtCore import QEvent, Qt, QTimer
from PySide6.QtGui import QCloseEvent, QDragEnterEvent, QDropEvent
from PySide6.QtWidgets import QMainWindow, QStackedWidget, QVBoxLayout, QWidget

from markerscope.app.actions import ACTIONS, Actions, Asks
from markerscope.app.actions.edit_actions import GIVE_INPUT, GivenFile
from markerscope.app.actions.session_actions import OPEN, may_close
from markerscope.app.models.workbench import Said, Workbench
from markerscope.app.window.actions import Menus
from markerscope.app.window.asks import WindowAsks
from markerscope.app.window.bind_affinity import AffinityBinder
from markerscope.app.window.bind_angles import AnglesBinder
from markerscope.app.window.bind_candidates import CandidatesBinder
from markerscope.app.window.bind_convergence import ConvergenceBinder
from markerscope.app.window.bind_dated import DatedBinder
from markerscope.app.window.bind_glance import GlanceBinder
from markerscope.app.window.bind_history import HistoryBinder
from markerscope.app.window.bind_hypotheses import HypothesesBinder
from markerscope.app.window.bind_marker_curves import MarkerCurvesBinder
from markerscope.app.window.bind_markers import MarkersBinder
from markerscope.app.window.bind_messages import MessagesBinder
from markerscope.app.window.bind_scene import SceneBinder
from markerscope.app.window.bind_scene_bar import SceneBarBinder, make_bar
from markerscope.app.window.bind_stages import StagesBinder
from markerscope.app.window.bind_timelines import TimelinesBinder
from markerscope.app.window.bind_transport import TransportBinder
from markerscope.app.window.bind_video import VideoBinder
from markerscope.app.window.bind_welcome import WelcomeBinder
from markerscope.app.window.collecting import Collecting
from markerscope.app.window.concerned import Concerned
from markerscope.app.window.docks import Docks, Panel
from markerscope.app.window.ghosts import Ghosts
from markerscope.app.window.group_menu import SceneMenu
from markerscope.app.window.keys import wants
from markerscope.app.window.remembering import parts_of, restore
from markerscope.app.window.shown import Shown
from markerscope.app.window.videos import is_video
from markerscope.widgets.panels.dated import Dated
from markerscope.widgets.panels.glance_bar import GlanceBar
from markerscope.widgets.panels.history import HistoryList
from markerscope.widgets.panels.hypotheses import HypothesesView
from markerscope.widgets.panels.message_bar import MessageBar
from markerscope.widgets.panels.progress_strip import ProgressStrip
from markerscope.widgets.panels.stage_panel import StagePanel
from markerscope.widgets.panels.track_editor import TrackEditor
from markerscope.widgets.panels.transport import Transport
from markerscope.widgets.panels.welcome import WelcomePage
from markerscope.widgets.plots.affinity import AffinityView
from markerscope.widgets.plots.convergence import ConvergenceView
from markerscope.widgets.plots.curves import CurvesView
from markerscope.widgets.plots.marker_curves import MarkerCurvesView
from markerscope.widgets.plots.pair import PairPlot
from markerscope.widgets.plots.timelines import Timelines
from markerscope.widgets.scene import Scene3D
from markerscope.widgets.tables.candidates import CandidateTable
from markerscope.widgets.tables.markers import MarkerTable
from markerscope.widgets.video import VideoView

BUSY_MS, IDLE_MS, REMEMBER_MS = 12, 60, 1500
_LEFT = Qt.DockWidgetArea.LeftDockWidgetArea
_RIGHT = Qt.DockWidgetArea.RightDockWidgetArea
_BOTTOM = Qt.DockWidgetArea.BottomDockWidgetArea


class MainWindow(QMainWindow):
    """One window on one session.

    Parameters
    ----------
    bench : the models
    make_asks : what asks the user in its place (tests)
    """

    def __init__(self, bench: Workbench, make_asks: Callable[[MainWindow], Asks] | None = None) -> None:
        super().__init__()
        self.bench = bench
        self._leaving = False
        self.dropped_video: Path | None = None
        self.resize(1500, 940)
        self.setAcceptDrops(True)
        self.asks: Asks = WindowAsks(self) if make_asks is None else make_asks(self)
        self.table = Actions(ACTIONS, bench, self.asks)
        self._make_widgets()
        self.menus = Menus(self, self.table)
        self.shown = Shown(bench)
        self.ghosts = Ghosts(bench, self.shown)
        self._bind()
        self._view_menu()
        bench.opened.connect(self._opened)
        bench.document.saved.connect(self._title)
        bench.document.changed.connect(lambda another: self._title())
        bench.clock.changed.connect(self._pace)
        bench.runner.changed.connect(self._pace)
        self._timer = QTimer(self, interval=IDLE_MS)
        self._timer.timeout.connect(self._tick)
        self._timer.start()
        self._remembering = QTimer(self, interval=REMEMBER_MS)
        self._remembering.timeout.connect(self.remember)
        self._remembering.start()
        self._remembered: object = None
        self._collecting = Collecting(self, lambda: bench.busy)
        self._opened()
        self._collecting.start()

    def _make_widgets(self) -> None:
        self.scene, self.video, self.timelines = Scene3D(), VideoView(), Timelines()
        self.scene_bar = make_bar(self.table)
        self.stages, self.transport, self.messages = StagePanel(), Transport(), MessageBar()
        self.glance = GlanceBar()
        self.affinity, self.pair = AffinityView(), PairPlot()
        self.candidates, self.hypotheses = CandidateTable(), HypothesesView()
        self.convergence, self.markers, self.angles = ConvergenceView(), MarkerTable(), CurvesView()
        self.track_editor = TrackEditor()
        self.curves = MarkerCurvesView(self.track_editor)
        self.history, self.welcome, self.progress = HistoryList(), WelcomePage(), ProgressStrip()
        self.pair.setVisible(False)
        self.pages = QStackedWidget()
        self.pages.addWidget(self.welcome)
        self.pages.addWidget(_column(self.scene_bar, self.scene, self.transport))
        self.setCentralWidget(_column(self.messages, self.pages))
        self.statusBar().addPermanentWidget(self.progress, 1)
        self.statusBar().setSizeGripEnabled(False)
        self.dated = {
            "video": Dated(self.video),
            "affinity": Dated(_column(self.affinity, self.pair)),
            "candidates": Dated(self.candidates),
            "hypotheses": Dated(self.hypotheses),
            "convergence": Dated(self.convergence),
            "markers": Dated(self.markers),
            "timelines": Dated(self.timelines),
            "curves": Dated(self.curves),
            "angles": Dated(self.angles),
        }
        dated = self.dated
        self.docks = Docks(
            self,
            [
                Panel(
                    "stages",
                    "Stages",
                    _column(self.glance, self.stages),
                    _LEFT,
                    "Every stage: its state, settings and results",
                ),
                Panel("history", "History", self.history, _LEFT, "Every decision, to go back to"),
                Panel("video", "Video", dated["video"], _RIGHT, "The frame of the clock's time"),
                Panel("affinity", "Affinity", dated["affinity"], _RIGHT, "Who moves rigidly with whom"),
                Panel("candidates", "Candidates", dated["candidates"], _RIGHT, "Where on the body the markers may sit"),
                Panel("hypotheses", "Hypotheses", dated["hypotheses"], _RIGHT, "The answers side by side"),
                Panel("convergence", "Convergence", dated["convergence"], _RIGHT, "How the energies fell"),
                Panel("markers", "Markers", dated["markers"], _RIGHT, "Every marker with its gaps and residuals"),
                Panel("timelines", "Timelines", dated["timelines"], _BOTTOM, "All streams along the clock"),
                Panel("curves", "Marker curves", dated["curves"], _BOTTOM, "x, y and z over time, and edits of them"),
                Panel("angles", "Angles", dated["angles"], _BOTTOM, "Joint angles, left and right"),
            ],
        )

    def _bind(self) -> None:
        bench, shown, ghosts = self.bench, self.shown, self.ghosts
        self.scene_binder = scene = SceneBinder(self.scene, bench, shown, ghosts)
        self.video_binder = VideoBinder(self.video, bench, shown)
        self.curves_binder = MarkerCurvesBinder(
            self.curves, self.track_editor, self.timelines, bench, shown, self.table
        )
        self.scene_menu = SceneMenu(self.scene, bench, shown, self.table)
        self.concerned = Concerned(self, bench, shown, self.raise_dock)
        self.binders = [
            scene,
            SceneBarBinder(self.scene_bar, self.scene, bench, self.table),
            self.video_binder,
            TimelinesBinder(self.timelines, bench, shown, ghosts, self.table),
            StagesBinder(self.stages, self.progress, bench, self.concerned, self.table),
            GlanceBinder(self.glance, bench, shown, self.concerned, self.table),
            TransportBinder(self.transport, bench, self.table),
            MessagesBinder(self.messages, bench),
            AffinityBinder(self.affinity, self.pair, bench, shown, scene, self.table),
            CandidatesBinder(self.candidates, bench, shown, ghosts, self.table),
            HypothesesBinder(self.hypotheses, bench, shown, ghosts, self.scene, self.table),
            ConvergenceBinder(self.convergence, bench, shown, ghosts),
            MarkersBinder(self.markers, bench, shown),
            self.curves_binder,
            AnglesBinder(self.angles, bench, shown, self.table),
            HistoryBinder(self.history, bench, self.table),
            DatedBinder(self.dated, shown),
            WelcomeBinder(self.welcome, bench, self.table, self.open_path, self.drop),
        ]

    def _view_menu(self) -> None:
        panels = self.menus.menus["View"].addMenu("Panels")
        panels.setToolTipsVisible(True)
        for dock in self.docks.docks.values():
            panels.addAction(dock.toggleViewAction())

    # What the actions need

    def open_path(self, path: Path) -> None:
        """Open a session, or begin one from a marker file; what cannot be opened is said."""
        self.table.do(OPEN, path)

    def raise_dock(self, name: str) -> None:
        """Bring a panel to the front."""
        self.docks.bring(name)

    def layout_anew(self) -> None:
        """Put every panel back in its first place."""
        self.docks.arrange()

    def draw_now(self) -> None:
        """Have scene and video show all that has changed: a picture of them is about to be taken."""
        self.scene_binder.drawing.now()
        self.video_binder.drawing.now()

    def redraw(self) -> None:
        """Draw everything again, in other colours."""
        self.scene_binder.draw()
        for child in self.findChildren(QWidget):
            child.update()

    def leave(self) -> None:
        """Close without asking again."""
        self._leaving = True
        self.close()

    def remember(self) -> None:
        """Write down how the window looks, if it looks otherwise than before."""
        if self.bench.document.is_open and self.bench.clock.timing.frames:
            parts = parts_of(self)
            known = (parts, self.bench.clock.time, self.bench.selection.state(), self.bench.display.state())
            if known != self._remembered:
                self._remembered = known
                self.bench.remember(**parts)

    # Following the models

    def _opened(self) -> None:
        is_open = self.bench.document.is_open
        self.pages.setCurrentIndex(1 if is_open else 0)
        if is_open != self._docks_shown():
            self.docks.show(is_open)
            if is_open:
                self.docks.arrange()
        if is_open:
            restore(self, self.bench.document.view)
            self.scene.setFocus()
        self._title()

    def _docks_shown(self) -> bool:
        return any(dock.isVisible() or not dock.isHidden() for dock in self.docks.docks.values())

    def _title(self) -> None:
        document = self.bench.document
        if not document.is_open:
            self.setWindowTitle("Markerscope")
        else:
            unsaved = " (not saved)" if document.dirty else ""
            self.setWindowTitle(f"{document.name}{unsaved} - Markerscope")

    def _pace(self) -> None:
        self._timer.setInterval(BUSY_MS if self.bench.busy else IDLE_MS)

    def _tick(self) -> None:
        self.bench.tick()
        wanted = BUSY_MS if self.bench.busy else IDLE_MS
        if self._timer.interval() != wanted:
            self._timer.setInterval(wanted)

    # Qt's events

    def event(self, event: QEvent) -> bool:
        """Leave keys to the control that has the focus, where it has a use for them."""
        if wants(event):
            event.accept()
            return True
        return super().event(event)

    def closeEvent(self, event: QCloseEvent) -> None:
        """Ask first, if there is something to ask."""
        if not self._leaving and not may_close(self.bench, self.asks):
            event.ignore()
            return
        self.remember()
        self._timer.stop()
        self._remembering.stop()
        self._collecting.stop()
        self.bench.close()
        event.accept()

    def dragEnterEvent(self, event: QDragEnterEvent) -> None:
        """Take files."""
        if event.mimeData().hasUrls():
            event.acceptProposedAction()

    def dropEvent(self, event: QDropEvent) -> None:
        """Open the first file that was dropped; a video goes to the open session."""
        paths = [Path(url.toLocalFile()) for url in event.mimeData().urls() if url.isLocalFile()]
        if paths:
            event.acceptProposedAction()
            QTimer.singleShot(0, self, lambda: self.drop(paths))

    def drop(self, paths: list[Path]) -> None:
        """Take files that were dropped: a session or a marker file, perhaps with its video; or a video alone."""
        videos = [path for path in paths if is_video(path)]
        others = [path for path in paths if path not in videos]
        if others:
            self.dropped_video = videos[0] if videos else None
            self.open_path(others[0])
            self.dropped_video = None
        elif videos and self.bench.document.is_open:
            self.table.do(GIVE_INPUT, GivenFile("video_file", videos[0]))
        elif videos:
            self.bench.say(Said("note", "A session begins with markers", videos[0].name, "open a marker file first"))


def _column(*widgets: QWidget) -> QWidget:
    made = QWidget()
    layout = QVBoxLayout(made)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(0)
    for widget in widgets:
        layout.addWidget(widget, 1 if isinstance(widget, Scene3D | QStackedWidget | AffinityView | StagePanel) else 0)
    return made
