"""The methods that a body can be fitted by: the graph of each, and a session taken from one to another."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache, reduce
from operator import or_
from typing import Any

from markerscope.solver.core.request import Method
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.stage import Stage
from markerscope.solver.pipeline.stages import GRAPH
from markerscope.solver.pipeline.stages_known import GRAPH_KNOWN
from markerscope.solver.pipeline.stages_neural import GRAPH_NEURAL
from markerscope.solver.pipeline.stages_paper import GRAPH_PAPER

GRAPHS: dict[Method, tuple[Stage, ...]] = {
    "bundle": GRAPH,
    "paper": GRAPH_PAPER,
    "neural": GRAPH_NEURAL,
    "known": GRAPH_KNOWN,
}


def graph_of(session: Session) -> tuple[Stage, ...]:
    """The stages of the session's method."""
    return GRAPHS[session.run.method]


@cache
def result_type(stage: str) -> Any:
    """What a stage of that name leaves: the type, or the types where the methods differ."""
    types = dict.fromkeys(own.result for graph in GRAPHS.values() for own in graph if own.name == stage)
    if not types:
        raise ValueError(f"no method has a stage {stage}")
    return reduce(or_, types)


def with_method(session: Session, method: Method) -> Session:
    """The session to be solved by another method.

    What belongs to the old method alone goes: the settings of stages that both do differently, and the decisions
    among the old one's answers. Decisions on the grouping of markers stay.
    """
    if method == session.run.method:
        return session
    old, new = ({stage.name: stage.settings for stage in GRAPHS[m]} for m in (session.run.method, method))
    same = {name for name in old if new.get(name) is old[name]}
    akin = {
        name for name, own in old.items() if name in new and (issubclass(new[name], own) or issubclass(own, new[name]))
    }
    return replace(
        session,
        settings={name: table for name, table in session.settings.items() if name in same or name not in old},
        edits={name: table for name, table in session.edits.items() if name in akin or name not in old},
        run=replace(session.run, method=method),
    )


def spelt_out(session: Session, digests: Mapping[str, str]) -> Session:
    """The session with every setting and what its inputs hold; edits stay apart, so that they can be taken back.

    Parameters
    ----------
    digests : of the inputs, by name; one that is not known stays as the session has it
    """
    inputs = {name: replace(file, digest=digests.get(name, file.digest)) for name, file in session.inputs.items()}
    plain = replace(session, inputs=inputs, edits={}).stage_settings(graph_of(session))
    return replace(session, inputs=inputs).with_settings(plain)
