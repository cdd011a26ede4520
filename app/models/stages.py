"""The stages of the open session: their states, settings and results, derived from keys and never remembered."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markerscope.app.models.document import Document
from markerscope.app.models.edits import Edit, decided
from markerscope.app.models.fields import TITLES, Setting, settings_of, title
from markerscope.app.models.lineage import go_back, lineage_of, said_difference
from markerscope.app.models.regroup import regrouped
from markerscope.app.models.results import Ref, Results, StageResults
from markerscope.app.models.signal import Signal
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import Stage, State, leading_to, stage_keys
from markerscope.solver.pipeline.stages import SOURCES
from markerscope.solver.pipeline.store import Entry, Store


@dataclass(frozen=True)
class Failure:
    """Why a stage has no result.

    Attributes
    ----------
    stage, key : which result it would have been
    what, where, remedy : what happened, where, and what to do about it
    details : for a report of a mistake in the program; not for the user to read
    """

    stage: str
    key: str
    what: str
    where: str = ""
    remedy: str = ""
    details: str = ""

    @property
    def sentence(self) -> str:
        """All of it."""
        place = f"{self.where}: " if self.where else ""
        return f"{place}{self.what}{f'; {self.remedy}' if self.remedy else ''}."


@dataclass(frozen=True)
class Earlier:
    """A result of a stage that is in the store.

    Attributes
    ----------
    key : which
    settings : what differs from the settings in force, in words; empty for the one in force
    when : when it was computed, in words
    headline : its figure
    current : whether it is the one in force
    compared : whether it is shown beside the one in force
    """

    key: str
    settings: str
    when: str
    headline: str
    current: bool
    compared: bool


@dataclass(frozen=True)
class Card:
    """All there is to say of a stage.

    Attributes
    ----------
    name, title, help : of the stage
    state : cached, stale, running, failed, not run
    key : of the result that the settings ask for
    seconds : how long the result took, None without one
    headline : of the result; why it failed; or, where it is stale, of the result that was last in force
    fields : its settings
    earlier : its results, the newest first
    why_not : why it cannot be run, empty if it can
    """

    name: str
    title: str
    state: State
    key: str
    seconds: float | None = None
    headline: str = ""
    fields: tuple[Setting, ...] = ()
    earlier: tuple[Earlier, ...] = ()
    help: str = ""
    why_not: str = ""


NEEDED = {"video_file": "a video", "prior_file": "a pose prior"}
"""What a stage may need, in words."""


class StageBoard:
    """The stages of the document's session.

    Attributes
    ----------
    changed : emitted when anything about any stage may have changed
    results : of the session, whatever their settings; another object for another session
    compared : results that are shown beside those in force
    problems : what is wrong with a file the session was made from, by the name of the source
    prepare : called in the background with a result that is loaded ahead, before it counts as loaded
    """

    def __init__(self, document: Document) -> None:
        self.document = document
        self.changed: Signal[[]] = Signal()
        self.prepare: Callable[[Ref, Any], None] = lambda ref, value: None
        self.results = Results(Store(Path()))
        self.compared: set[Ref] = set()
        self.problems: dict[str, InputError] = {}
        self.keys: dict[str, str] = {}
        self.sources: dict[str, Source] = {}
        self.settings: dict[str, Any] = {}
        self.graph: tuple[Stage, ...] = ()
        self._running: Ref | None = None
        self._failures: dict[Ref, Failure] = {}
        self._said: dict[Ref, str] = {}  # how each earlier result's settings differ, while the settings stay
        document.changed.connect(self._follow)
        document.leaving.connect(self._note)
        if document.is_open:
            self._follow(True)

    @property
    def names(self) -> tuple[str, ...]:
        """The stages of the method, in the order they are shown; none while no session is open."""
        if not self.document.is_open:
            return ()
        order = list(TITLES)
        return tuple(sorted(self.keys, key=lambda name: order.index(name) if name in order else len(order)))

    @property
    def current(self) -> StageResults:
        """The results in force; a stage that is stale or was not run is not in it."""
        return self.results.of(self.keys)

    def state(self, stage: str) -> State:
        """A stage's state, from its key."""
        ref = Ref(stage, self.keys[stage])
        if ref == self._running:
            return "running"
        if self.results.has(*_pair(ref)):
            return "cached"
        if ref in self._failures:
            return "failed"
        return "not run" if self.latest(stage) is None else "stale"

    def latest(self, stage: str) -> tuple[str, bool] | None:
        """Key of what there is to draw of a stage, and whether it is in force; a stale one is to be drawn as such.

        Where the settings have no result, it is the one that was last in force on the way to them. Whatever else is in
        the store (of a decision that was undone, of another program's run) is no answer to anything that was asked.
        """
        key = self.keys.get(stage)
        if key is None:
            return None
        if self.results.has(stage, key):
            return key, True
        before = self.document.history.in_force_before(stage)
        return next(((known, False) for known in before if self.results.has(stage, known)), None)

    def was_in_force(self, stage: str, key: str) -> bool:
        """Whether a result is, or was on the way to the session as it is now, the answer of its settings."""
        if not self.document.is_open:
            return False
        return self.keys.get(stage) == key or key in self.document.history.in_force_before(stage)

    def failure(self, stage: str) -> Failure | None:
        """Why a stage failed with its settings as they are."""
        return self._failures.get(Ref(stage, self.keys.get(stage, "")))

    def card(self, stage: str) -> Card:
        """All there is to say of a stage."""
        own = next(s for s in self.graph if s.name == stage)
        key, state = self.keys[stage], self.state(stage)
        entries = self.results.entries(stage)
        drawn = self.latest(stage) if state in ("cached", "stale") else (key, True)
        shown = None if drawn is None else self.results.entry(stage, drawn[0])
        failure = self.failure(stage)
        headline = (
            failure.sentence if failure and state == "failed" else str(shown.about.get("headline", "")) if shown else ""
        )
        return Card(
            name=stage,
            title=title(stage),
            state=state,
            key=key,
            seconds=float(shown.about.get("seconds", 0.0)) if shown else None,
            headline=headline,
            fields=settings_of(stage, self.settings[stage], decided(self.document.session, stage)),
            earlier=tuple(self._earlier(stage, entry) for entry in entries),
            help=(own.run.__doc__ or "").strip().split("\n")[0],
            why_not="" if (problem := self.problem_of([stage])) is None else str(problem),
        )

    def problem_of(self, stages: Iterable[str]) -> InputError | None:
        """Why some stages cannot be run: a file that one of them needs is not there, or was never given."""
        needed = leading_to(self.graph, [*stages])
        for name, problem in self.problems.items():
            if name in needed:
                return problem
        given = self.document.session.inputs.keys() if self.document.is_open else set[str]()
        for stage in self.graph:
            if stage.name in needed and stage.one_of and not given & set(stage.one_of):
                what = " nor ".join(NEEDED[name] for name in stage.one_of)
                return InputError(f"there is neither {what}", "the session", "add one of them")
        return None

    @property
    def runnable(self) -> tuple[str, ...]:
        """The stages that can be run with the files there are, in the order they are shown."""
        return tuple(name for name in self.names if self.problem_of([name]) is None and not self.has_no_file(name))

    def has_no_file(self, stage: str) -> bool:
        """Whether a stage reads nothing but files that were not given, so that there is nothing for it to do."""
        inputs = next(own.inputs for own in self.graph if own.name == stage)
        given = self.document.session.inputs.keys()
        return all(name in self.sources and name not in given for name in inputs)

    @property
    def cards(self) -> tuple[Card, ...]:
        """All there is to say of every stage."""
        return tuple(self.card(name) for name in self.names)

    def go_back(self, stage: str, key: str) -> Edit:
        """The edit that makes an earlier result of a stage the one in force.

        Raises
        ------
        InputError : it was computed from other files, or by settings that this version does not have
        """
        return go_back(self.document.session, self.sources, self.results, stage, key)

    def compare(self, stage: str, key: str, on: bool) -> None:
        """Show a result beside the one in force, or no more."""
        ref = Ref(stage, key)
        if (ref in self.compared) != on and (not on or self.results.has(stage, key)):
            self.compared ^= {ref}
            self.changed.emit()

    def begin(self, stage: str, key: str) -> None:
        """A worker has begun with a stage."""
        self._running = Ref(stage, key)
        self._failures.pop(self._running, None)
        self.changed.emit()

    def end(self, failure: Failure | None = None) -> None:
        """The worker has ended with the stage it was at."""
        self._running = None
        if failure is not None:
            self._failures[Ref(failure.stage, failure.key)] = failure
        self._note()
        self.changed.emit()

    def land(self, ref: Ref, session: Session) -> None:
        """A result is there that was computed for a session, which may have changed meanwhile."""
        self.document.note_for(session, {ref.stage: ref.key})
        self.end()

    def refresh(self) -> None:
        """Look again at the files the session was made from, and at the store."""
        self._note()
        self._follow(False)

    def _follow(self, another: bool) -> None:
        if another:
            self.results.close()
            self.compared, self._failures, self._running = set(), {}, None
            self.keys, self.sources, self.settings, self.graph, self.problems = {}, {}, {}, (), {}
            folder = self.document.folder if self.document.is_open else Path()
            self.results = Results(Store(folder / "results"), prepare=lambda ref, value: self.prepare(ref, value))
        if self.document.is_open:
            self._derive(self.document.session)
            self._note()
        self.changed.emit()

    def _note(self) -> None:
        """Have the document remember the results that are in force, before or after anything of that changes."""
        if self.document.is_open:
            self.document.note({name: key for name, key in self.keys.items() if self.results.has(name, key)})

    def _derive(self, session: Session) -> None:
        self._said.clear()
        self.graph = graph_of(session)
        self.settings = session.stage_settings(self.graph)
        self.sources, self.problems = known_sources(session)
        self.keys = stage_keys(self.graph, self.sources, self.settings)
        regrouped(self.graph, self.keys, self.settings, self.results)
        self.compared = {ref for ref in self.compared if self.results.has(*_pair(ref))}

    def _earlier(self, stage: str, entry: Entry) -> Earlier:
        current = entry.key == self.keys[stage]
        ref = Ref(stage, entry.key)
        said = "" if current else self._said.get(ref)
        if said is None:
            past = lineage_of(self.results, stage, entry.key)
            said = self._said[ref] = said_difference(past, self.graph, stage, self.settings, self.sources)
        when = time.strftime("%Y-%m-%d %H:%M", time.localtime(self.results.written(entry)))
        headline = str(entry.about.get("headline", ""))
        return Earlier(entry.key, said, when, headline, current, ref in self.compared)


def known_sources(session: Session) -> tuple[dict[str, Source], dict[str, InputError]]:
    """The session's files as sources, and what is wrong with those that cannot be read.

    A file that has gone is taken to hold what it held: what was computed from it can still be looked at.
    """
    cache, found, problems = session.digests, dict[str, Source](), dict[str, InputError]()
    for name in SOURCES:
        given = session.inputs.get(name)
        try:
            found[name] = Source.file(given.path if given else None, cache)
        except InputError as error:
            assert given is not None
            found[name] = Source(given.path, given.digest or "missing")
            problems[name] = error
    cache.save()
    return found, problems


def states_of(board: StageBoard) -> Mapping[str, State]:
    """Every stage's state."""
    return {name: board.state(name) for name in board.names}


def _pair(ref: Ref) -> tuple[str, str]:
    return ref.stage, ref.key
