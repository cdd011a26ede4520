"""The runner computes what is missing, no more and no less."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import Found, part_of, tell
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import (
    Event,
    NoSettings,
    Stage,
    leading_to,
    run_graph,
    shares,
    stage_keys,
    stage_states,
)
from markerscope.solver.pipeline.store import Store


@dataclass(frozen=True)
class Scale:
    factor: float = 2.0


@dataclass(frozen=True)
class Numbers:
    values: np.ndarray


class Work:
    """A graph ``read -> (double, total) -> join`` that notes what it computes."""

    def __init__(self, folder: Path) -> None:
        self.ran: list[str] = []
        self.store = Store(folder / "results")
        self.file = folder / "numbers.txt"
        self.file.write_text("1 2 3")
        self.graph = (
            self.stage("join", ("double", "total"), lambda i, s: i["double"].values / i["total"].values.sum()),
            self.stage("double", ("read",), lambda i, s: i["read"].values * s.factor, Scale),
            self.stage("total", ("read",), lambda i, s: i["read"].values.sum(keepdims=True)),
            self.stage("read", ("file", "extra"), self.read),
        )

    def read(self, inputs: Mapping[str, Any], settings: Any) -> np.ndarray:
        values = np.array(inputs["file"].read_text().split(), dtype=float)
        return values if inputs["extra"] is None else values + float(inputs["extra"].read_text())

    def stage(self, name: str, inputs: tuple[str, ...], function: Any, settings: type = NoSettings) -> Stage:
        def run(chosen: Any, progress: Any, **given: Any) -> Numbers:
            self.ran.append(name)
            assert set(given) == set(inputs)
            progress(0.5, f"half of {name}")
            return Numbers(function(given, chosen))

        return Stage(name, 1, settings, inputs, run, Numbers, lambda result: f"{len(result.values)} numbers")

    @property
    def sources(self) -> dict[str, Source]:
        return {"file": Source.file(self.file), "extra": Source.file(None)}

    def go(self, settings: Mapping[str, Any] | None = None, **kwargs: Any) -> list[str]:
        """Run the graph and say what was computed."""
        self.ran.clear()
        self.last = run_graph(self.graph, self.sources, settings or {}, self.store, **kwargs)
        assert set(self.last.computed) == set(self.ran)
        return sorted(self.ran)


@pytest.fixture
def work(tmp_path: Path) -> Work:
    return Work(tmp_path)


def test_the_second_run_computes_nothing(work: Work) -> None:
    assert work.go() == ["double", "join", "read", "total"]
    expected = np.array([2, 4, 6]) / 6
    np.testing.assert_allclose(work.last["join"].values, expected)
    assert work.go() == []
    np.testing.assert_allclose(work.last["join"].values, expected)


def test_a_setting_recomputes_only_what_depends_on_it_and_going_back_is_free(work: Work) -> None:
    work.go()
    assert work.go({"double": Scale(3.0)}) == ["double", "join"]
    np.testing.assert_allclose(work.last["join"].values, np.array([3, 6, 9]) / 6)
    assert work.go() == []


def test_a_changed_file_recomputes_everything_and_a_renamed_one_nothing(work: Work) -> None:
    work.go()
    work.file = work.file.rename(work.file.with_name("renamed.txt"))
    assert work.go() == []
    work.file.write_text("1 2 4")
    assert work.go() == ["double", "join", "read", "total"]


def test_a_new_version_of_a_stage_recomputes_it_and_its_dependents(work: Work) -> None:
    work.go()
    work.graph = tuple(replace(s, version=2) if s.name == "total" else s for s in work.graph)
    assert work.go() == ["join", "total"]


def test_only_what_is_wanted_is_computed(work: Work) -> None:
    assert work.go(until=["total"]) == ["read", "total"]
    work.store.discard("read", work.last.keys["read"])
    assert work.go(until=["total"]) == []
    assert work.go(until=["double"]) == ["double", "read"]


def test_a_damaged_result_is_computed_again_when_it_is_needed(work: Work) -> None:
    work.go()
    arrays = work.store.folder("read", work.last.keys["read"]) / "arrays.npz"
    content = bytearray(arrays.read_bytes())
    content[len(content) // 2] ^= 1
    arrays.write_bytes(content)
    assert work.go({"double": Scale(5.0)}) == ["double", "join", "read"]
    np.testing.assert_allclose(work.last["join"].values, np.array([5, 10, 15]) / 6)


def test_states_are_derived_from_keys(work: Work) -> None:
    def states(settings: Mapping[str, Any] | None = None) -> dict[str, str]:
        return stage_states(work.graph, work.sources, settings or {}, work.store)

    assert set(states().values()) == {"not run"}
    work.go(until=["total"])
    assert states() == {"read": "cached", "total": "cached", "double": "not run", "join": "not run"}
    work.go()
    assert states({"double": Scale(9.0)}) == {"read": "cached", "total": "cached", "double": "stale", "join": "stale"}


def test_events_tell_what_happens(work: Work) -> None:
    events: list[Event] = []
    work.go(on_event=events.append)
    assert [(e.stage, e.state) for e in events][:2] == [("read", "running"), ("read", "cached")]
    done = [e for e in events if e.computed]
    assert {e.stage for e in done} == {"read", "double", "total", "join"}
    assert all(e.seconds > 0 for e in done)
    again: list[Event] = []
    work.go(on_event=again.append)
    assert [(e.state, e.computed) for e in again] == [("cached", False)] * 4
    assert {e.stage: (e.seconds, e.text) for e in again} == {e.stage: (e.seconds, e.text) for e in done}
    assert next(e for e in again if e.stage == "read").text == "3 numbers"


def test_progress_rises_to_one_by_the_cost_of_what_must_run(work: Work) -> None:
    work.graph = tuple(replace(s, cost=7.0) if s.name == "read" else s for s in work.graph)
    seen: list[tuple[float, str]] = []
    work.go(progress=lambda fraction, text: seen.append((fraction, text)))
    fractions = [fraction for fraction, _ in seen]
    assert fractions == sorted(fractions)
    assert (fractions[0], fractions[-1]) == (0.0, 1.0)
    assert {text: fraction for fraction, text in seen}["half of read"] == pytest.approx(0.35)


def failing(error: BaseException) -> Any:
    def run(settings: Any, progress: Any, **inputs: Any) -> Any:
        raise error

    return run


@pytest.mark.parametrize(
    ("error", "state"), [(InputError("no markers", "a.trc"), "failed"), (Cancelled("Cancelled."), "not run")]
)
def test_a_stage_that_fails_leaves_the_others(work: Work, error: Exception, state: str) -> None:
    healthy = work.graph
    work.graph = tuple(replace(s, run=failing(error)) if s.name == "join" else s for s in healthy)
    events: list[Event] = []
    with pytest.raises(type(error)):
        work.go(on_event=events.append)
    assert (events[-1].stage, events[-1].state) == ("join", state)
    work.graph = healthy
    assert work.go() == ["join"]


def test_wrong_graphs_are_refused(work: Work) -> None:
    read = next(s for s in work.graph if s.name == "read")
    for graph in (
        (*work.graph, read),
        (replace(read, inputs=("nowhere",)),),
        (replace(read, inputs=("read",)),),
        (replace(read, name="file"),),
    ):
        with pytest.raises(ValueError):
            stage_keys(graph, work.sources, {})
    with pytest.raises(ValueError, match="typo"):
        stage_keys(work.graph, work.sources, {"typo": Scale()})


def test_what_a_stage_finds_on_the_way_arrives_with_its_name_and_key(tmp_path: Path) -> None:
    heard: list[Found] = []

    class Listener:
        def __call__(self, fraction: float, text: str) -> None: ...

        def found(self, found: Found) -> None:
            heard.append(found)

    def run(chosen: Any, progress: Any, **given: Any) -> Numbers:
        tell(part_of(part_of(progress, 0.0, 0.5), 0.2, 0.4), Found("candidate", 3, {"energy": 1.5}))
        return Numbers(np.zeros(1))

    stage = Stage("search", 1, NoSettings, (), run, Numbers)
    done = run_graph([stage], {}, {}, Store(tmp_path), progress=Listener())
    assert heard == [Found("candidate", 3, {"energy": 1.5}, "search", done.keys["search"])]
    run_graph([stage], {}, {}, Store(tmp_path / "other"))  # who only hears fractions is not bothered


def test_a_stage_is_computed_again_where_that_is_asked_for(work: Work) -> None:
    work.go()
    keys = dict(work.last.keys)
    assert work.go(until=["double"], again=["double"]) == ["double"], "what it needs is there, and stays"
    assert work.go(until=["join"], again=["total", "join"]) == ["join", "total"]
    assert work.last.keys == keys
    work.store.discard("read", keys["read"])
    assert work.go(until=["double"], again=["double"]) == ["double", "read"]
    assert shares(work.graph, keys, work.store, ["join"], ["join"]).keys() == {"join"}


def test_only_what_has_to_run_takes_the_bar(tmp_path: Path) -> None:
    work = Work(tmp_path)
    costs = {"read": 1.0, "double": 2.0, "total": 3.0, "join": 4.0}
    graph = [replace(stage, cost=costs[stage.name]) for stage in work.graph]
    keys = stage_keys(graph, work.sources, {})
    whole = shares(graph, keys, work.store, ["join"])
    assert list(whole) == [name for name in keys if name in whole]
    assert {name: 10 * (stop - start) for name, (start, stop) in whole.items()} == pytest.approx(costs)
    assert shares(graph, keys, work.store, ["double"]).keys() == {"read", "double"}
    run_graph(graph, work.sources, {}, work.store, until=["double"])
    assert shares(graph, keys, work.store, ["join"]).keys() == {"total", "join"}


def test_what_is_quick_does_not_wait_for_what_is_slow(work: Work) -> None:
    slow = replace(work.stage("watch", ("file",), lambda i, s: np.ones(1)), cost=16.0)
    after = work.stage("place", ("watch", "double"), lambda i, s: i["double"].values)
    work.graph = (slow, after, *work.graph)
    assert work.go() == ["double", "join", "place", "read", "total", "watch"]
    assert work.ran.index("join") < work.ran.index("watch") < work.ran.index("place")
    order = list(shares(work.graph, stage_keys(work.graph, work.sources, {}), work.store, ["join"], again=["join"]))
    assert order == ["join"]
    assert leading_to(work.graph, ["place"]) == {"place", "watch", "double", "read", "file", "extra"}
