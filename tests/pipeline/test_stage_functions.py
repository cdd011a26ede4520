"""Every stage's function takes what the stage says: names and types of its inputs, its settings and its result."""

from __future__ import annotations

import typing
from collections.abc import Callable
from functools import reduce
from operator import or_
from pathlib import Path
from typing import Any, TypedDict, Unpack

import pytest

from markerscope.solver.core.progress import Progress
from markerscope.solver.pipeline import names
from markerscope.solver.pipeline.methods import GRAPHS, result_type
from markerscope.solver.pipeline.stage import NoSettings, Stage, StageName, inputs_of
from markerscope.solver.pipeline.stages import SOURCES

REQUIRED = {"marker_file"}
"""A session is refused without it."""
STAGES = [pytest.param(m, stage, id=f"{m}-{stage.name}") for m, graph in GRAPHS.items() for stage in graph]


def members(hint: Any) -> frozenset[Any]:
    """The types that a union is of."""
    return frozenset(typing.get_args(hint)) or frozenset({hint})


def left_by(name: str, run: Callable[..., Any]) -> Any:
    """What the stage ``name`` leaves in the methods whose graphs have the function ``run``."""
    graphs = [graph for graph in GRAPHS.values() if any(stage.run is run for stage in graph)]
    return reduce(or_, (stage.result for graph in graphs for stage in graph if stage.name == name))


def hints_of(run: Callable[..., Any]) -> dict[str, Any]:
    """The annotations of a stage's function by parameter, those of a TypedDict that it unpacks among them."""
    hints = typing.get_type_hints(run)
    unpacked = [name for name, hint in hints.items() if typing.get_origin(hint) is Unpack]
    for name in unpacked:
        hints |= typing.get_type_hints(typing.get_args(hints.pop(name))[0])
    return hints


@pytest.mark.parametrize(("method", "stage"), STAGES)
def test_a_stage_function_is_typed_as_its_stage_is_declared(method: str, stage: Stage) -> None:
    hints = hints_of(stage.run)
    assert members(hints.pop("return")) == members(stage.result)
    assert issubclass(stage.settings, hints.pop("settings"))
    assert hints.pop("progress") == Progress
    assert hints.keys() == set(stage.inputs)
    for name, hint in hints.items():
        given = left_by(name, stage.run) if name not in SOURCES else Path if name in REQUIRED else Path | None
        assert members(hint) == members(given), f"{method}: {stage.name} takes {name} for {hint}, and it is {given}"


class Both(TypedDict):
    one: int
    other: str


def test_a_function_of_other_inputs_is_refused_where_the_stage_is_made() -> None:
    def run(settings: NoSettings, progress: Progress, *, one: int, more: float) -> int:
        return one

    assert Stage("made", 1, NoSettings, ("more", "one"), run, int).run is run
    for inputs in ((), ("one",), ("one", "other"), ("one", "more", "other")):
        with pytest.raises(TypeError, match="stage made is declared on"):
            Stage("made", 1, NoSettings, inputs, run, int)


def test_inputs_that_are_unpacked_are_inputs() -> None:
    def run(settings: NoSettings, progress: Progress, *, more: float, **given: Unpack[Both]) -> int:
        return given["one"]

    def whatever(settings: NoSettings, progress: Progress, **given: Any) -> None: ...

    assert inputs_of(run) == {"more", "one", "other"}
    assert inputs_of(whatever) is None


def test_the_names_of_stages_know_what_each_leaves_in_any_method() -> None:
    typed = {value: value for value in vars(names).values() if isinstance(value, StageName)}
    assert typed.keys() == {stage.name for graph in GRAPHS.values() for stage in graph}
    for name in typed.values():
        (declared,) = typing.get_args(name.__orig_class__)  # type: ignore[attr-defined]
        assert members(declared) == members(result_type(name)), name
        assert getattr(names, name.upper()) == name
