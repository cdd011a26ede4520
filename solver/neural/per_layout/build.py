"""Networks and their tasks for a layout, from a few choices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.neural.layout import Group, Layout
from markerscope.solver.neural.per_layout.heterogeneous import Heterogeneous, Sizes
from markerscope.solver.neural.per_layout.holden import Holden
from markerscope.solver.neural.per_layout.solving import FRAME_OF, JOINTS_OF, Network, Task, graph_of, means_of, members
from markerscope.solver.neural.training.examples import Sampler

Kind = Literal["heterogeneous", "holden"]


@dataclass(frozen=True)
class Choice:
    """Which network.

    Attributes
    ----------
    kind : of network
    sizes : of the heterogeneous one
    in_one_frame : whether its joints say how they are turned to the markers' frame, or to their parents
    width, blocks : of Holden's
    split : whether hands have networks of their own; without, one network solves all 24 joints (an ablation)
    batch : examples a step
    """

    kind: Kind = "heterogeneous"
    sizes: Sizes = field(default_factory=Sizes)
    in_one_frame: bool = True
    width: int = 2048
    blocks: int = 5
    split: bool = True
    batch: int = 256


def make_task(
    body: Body, layout: Layout, group: Group, sampler: Sampler, held_out: Sampler, choice: Choice | None = None
) -> Task:
    """What one network learns: the body's, or a hand's.

    Raises
    ------
    InputError : the layout has too few markers there
    """
    choice = choice or Choice()
    joints = JOINTS_OF[group] if choice.split else tuple(range(24))
    chosen = members(layout, group, choice.split)
    if len(chosen) < 3:
        raise InputError(f"has {len(chosen)} markers on the {group.replace('_', ' ')}", "the layout", "use 3 or more")
    graph = graph_of(body, layout, chosen, joints, sampler)
    rest = layout.rest(body)[chosen]
    task = Task(
        _Nothing(), joints, graph.parents, layout.select(chosen), chosen, layout, FRAME_OF[group], rest, sampler,
        held_out, batch=choice.batch,
    )  # fmt: skip
    means = means_of(task, graph)
    if choice.kind == "heterogeneous":
        rotations = means.world if choice.in_one_frame else means.rotations
        network: Network = Heterogeneous(
            graph, means.markers, rotations, means.offsets, means.spread, choice.sizes, choice.in_one_frame
        )
    else:
        network = Holden(graph.parents, means.markers, means.world, means.places, choice.width, choice.blocks)
    return replace(task, network=network)


def from_config(kind: str, said: Mapping[str, Any]) -> Network:
    """The network of a card."""
    if kind == "heterogeneous":
        return Heterogeneous.from_config(said)
    if kind == "holden":
        return Holden.from_config(said)
    raise InputError(f'a network of the kind "{kind}" is not known', "the weights", "use a newer Markerscope")


class _Nothing:
    """Stands where a task's network is not known yet."""

    kind = "none"

    def config(self) -> dict[str, Any]:
        """Nothing."""
        return {}

    def initial(self, seed: int) -> dict[str, Any]:
        """Nothing."""
        return {}

    def __call__(self, params: Any, markers: Any, visible: Any) -> Any:
        """Nothing."""
        raise TypeError("no network")
