"""All models of one window, joined: what one of them does, the others follow."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np

from markerscope.app.models.clock import Clock, Timing
from markerscope.app.models.display import Display
from markerscope.app.models.document import Document
from markerscope.app.models.edits import Edit
from markerscope.app.models.fields import title
from markerscope.app.models.frames import VideoFrames
from markerscope.app.models.gap_previews import GapPreviews
from markerscope.app.models.home import Home
from markerscope.app.models.jobs import Runner
from markerscope.app.models.pending_fills import PendingFills
from markerscope.app.models.reading import Reading
from markerscope.app.models.results import Ref, Unread
from markerscope.app.models.selection import Selection
from markerscope.app.models.signal import Signal
from markerscope.app.models.stages import Failure, StageBoard
from markerscope.app.models.view_state import restore_view, view_of
from markerscope.app.models.walk import Walk
from markerscope.app.models.working import WorkingTracks
from markerscope.solver.core.errors import Cancelled, InputError, MarkerscopeError
from markerscope.solver.pipeline.names import CLEAN, MARKERS, SYNC
from markerscope.solver.pipeline.store import Absent

Level = Literal["note", "warning", "error"]
_LOOK_AGAIN_S = 2.0
_DRAWN = ("markers", "segment", "fit")
"""Stages whose results the clock and the selection stand on."""


@dataclass(frozen=True)
class Said:
    """Something to tell the user: what happened, where, and what to do about it."""

    level: Level
    what: str
    where: str = ""
    remedy: str = ""

    @property
    def sentence(self) -> str:
        """All of it."""
        place = f"{self.where}: " if self.where else ""
        return f"{place}{self.what}{f'; {self.remedy}' if self.remedy else ''}."


class Workbench:
    """The models of a window.

    Parameters
    ----------
    home : the user's folders
    now : s, of a clock of the computer's that never goes back

    Attributes
    ----------
    document, board, runner, clock, selection, display : see their classes
    working : the trajectories as the decisions of now have them
    walk : from gap to gap, outlier to outlier
    previews : the gap in question, filled by every way there is
    pending : what views wait for of fills that were decided
    frames : of the session's video, None without one
    said : emitted with what the user has to be told
    video_changed : emitted when there is another video, or more of it
    opened : emitted when a session was opened or closed, after all else has followed
    """

    def __init__(self, home: Home, now: Callable[[], float] = time.monotonic) -> None:
        self.now = now
        self.document = Document(home)
        self.document.changed.connect(self._forget)  # before anything else follows
        self.board = StageBoard(self.document)
        self.runner = Runner(self.board, now)
        self.clock = Clock()
        self.selection = Selection()
        self.working = WorkingTracks(self.board)
        self.walk = Walk(self.selection, self.clock)
        self.previews = GapPreviews()
        self.pending: list[PendingFills] = []
        self.display = Display()
        self.frames: VideoFrames | None = None
        self.said: Signal[[Said]] = Signal()
        self.video_changed: Signal[[]] = Signal()
        self.opened: Signal[[]] = Signal()
        self._reading: Reading | None = None
        self._shown: dict[str, str] = {}
        self._to_restore: Mapping[str, Any] | None = None
        self._clusters: np.ndarray | None = None
        self._bones: np.ndarray | None = None
        self._looked = 0.0
        self._of: tuple[object, ...] | None = None
        self.document.changed.connect(self._document_changed)
        self.board.changed.connect(self._follow)
        self.selection.changed.connect(self._chosen)
        self.runner.failed.connect(self._failed)

    @property
    def busy(self) -> bool:
        """Whether something runs that ``tick`` has to watch: it is to be called often then."""
        waits = self._reading is not None or self._waits_for_video
        waits = waits or self.previews.busy or any(fills.busy for fills in self.pending)
        return self.runner.running or self.clock.playing or waits

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the markers: of the cleaning in force, which may have cut trajectories in two, else of the file."""
        current = self.board.current
        return current[CLEAN].markers.labels if "clean" in current else current[MARKERS].labels

    @property
    def reading(self) -> bool:
        """Whether the marker file is being read, so that there is nothing to show yet."""
        return self._reading is not None

    def tick(self) -> None:
        """Let everything move on that has its own time: playing, running stages, results and frames that arrive."""
        if not self.runner.poll():  # else there is enough to draw for this time
            self.board.results.poll()
        if self.frames is not None:
            self.frames.poll()
        self.previews.poll()
        for fills in self.pending:
            fills.poll()
        if self._reading is not None and self._reading.done:
            self._read()
        now = self.now()
        if self.document.is_open and "markers" not in self._shown and now - self._looked >= _LOOK_AGAIN_S:
            self._looked = now
            self._follow()  # a result that could not be loaded when it was asked for
        self.clock.tick(now)

    def attempt(self, act: Callable[[], object]) -> bool:
        """Do something that the user asked for; what cannot be done is said. Returns whether it was done."""
        try:
            act()
        except Cancelled:
            return False
        except MarkerscopeError as error:
            self.say_error(error)
            return False
        return True

    def apply(self, edit: Edit) -> bool:
        """Carry a decision out, or say why it cannot be."""
        return self.attempt(lambda: self.document.apply(edit))

    def open(self, path: Path, although_open: bool = False) -> bool:
        """Open a session, or say why it cannot be."""
        done = self.attempt(lambda: self.document.open(path, although_open))
        if done and self.document.recovered:
            self.say(Said("note", "What had not been saved is back", self.document.name, "save the session to keep it"))
        return done

    def say(self, said: Said) -> None:
        """Tell the user something."""
        self.said.emit(said)

    def say_error(self, error: Exception) -> None:
        """Tell the user why something could not be done."""
        if isinstance(error, InputError):
            self.say(Said("error", error.what, error.where or "", error.remedy))
        else:
            self.say(Said("error", str(error).rstrip(".")))

    def remember(self, **parts: Any) -> None:
        """Write down how the window looks, so that it opens as it was: the parts given, and what the models know."""
        if self.document.is_open and self._to_restore is None:
            self.document.set_view(**view_of(self), **parts)

    def close(self, keep_untitled: bool = False) -> None:
        """Close the session; what runs is stopped, what was not saved is given up."""
        self.runner.cancel()
        self.remember()
        self.document.close(keep_untitled)

    def _forget(self, another: bool) -> None:
        """Let go of what belongs to the session before."""
        if not another:
            return
        self.runner.cancel()
        self.clock.stop()
        self.working.forget()
        self.previews.ask(None, None, None)
        for fills in self.pending:
            fills.ask(None, frozenset())
        self._shown, self._reading, self._clusters, self._bones = {}, None, None, None
        self._to_restore = dict(self.document.view) if self.document.is_open else None
        if not self.document.is_open:
            self.clock.set_timing(Timing())
            self.selection.clear()
        self.selection.set_groups(None, None)

    def _document_changed(self, another: bool) -> None:
        self._follow_video()
        if another:
            self.opened.emit()

    def _chosen(self, names: frozenset[str]) -> None:
        """Note what a candidate or hypothesis that was selected is one of: a row of another result is another."""
        if names & {"candidate", "hypothesis", "iteration"}:
            self._of = self._search()

    def _search(self) -> tuple[object, ...]:
        """Which method, and which of its results the rows of candidates and hypotheses are of."""
        if not self.document.is_open:
            return ()
        latest = [self.board.latest(stage) for stage in ("localize", "solve", "orient")]
        method = self.document.session.run.method
        return (method, *(None if known is None else known[0] for known in latest))

    def _leave_others(self) -> None:
        """Let go of a row whose result is another now, as after a change of method."""
        held = self._of is not None and self._of != self._search()
        own = self.selection
        if held and (own.candidate, own.hypothesis, own.iteration) != (None, None, None):
            before, now = self._of, self._search()
            assert before is not None
            others = [a for a, b in zip(before, now) if a is not None and a != b]
            if others:
                own.select(candidate=None, hypothesis=None, iteration=None)
        self._of = self._search()

    def _follow(self) -> None:
        """Have clock and selection stand on the results there are; those not in memory come later."""
        if not self.document.is_open:
            return
        self._leave_others()
        self.board.results.loaded.connect(self._loaded)
        self.board.results.failed.connect(self._unread)
        if "markers" in self.board.keys and not self.runner.running:
            self._begin_reading()
        self._follow_sync()
        for stage in _DRAWN:
            latest = self.board.latest(stage)
            before = self._shown.get(stage)
            if before is not None and (latest is None or not self.board.was_in_force(stage, before)):
                self._unshow(stage)
            if latest is None or self._shown.get(stage) == latest[0]:
                continue
            if stage == "segment" or self.board.results.is_loaded(stage, latest[0]):
                with suppress(Absent):
                    self._show(stage, latest[0])
                    continue
            self.board.results.load_ahead(stage, latest[0])

    def _follow_sync(self) -> None:
        """Lay the video as the user said, at once; else as it was found last."""
        settings = self.board.settings.get("sync")
        latest = self.board.latest("sync")
        if settings is not None and settings.offset is not None:
            self.clock.set_sync(settings.offset, settings.rate_ratio or 1.0)
        elif latest is None:
            self.clock.set_sync(0.0)
        else:
            try:
                found = self.board.results.get(SYNC, latest[0])
            except Absent:
                self.board.results.load_ahead("sync", latest[0])  # tries again, and tells if that is in vain
                return
            self.clock.set_sync(found.offset, found.rate_ratio)

    def _loaded(self, ref: Ref) -> None:
        latest = self.board.latest(ref.stage) if ref.stage in _DRAWN else None
        if latest is not None and latest[0] == ref.key and self._shown.get(ref.stage) != ref.key:
            self._show(ref.stage, ref.key)

    def _unread(self, found: Unread) -> None:
        """Say that a result cannot be had; it is no more in force if it was damaged."""
        remedy = "run the stage again" if found.gone else "see that the disk is at hand; it is tried again by itself"
        self.say(Said("error", f"A result cannot be shown, for {found.why}", title(found.ref.stage), remedy))
        if found.gone:
            self.board.changed.emit()

    def _show(self, stage: str, key: str) -> None:
        value = self.board.results.get(stage, key)
        self._shown[stage] = key
        if stage == "markers":
            frames = len(value.positions)
            self.clock.set_timing(replace(self.clock.timing, first=value.first_time, rate=value.rate, frames=frames))
            self._restore()
        elif stage == "segment":
            self._clusters = value.clusters
        else:
            self._bones = value.marker_joint
        self.selection.set_groups(self._clusters, self._bones)

    def _unshow(self, stage: str) -> None:
        """Let go of a result that is no answer any more to anything that was asked."""
        self._shown.pop(stage)
        if stage == "segment":
            self._clusters = None
        elif stage == "fit":
            self._bones = None
        self.selection.set_groups(self._clusters, self._bones)

    def _restore(self) -> None:
        """Have it as it was left, once it is known how long the recording is."""
        view, self._to_restore = self._to_restore, None
        if view:
            restore_view(self, view)

    def _begin_reading(self) -> None:
        """Read the markers as soon as they are others, so that there is something to look at before anything is run."""
        if self._reading is None and self.board.state("markers") in ("not run", "stale"):
            self._reading = Reading(self.document.session, self.board.keys["markers"])

    def _read(self) -> None:
        reading, self._reading = self._reading, None
        assert reading is not None
        error = reading.error
        if error is None:
            self.board.end()
        else:
            if isinstance(error, InputError):
                failure = Failure("markers", reading.key, error.what, error.where or "", error.remedy)
            else:
                failure = Failure("markers", reading.key, str(error).rstrip("."))
            self.board.end(failure)
            self._failed(failure)

    def _follow_video(self) -> None:
        """Have the frames of the session's video."""
        given = self.document.session.inputs.get("video_file") if self.document.is_open else None
        path = None if given is None else given.path
        if path == (None if self.frames is None else self.frames.path):
            return
        if self.frames is not None:
            self.frames.close()
        self.frames = None if path is None else VideoFrames(path)
        if self.frames is not None:
            self.frames.grown.connect(self._more_video)
            self.frames.arrived.connect(self.video_changed.emit)
        self._more_video()

    def _more_video(self) -> None:
        times = () if self.frames is None else self.frames.times
        if len(times) != len(self.clock.timing.video) or (self.frames is not None and self.frames.done):
            self.clock.timing = replace(self.clock.timing, video=times)
            self.clock.changed.emit()
        if self.frames is not None and self.frames.done and self.frames.problem is not None:
            self.say_error(self.frames.problem)
        self.video_changed.emit()

    @property
    def _waits_for_video(self) -> bool:
        return self.frames is not None and not self.frames.done

    def _failed(self, failure: Failure) -> None:
        self.say(Said("error", failure.what, failure.where, failure.remedy))
