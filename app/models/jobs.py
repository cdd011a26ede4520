"""The stages run in a worker process: started, watched without waiting, stopped; what it finds is passed on."""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass, field
from statistics import median

from markerscope.app.models.results import Ref
from markerscope.app.models.signal import Signal
from markerscope.app.models.stages import Failure, StageBoard
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import Found
from markerscope.solver.pipeline.run import run_session
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.stage import Event, shares
from markerscope.solver.pipeline.worker import Failed, Finished, Job, Message, Progressed

_GUESS_S = 0.7
"""Seconds that a unit of a stage's cost takes, before anything is known of this computer."""
_KNOWN_PART = 0.05
"""Before this part of a stage is done, how long it has taken says nothing of how long it will."""


@dataclass(frozen=True)
class Plan:
    """What a run would do.

    Attributes
    ----------
    stages : that would be computed, in their order
    seconds : s, about how long that takes
    """

    stages: tuple[str, ...]
    seconds: float


@dataclass(frozen=True)
class Running:
    """How far the work is.

    Attributes
    ----------
    stage : at work, empty before the first
    part : 0..1 of that stage
    whole : 0..1 of all that was asked for
    text : what it is at
    seconds_left : of all that was asked for, None while unknown
    stage_left : s, of that stage
    """

    stage: str = ""
    part: float = 0.0
    whole: float = 0.0
    text: str = ""
    seconds_left: float | None = None
    stage_left: float | None = None


@dataclass
class _Work:
    job: Job
    session: Session
    shares: dict[str, tuple[float, float]]
    expected: dict[str, float]
    last: Ref | None = None
    since: float = 0.0
    waiting: deque[Message] = field(default_factory=deque)
    at: Running = field(default_factory=Running)


class Runner:
    """At most one run of the board's stages.

    Parameters
    ----------
    board : whose session is run, and who is told of stages that begin and end
    clock : s, never going back

    Attributes
    ----------
    changed : emitted when a run begins or ends
    progressed : emitted with how far it is
    landed : emitted with a stage whose result is there
    found : emitted with something that a stage found on the way
    failed : emitted with why a run has ended without its results
    notes : what was found on the way, by result, until the result is there
    """

    def __init__(self, board: StageBoard, clock: Callable[[], float] = time.monotonic) -> None:
        self.board = board
        self.changed: Signal[[]] = Signal()
        self.progressed: Signal[[Running]] = Signal()
        self.landed: Signal[[Ref]] = Signal()
        self.found: Signal[[Found]] = Signal()
        self.failed: Signal[[Failure]] = Signal()
        self.notes: dict[Ref, list[Found]] = {}
        self._clock = clock
        self._work: _Work | None = None

    @property
    def running(self) -> bool:
        """Whether a run is under way."""
        return self._work is not None

    @property
    def at(self) -> Running | None:
        """How far it is, None where nothing runs."""
        return None if self._work is None else self._work.at

    def run(self, until: Collection[str] | None = None, again: Collection[str] = ()) -> bool:
        """Have the results of some stages, all by default, with the settings as they are now.

        Returns whether there was anything to do. Settings that change meanwhile count from the next run on.

        Parameters
        ----------
        until : the stages that are wanted; what they are computed from is computed where it is not there. None for all
            that can be computed from the files there are
        again : those of them that are computed although they are there

        Raises
        ------
        InputError : something runs already, or an input is not there
        """
        if self._work is not None:
            raise InputError("stages are running already", remedy="wait for them, or stop them")
        self.board.refresh()
        board, session = self.board, self.board.document.session
        wanted = self._wanted(until)
        parts = shares(board.graph, board.keys, session.store, wanted, again)
        if not parts:
            return False
        job = Job(run_session, session, tuple(wanted), store=session.store, again=tuple(again))
        self._work = _Work(job, session, parts, self._expected(parts), since=self._clock())
        self._work.at = Running(text="starting", seconds_left=sum(self._work.expected.values()))
        self.changed.emit()
        return True

    def plan(self, until: Collection[str] | None = None) -> Plan:
        """What a run would do now.

        Raises
        ------
        InputError : an input is not there
        """
        wanted, board = self._wanted(until), self.board
        stages = shares(board.graph, board.keys, board.document.session.store, wanted)
        return Plan(tuple(stages), sum(self._expected(stages).values()))

    def _wanted(self, until: Collection[str] | None) -> tuple[str, ...]:
        if until is None and self.board.runnable:
            return self.board.runnable
        wanted = self.board.names if until is None else tuple(until)
        if (problem := self.board.problem_of(wanted)) is not None:
            raise problem
        return wanted

    def poll(self) -> bool:
        """Pass on what has arrived; to be called some twenty times a second while something runs.

        At most one stage begins or ends with a call, since much is drawn anew then. Returns whether one did.
        """
        if self._work is None:
            return False
        turned = False
        before, waiting = self._work.at, self._work.waiting
        waiting.extend(self._work.job.poll())
        while waiting and self.running:
            message = waiting.popleft()
            self._take(message)
            turned = not isinstance(message, Progressed | Found)
            if turned:
                break
        if self.running:
            self._estimate()
            if self._work.at != before:
                self.progressed.emit(self._work.at)
        return turned

    def cancel(self) -> None:
        """End the run; what it has finished stays."""
        if self._work is None:
            return
        job, waiting = self._work.job, self._work.waiting
        job.cancel()
        while self.running:  # the last message is on its way
            waiting.extend(job.poll())
            while waiting:
                self._take(waiting.popleft())
            time.sleep(0.001)

    def _take(self, message: Message) -> None:
        work = self._work
        if work is None:
            return
        if isinstance(message, Progressed):
            start, stop = work.shares.get(work.last.stage if work.last else "", (0.0, 1.0))
            part = (message.fraction - start) / (stop - start) if stop > start else 0.0
            work.at = Running(
                work.at.stage, min(max(part, 0.0), 1.0), min(max(message.fraction, 0.0), 1.0), message.text
            )
        elif isinstance(message, Found):
            self.notes.setdefault(Ref(message.stage, message.key), []).append(message)
            self.found.emit(message)
        elif isinstance(message, Event):
            self._take_event(work, message)
        elif isinstance(message, Finished) or isinstance(message.error, Cancelled):
            self._end(None)
        else:
            self._end(_failure(work.last, message))

    def _take_event(self, work: _Work, event: Event) -> None:
        ref = Ref(event.stage, event.key)
        if event.state == "running":
            work.last, work.since = ref, self._clock()
            work.at = Running(event.stage, 0.0, work.at.whole)
            self.notes.pop(ref, None)
            self.board.begin(event.stage, event.key)
        elif event.state == "cached" and event.computed:
            work.expected.pop(event.stage, None)
            self.notes.pop(ref, None)
            self.board.results.forget(ref.stage, ref.key)
            self.board.land(ref, work.session)
            self.landed.emit(ref)

    def _end(self, failure: Failure | None) -> None:
        self._work = None
        self.notes.clear()
        self.board.end(failure)
        self.changed.emit()
        if failure is not None:
            self.failed.emit(failure)

    def _expected(self, stages: Collection[str]) -> dict[str, float]:
        """S that each stage may take: as it took with other settings, else by what its cost has meant for others."""
        took = {
            stage.name: median([float(entry.about.get("seconds", 0.0)) for entry in entries])
            for stage in self.board.graph
            if (entries := self.board.results.entries(stage.name))
        }
        cost = {stage.name: stage.cost for stage in self.board.graph}
        rates = [took[name] / cost[name] for name in took if took[name] > 0.05]
        rate = median(rates) if rates else _GUESS_S
        return {name: 0.0 if self.board.has_no_file(name) else took.get(name, cost[name] * rate) for name in stages}

    def _estimate(self) -> None:
        """The time left, from the time that the stage at work has taken and what is expected of it and the others."""
        work = self._work
        assert work is not None
        at = work.at
        rest = sum(seconds for name, seconds in work.expected.items() if name != at.stage)
        expected, taken = work.expected.get(at.stage, 0.0), self._clock() - work.since
        own = max(expected - taken, 0.0)
        if at.part >= _KNOWN_PART:
            own = (1 - at.part) * own + at.part * taken * (1 - at.part) / at.part
        work.at = Running(at.stage, at.part, at.whole, at.text, float(round(rest + own)), float(round(own)))


def _failure(at: Ref | None, message: Failed) -> Failure:
    error, stage, key = message.error, at.stage if at else "", at.key if at else ""
    if isinstance(error, InputError):
        return Failure(stage, key, error.what, error.where or "", error.remedy, message.details)
    what = str(error).rstrip(".")
    return Failure(stage, key, what, "", "nothing that was finished is lost; try again", message.details)
