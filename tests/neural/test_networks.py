"""Networks hear whom their graph says, say rotations that are ones, and can learn a batch by heart."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.graph import Graph, build_graph, distance_deviation, nearest
from markerscope.solver.neural.layers import EdgeConvolution, Params
from markerscope.solver.neural.layout import Layout, named_layout
from markerscope.solver.neural.per_layout.build import Choice, from_config, make_task
from markerscope.solver.neural.per_layout.heterogeneous import Sizes
from markerscope.solver.neural.per_layout.holden import placed
from markerscope.solver.neural.per_layout.named import (
    groups_of,
    load_solver,
    save_solver,
    shape_of,
    solve,
    train_solver,
)
from markerscope.solver.neural.per_layout.solving import JOINTS_OF, Task, members
from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator
from markerscope.solver.neural.training.library import procedural_clips
from markerscope.solver.neural.training.train import TrainSettings, train
from markerscope.solver.neural.weights import Card

torch = pytest.importorskip("torch", reason="torch is not installed here")

SMALL = Sizes(linked=(12, 12, 12), wide=48, deep=1, joints=(12, 12))
CARD = Card("", {}, "", (), ("made",), {}, 0, 1, 1.0)


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def sampler(body: Body) -> Sampler:
    return Sampler(procedural_clips(4, 0, seconds=2.0), body_pool(body, 2, 0), ExampleSettings(fingers=True))


@pytest.fixture(scope="module")
def layout(body: Body) -> Layout:
    return named_layout(body, "full_body")


@pytest.fixture(scope="module")
def task(body: Body, layout: Layout, sampler: Sampler) -> Task:
    task = make_task(body, layout, "body", sampler, sampler, Choice(sizes=SMALL, batch=16))
    return replace(task, windows=4, window=8)


def test_neighbours_are_the_markers_of_the_same_rigid_piece() -> None:
    rng = np.random.default_rng(0)
    piece = np.repeat([0, 1, 2], 4)
    shape = rng.normal(0, 0.1, (12, 3))
    turns = exp_so3(rng.normal(0, 1, (50, 3, 3)))
    places = rng.normal(0, 1, (50, 3, 3))
    moved = np.einsum("tmab,mb->tma", turns[:, piece], shape) + places[:, piece]
    moved += rng.normal(0, 1e-4, moved.shape)
    for m, row in enumerate(nearest(distance_deviation(moved), 3)):
        assert row[0] == m and {piece[k] for k in row} == {piece[m]}, (m, row)


def test_the_graph_of_a_layout_links_what_is_near(body: Body, task: Task, layout: Layout) -> None:
    graph: Graph = task.network.graph  # type: ignore[attr-defined]
    assert graph.joints == tuple(range(22)) and graph.parents[0] == -1
    assert all(len(row) == 4 for row in graph.marker_marker)
    rest, joints = task.rest, body.joints(np.zeros(body.shape_count))
    for j, row in enumerate(graph.joint_marker):
        apart = np.linalg.norm(rest - joints[j], axis=1)
        assert set(row) >= set(np.flatnonzero(apart < 0.2)) and int(apart.argmin()) in row
        assert all(j in graph.marker_joint[m] for m in row)
    knee = INDEX["left_knee"]
    assert set(graph.joint_joint[knee]) == {knee, INDEX["left_hip"], INDEX["left_ankle"]}
    assert Graph.from_plain(json.loads(json.dumps(graph.plain()))) == graph
    # A joint far from all markers still hears the nearest, and no joint but the first lacks a parent.
    alone = build_graph(np.random.default_rng(0).normal(size=(9, 3, 3)), rest[:3], joints, tuple(range(24)))
    assert all(alone.joint_marker) and all(alone.marker_joint) and min(alone.parents[1:]) >= 0


def test_a_convolution_has_a_filter_for_every_edge_and_none_elsewhere() -> None:
    links = ((0, 2), (1,), (2, 0, 1))
    layer, params = EdgeConvolution(links, 2, 3), Params()
    layer.new(params, "a", generator(0))
    x = torch.randn(3, 5, 2, requires_grad=True)
    found = layer(params, "a", x)
    for i, row in enumerate(links):
        wanted = sum(x[j] @ params["a.w"][i, 2 * k : 2 * k + 2] for k, j in enumerate(row))
        assert torch.allclose(found[i], wanted, atol=1e-6)
    found[1].sum().backward()
    assert x.grad is not None and x.grad[[0, 2]].abs().max() == 0 < x.grad[1].abs().max()


@pytest.mark.parametrize(
    "choice",
    [
        Choice(sizes=SMALL),
        Choice(sizes=replace(SMALL, marker_convolution=False)),
        Choice(sizes=SMALL, in_one_frame=False),
        Choice(kind="holden", width=32, blocks=2),
    ],
)
def test_what_is_said_are_rotations_and_every_number_is_learnt(
    body: Body, layout: Layout, sampler: Sampler, choice: Choice
) -> None:
    task = make_task(body, layout, "body", sampler, sampler, replace(choice, batch=8))
    network = from_config(task.network.kind, json.loads(json.dumps(task.network.config())))
    params = {name: value.requires_grad_(True) for name, value in task.network.initial(1).items()}
    local, _ = task.given(sampler.draw(layout, 6, generator(0)))
    said = task.network(params, local, torch.ones(6, len(layout)))
    assert said.rotations.shape == (6, 22, 3, 3) and said.offsets.shape == (6, 22, 3)
    unit = said.rotations.transpose(-1, -2) @ said.rotations
    assert (unit - torch.eye(3)).abs().max() < 1e-5 and (torch.linalg.det(said.rotations) > 0.99).all()
    assert torch.equal(network(params, local, torch.ones(6, len(layout))).offsets, said.offsets)
    sum(task.loss(params, generator(3)).values()).backward()  # type: ignore[union-attr]
    silent = {name for name, value in params.items() if value.grad is None or not torch.isfinite(value.grad).all()}
    assert silent <= {"linked2.m.b"}, silent  # what markers are after the last layer, nobody hears
    assert all(value.grad is None or value.grad.abs().max() > 0 for value in params.values())


def test_the_target_is_what_forward_kinematics_needs(task: Task, sampler: Sampler, layout: Layout) -> None:
    local, target = task.given(sampler.draw(layout, 5, generator(0)))
    _, places = kinematics.forward(target.rotations, target.offsets, task.parents)
    assert (places - target.places).abs().max() < 1e-4
    assert local.shape == (5, 47, 3) and target.places[:, 0].norm(dim=-1).max() < 0.3
    perfect = replace(task, network=_Knowing(target))
    figures = perfect.figures({}, local, torch.ones(5, 47), target, 1)
    assert figures["joe"] < 0.05 and figures["jpe"] < 0.05, figures


class _Knowing:
    """Says what it was told."""

    kind = "knowing"

    def __init__(self, target: object) -> None:
        self._target = target

    def __call__(self, params: object, markers: object, visible: object) -> object:
        return self._target


def test_places_and_axes_in_one_frame_become_a_skeleton() -> None:
    local = torch.as_tensor(exp_so3(np.random.default_rng(0).normal(0, 1, (3, 24, 3))))
    bones = torch.randn(3, 24, 3, dtype=torch.float64)
    world, places = kinematics.forward(local, bones)
    found = placed(world, places, kinematics.SMPL)
    assert (found.rotations - local).abs().max() < 1e-12 and (found.offsets - bones).abs().max() < 1e-12


def test_a_network_learns_a_batch_by_heart(task: Task, sampler: Sampler, layout: Layout) -> None:
    local, target = task.given(sampler.draw(layout, 4, generator(0)))
    visible = torch.ones(4, len(layout))
    network, parents = task.network, task.parents

    def loss(params: Params, random: torch.Generator) -> dict[str, torch.Tensor]:
        said = network(params, local, visible)
        _, places = kinematics.forward(said.rotations, said.offsets, parents)
        return {
            "rotations": (said.rotations - target.rotations).square().sum((2, 3)).mean(),
            "positions": 30 * (places - target.places).square().sum(2).mean(),
        }

    def judge(params: Params) -> dict[str, float]:
        return task.figures(params, local, visible, target, 1)

    settings = TrainSettings(steps=80, seconds=None, rate=2e-2, warm=5, average=0.8, check=80, patience=None)
    found = train(network.initial(0), loss, judge, settings)
    assert found.figures["joe"] < 4.0 and found.figures["jpe"] < 1.5, found.figures


def test_hands_have_networks_where_fingers_have_markers(body: Body, layout: Layout, sampler: Sampler) -> None:
    hands = named_layout(body, "body_hands")
    assert groups_of(layout) == ("body",) and groups_of(hands) == ("body", "left_hand", "right_hand")
    assert groups_of(hands, split=False) == ("body",)
    assert len(members(hands, "body")) == 55 and len(members(hands, "body", split=False)) == 63
    labels = [hands.labels[i] for i in members(hands, "left_hand")]
    assert len(labels) == 9 and all(label.startswith("left_") for label in labels), labels
    task = make_task(body, hands, "left_hand", sampler, sampler, Choice(sizes=SMALL, batch=8))
    assert task.joints == JOINTS_OF["left_hand"] == (20, 22)
    local, target = task.given(sampler.draw(hands, 30, generator(0)))
    assert target.rotations.shape == (30, 2, 3, 3)
    assert np.abs(local.numpy() - task.rest).max() < 0.3, "seen from the wrist, a forearm stays where it is"
    assert (target.rotations[:, 1, 0, 0] < 0.9).any(), "fingers curl"
    whole = make_task(body, hands, "body", sampler, sampler, Choice(sizes=SMALL, split=False))
    assert len(whole.joints) == 24


def test_a_solver_is_trained_kept_and_used(body: Body, sampler: Sampler, tmp_path: Path) -> None:
    layout = named_layout(body, "body_hands")
    settings = TrainSettings(steps=10, seconds=None, check=10)
    solver, found = train_solver(body, layout, (sampler, sampler), Choice(sizes=SMALL, batch=8), settings)
    assert {group: one.steps for group, one in found.items()} == {"body": 8, "left_hand": 1, "right_hand": 1}
    file = tmp_path / "net.safetensors"
    save_solver(file, solver, CARD)
    again, card = load_solver(file, layout)
    assert card.network == "solver" and card.layout == layout.digest and card.labels == layout.labels
    drawn = sampler.draw(layout, 1, generator(0), window=70)
    positions = drawn.markers.numpy().astype(float)
    positions[10:20, 5] = np.nan
    one, other = (solve(s, positions, 60.0, body) for s in (solver, again))
    assert np.array_equal(one.rotations, other.rotations) and one.filled[10:20, 5].all()
    # Bones keep their length, and the joints are where kinematics has them.
    length = np.linalg.norm(one.joints[:, 7] - one.joints[:, 4], axis=1)
    assert np.ptp(length) < 1e-5 and np.isclose(length[0], np.linalg.norm(one.bones[7]), atol=1e-5)
    # Turned and moved markers are solved as the same pose, turned and moved.
    turn, shift = exp_so3(np.array([0.3, 1.0, -0.5])), np.array([1.0, 2.0, 0.5])
    moved = solve(solver, positions @ turn.T + shift, 60.0, body)
    assert np.abs(moved.joints - (one.joints @ turn.T + shift)).max() < 1e-3
    with pytest.raises(InputError, match="another layout"):
        load_solver(file, named_layout(body, "full_body"))
    with pytest.raises(InputError, match="fewer than"):
        solve(solver, positions[:, :5], 60.0, body)


def test_the_shape_whose_bones_are_given_is_found(body: Body) -> None:
    grown = with_bone_lengths(body)
    betas = np.random.default_rng(0).normal(0, 0.7, grown.shape_count)
    joints = grown.joints(betas)
    bones = joints - joints[np.maximum(np.array(kinematics.SMPL), 0)]
    found = grown.joints(shape_of(grown, bones, noise_m=1e-4))
    off = np.linalg.norm((found - found[0]) - (joints - joints[0]), axis=1).max()
    assert off < 2e-3, f"{1000 * off:.1f} mm"
