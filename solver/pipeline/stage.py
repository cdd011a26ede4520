"""Stages as data, and the runner that computes only what the store does not have."""

from __future__ import annotations

import graphlib
import inspect
import time
import typing
from collections.abc import Callable, Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Generic, Literal, TypeVar, overload

from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import Found, Progress, part_of, silent, tell
from markerscope.solver.pipeline.digest import canonical, file_digest, result_key
from markerscope.solver.pipeline.pieces import Pieces
from markerscope.solver.pipeline.source import Source, Touched, Watch, changed
from markerscope.solver.pipeline.store import Absent, Store

State = Literal["cached", "stale", "not run", "running", "failed"]
T = TypeVar("T")


class StageName(str, Generic[T]):
    """The name of a stage that leaves a ``T``: what is asked for by it has that type."""


@dataclass(frozen=True)
class NoSettings:
    """For a stage that has nothing to set."""


@dataclass(frozen=True)
class Stage:
    """One step of the work: a pure function with named inputs.

    Attributes
    ----------
    name : what it is called in files, messages and as an input of others
    version : to be raised when the same settings give another result
    settings : frozen dataclass type of its settings; its defaults are the stage's
    inputs : names of the stages and sources it is computed from
    run : ``(settings, progress, *, one parameter for each input) -> result``; a source arrives as its path (or value)
    result : type of the result, a frozen dataclass or an annotation such as ``Landmarks | None``
    headline : one line about a result
    shipped : files of the program itself that it reads: another content makes another result
    cost : how long it takes beside the other stages, in any unit; the quicker of two that do not wait for each other
        runs first
    one_of : sources of which at least one has to be given; none where the stage can do without

    Raises
    ------
    TypeError : ``run`` does not take the inputs, or takes others
    """

    name: str
    version: int
    settings: type
    inputs: tuple[str, ...]
    run: Callable[..., Any]
    result: Any
    headline: Callable[[Any], str] = lambda result: ""
    cost: float = 1.0
    shipped: tuple[Path, ...] = ()
    one_of: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a function of other inputs as soon as the module of the stage is imported."""
        taken = inputs_of(self.run)
        if taken is not None and taken != set(self.inputs):
            raise TypeError(
                f"stage {self.name} is declared on {sorted(self.inputs)}, its function takes {sorted(taken)}"
            )

    def key(self, settings: Any, inputs: Mapping[str, str]) -> str:
        """Key of its result, from the keys and digests of its inputs."""
        own = {f"shipped {path.name}": _shipped_digest(path) for path in self.shipped}
        return result_key(self.name, self.version, settings, {**inputs, **own})


def inputs_of(run: Callable[..., Any]) -> frozenset[str] | None:
    """The inputs that a stage's function takes, by name, or None if it takes any.

    Those of a TypedDict that it unpacks (``**given: Unpack[Some]``) are among them.
    """
    _, _, *own = inspect.signature(run).parameters.values()
    names: set[str] = set()
    for parameter in own:
        if parameter.kind is not inspect.Parameter.VAR_KEYWORD:
            names.add(parameter.name)
            continue
        hint = typing.get_type_hints(run).get(parameter.name)
        if typing.get_origin(hint) is not typing.Unpack:
            return None
        names |= typing.get_args(hint)[0].__annotations__.keys()
    return frozenset(names)


@cache
def _shipped_digest(path: Path) -> str:
    """What ships does not change while the program runs."""
    return file_digest(path)


@dataclass(frozen=True)
class Event:
    """A stage has begun or ended; ``text`` is its headline, or why it failed."""

    stage: str
    state: State
    key: str
    seconds: float = 0.0
    text: str = ""
    computed: bool = False


OnEvent = Callable[[Event], None]


def ignore(event: Event) -> None:
    """Listen to no events."""


@dataclass
class GraphRun:
    """What a run of the graph found; results are loaded from the store when first asked for.

    Attributes
    ----------
    keys : key of every stage
    events : the last event of every stage that was wanted: cached or computed, seconds, headline
    """

    keys: Mapping[str, str]
    events: Mapping[str, Event]
    _value: Callable[[str], Any] = field(repr=False)

    @overload
    def __getitem__(self, stage: StageName[T]) -> T: ...
    @overload
    def __getitem__(self, stage: str) -> Any: ...
    def __getitem__(self, stage: str) -> Any:
        return self._value(stage)

    @property
    def computed(self) -> tuple[str, ...]:
        """Names of the stages that were not in the store."""
        return tuple(name for name, event in self.events.items() if event.computed)


def stage_keys(graph: Sequence[Stage], sources: Mapping[str, Source], settings: Mapping[str, Any]) -> dict[str, str]:
    """Key of every stage, in an order in which they can be computed."""
    stages = {stage.name: stage for stage in graph}
    if len(stages) < len(graph) or stages.keys() & sources.keys():
        raise ValueError("two nodes of the graph have the same name")
    for name in settings.keys() - stages.keys():
        raise ValueError(f"settings for a stage that the graph does not have: {name}")
    keys: dict[str, str] = {}
    depends = {name: [i for i in stage.inputs if i not in sources] for name, stage in stages.items()}
    for name in graphlib.TopologicalSorter(depends).static_order():
        if name not in stages:
            raise ValueError(f"an input that is neither a stage nor a source: {name}")
        stage = stages[name]
        inputs = {i: sources[i].digest if i in sources else keys[i] for i in stage.inputs}
        keys[name] = stage.key(_settings_of(stage, settings), inputs)
    return keys


def stage_states(
    graph: Sequence[Stage], sources: Mapping[str, Source], settings: Mapping[str, Any], store: Store
) -> dict[str, State]:
    """Per stage: *cached*, *stale* (only results of other settings or inputs are there) or *not run*."""
    states: dict[str, State] = {}
    for name, key in stage_keys(graph, sources, settings).items():
        if store.has(name, key):
            states[name] = "cached"
        else:
            states[name] = "stale" if store.list(name) else "not run"
    return states


def run_graph(
    graph: Sequence[Stage],
    sources: Mapping[str, Source],
    settings: Mapping[str, Any],
    store: Store,
    until: Collection[str] | None = None,
    progress: Progress = silent,
    on_event: OnEvent = ignore,
    again: Collection[str] = (),
) -> GraphRun:
    """Have the results of the wanted stages in the store, computing only what is not there.

    Parameters
    ----------
    graph : the stages, in any order
    sources : what comes from outside, by name
    settings : settings of the stages that do not keep their defaults
    until : the stages whose results are wanted, all by default; what only leads to them is computed if needed
    progress : told the fraction of the stages that must run, each by its cost
    on_event : told when a stage begins, ends, fails, or was in the store
    again : the wanted stages that are computed although they are there; what was there stays until then
    """
    keys = stage_keys(graph, sources, settings)
    runner = _Runner({stage.name: stage for stage in graph}, keys, sources, settings, store, progress, on_event)
    wanted = [name for name in keys if until is None or name in until]
    store.clean()
    runner.again = frozenset(again)
    runner.shares = shares(graph, keys, store, wanted, again)
    for name in (*runner.shares, *wanted):
        runner.ensure(name)
    progress(1.0, "done")
    return GraphRun(keys, runner.events, runner.value)


def shares(
    graph: Sequence[Stage],
    keys: Mapping[str, str],
    store: Store,
    wanted: Collection[str],
    again: Collection[str] = (),
) -> dict[str, tuple[float, float]]:
    """From where to where each stage that has to run takes the progress bar, in the order they run.

    Parameters
    ----------
    keys : of every stage, as ``stage_keys`` gives them
    wanted : the stages whose results are wanted
    again : those of them that are computed although they are there
    """
    missing = _missing(graph, keys, store, wanted, again)
    stages = {stage.name: stage for stage in graph}
    total = sum(stages[name].cost for name in missing) or 1.0
    found: dict[str, tuple[float, float]] = {}
    done = 0.0
    for name in _quick_first(missing, stages, keys):
        found[name] = done / total, (done + stages[name].cost) / total
        done += stages[name].cost
    return found


def leading_to(graph: Sequence[Stage], wanted: Collection[str]) -> frozenset[str]:
    """The stages and sources that some stages are computed from, in one step or many, with these stages themselves."""
    stages = {stage.name: stage for stage in graph}
    found: set[str] = set()
    frontier = list(wanted)
    while frontier:
        name = frontier.pop()
        if name not in found:
            found.add(name)
            frontier += stages[name].inputs if name in stages else ()
    return frozenset(found)


def _missing(
    graph: Sequence[Stage],
    keys: Mapping[str, str],
    store: Store,
    wanted: Collection[str],
    again: Collection[str],
) -> set[str]:
    """The stages that have to be computed for these to be there."""
    stages = {stage.name: stage for stage in graph}
    missing: set[str] = set()
    frontier = list(wanted)
    while frontier:
        name = frontier.pop()
        if name in missing or name not in stages:
            continue
        if name in again or not store.has(name, keys[name]):
            missing.add(name)
            frontier += stages[name].inputs
    return missing


def _quick_first(missing: Collection[str], stages: Mapping[str, Stage], keys: Mapping[str, str]) -> list[str]:
    """The stages that must run, each after those it waits for, and what is there soonest first.

    What can be looked at early (how the markers are grouped) does not wait for what takes long (watching the video).
    """
    order: list[str] = []

    def needs(name: str) -> list[str]:
        leading = leading_to(list(stages.values()), [name])
        return [other for other in keys if other in leading and other in missing]

    def soonest(name: str) -> float:
        return sum(stages[other].cost for other in needs(name))

    for name in sorted((name for name in keys if name in missing), key=soonest):
        order += [other for other in needs(name) if other not in order]
    return order


@dataclass(frozen=True)
class _Report:
    """A stage's progress: what it finds on the way is stamped with its name and key, and its files are watched."""

    progress: Progress
    stage: str
    key: str
    watch: Watch
    pieces: Pieces

    def __call__(self, fraction: float, text: str) -> None:
        self.watch.glance()
        self.progress(fraction, text)

    def found(self, found: Found) -> None:
        tell(self.progress, replace(found, stage=self.stage, key=self.key))


class _Runner:
    """The state of one run: what is in memory, what has happened."""

    def __init__(
        self,
        stages: Mapping[str, Stage],
        keys: Mapping[str, str],
        sources: Mapping[str, Source],
        settings: Mapping[str, Any],
        store: Store,
        progress: Progress,
        on_event: OnEvent,
    ) -> None:
        self.stages, self.keys, self.sources, self.settings = stages, keys, sources, settings
        self.store, self.progress, self.on_event = store, progress, on_event
        self.events: dict[str, Event] = {}
        self.memory: dict[str, Any] = {}
        self.shares: Mapping[str, tuple[float, float]] = {}
        self.again: frozenset[str] = frozenset()

    def ensure(self, name: str) -> None:
        """Have a stage's result in the store."""
        if name in self.events:
            return
        entry = self.store.entry(name, self.keys[name])
        if entry is None or name in self.again:
            self._compute(name)
        else:
            about = entry.about
            self._tell(Event(name, "cached", entry.key, about.get("seconds", 0.0), about.get("headline", "")))

    def value(self, name: str) -> Any:
        """A source's value or a stage's result, computed if the store turns out not to have it whole."""
        if name in self.sources:
            return self.sources[name].value
        if name not in self.memory:
            self.ensure(name)
        if name not in self.memory:
            try:
                self.memory[name] = self.store.get(name, self.keys[name], self.stages[name].result)
            except Absent:
                self.store.discard(name, self.keys[name])
                self._compute(name)
        return self.memory[name]

    def _compute(self, name: str) -> None:
        stage, key = self.stages[name], self.keys[name]
        inputs = {i: self.value(i) for i in stage.inputs}
        settings = _settings_of(stage, self.settings)
        self._tell(Event(name, "running", key))
        start = time.perf_counter()
        try:
            result = self._run(stage, inputs, settings)
            seconds = time.perf_counter() - start
            headline = stage.headline(result)
            about = {
                "version": stage.version,
                "settings": canonical(settings),
                "inputs": {i: self.sources[i].digest if i in self.sources else self.keys[i] for i in stage.inputs},
                "seconds": seconds,
                "headline": headline,
            }
            if name in self.again:
                self.store.discard(name, key)
            self.store.put(name, key, result, about)
        except Cancelled:
            self._tell(Event(name, "not run", key))
            raise
        except Exception as error:
            self._tell(Event(name, "failed", key, text=str(error)))
            raise
        Pieces(self.store, name, key).discard()
        self.memory[name] = result
        self._tell(Event(name, "cached", key, seconds, headline, computed=True))
        part_of(self.progress, *self.shares.get(name, (0.0, 0.0)))(1.0, name)

    def _run(self, stage: Stage, inputs: Mapping[str, Any], settings: Any) -> Any:
        """What a stage finds, if the files it read held all the while what their digests say.

        A file that was touched is read once more: somebody may have put another one in its place for a moment.
        """
        key, files = self.keys[stage.name], [self.sources[i] for i in stage.inputs if i in self.sources]
        progress = part_of(self.progress, *self.shares.get(stage.name, (0.0, 0.0)))
        for _ in range(2):
            watch = Watch(files)
            pieces = Pieces(self.store, stage.name, key, watch.look)
            report = _Report(progress, stage.name, key, watch, pieces)
            try:
                report(0.0, stage.name)
                result = stage.run(settings, report, **inputs)
                watch.end()
                return result
            except Touched:
                continue
            except InputError:
                with suppress(Touched):
                    watch.look()  # else the other content is what could not be used
                pieces.discard()
                raise
        raise changed(files[0].value)

    def _tell(self, event: Event) -> None:
        self.events[event.stage] = event
        self.on_event(event)


def _settings_of(stage: Stage, settings: Mapping[str, Any]) -> Any:
    return settings[stage.name] if stage.name in settings else stage.settings()
