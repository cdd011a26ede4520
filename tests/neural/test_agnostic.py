"""The network that takes any markers: what must not matter to it does not, and it learns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.neural.layout_free import agnostic_solve
from markerscope.solver.neural.layout_free.agnostic import Agnostic, AgnosticSettings, Frames
from markerscope.solver.neural.layout_free.agnostic_align import align_to_rest
from markerscope.solver.neural.layout_free.agnostic_examples import CLEAN, Spoiling, Task, any_layout, told
from markerscope.solver.neural.layout_free.agnostic_layouts import Skin
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Ready, solve_frames
from markerscope.solver.neural.layout_free.agnostic_trust import blended, expected_errors
from markerscope.solver.neural.layout_free.pretrain import judged_on, objective
from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator
from markerscope.solver.neural.training.library import procedural_clips
from markerscope.solver.neural.training.train import TrainSettings, train
from markerscope.solver.neural.weights import Card

torch = pytest.importorskip("torch", reason="networks need torch")

SMALL = AgnosticSettings(message=8, bone=8, width=48, blocks=1, mend_width=32, mends=2)


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def skin(body: Body) -> Skin:
    return Skin.of(body)


@pytest.fixture(scope="module")
def draw(body: Body, skin: Skin) -> Callable[..., Task]:
    sampler = Sampler(procedural_clips(4, 3), body_pool(body, 2, 3), ExampleSettings())

    def drawn(count: int, seed: int, spoiling: Spoiling = CLEAN, parts: float = 0.0) -> Task:
        return any_layout(sampler, skin, count, generator(seed), spoiling, parts)

    return drawn


@pytest.fixture(scope="module")
def ready() -> Ready:
    network = Agnostic(SMALL)
    card = Card("agnostic", {"sizes": asdict(SMALL)}, "", (), (), {}, 0, 0, 0.0)
    return Ready(network, network.initial(0), card)


def answer(ready: Ready, frames: Frames) -> tuple[np.ndarray, np.ndarray]:
    with torch.no_grad():
        last = ready.network(ready.params, frames)[-1]
    return last.local.numpy(), last.root.numpy()


def taken(frames: Frames, order: np.ndarray) -> Frames:
    """The same frames with their markers in another order, or some of them alone."""
    index = torch.as_tensor(order)
    changed = {name: getattr(frames, name)[:, index] for name in ("markers", "seen", "rest", "weights")}
    return replace(frames, **changed)


def test_the_order_of_markers_does_not_matter(ready: Ready, draw: Callable[..., Task]) -> None:
    frames = draw(8, 1).frames
    order = np.random.default_rng(0).permutation(frames.markers.shape[1])
    one, other = answer(ready, frames), answer(ready, taken(frames, order))
    off = max(float(np.abs(a - b).max()) for a, b in zip(one, other))
    assert off < 1e-4, off


def test_a_lost_marker_is_as_none_at_all(ready: Ready, draw: Callable[..., Task]) -> None:
    frames = draw(6, 2).frames
    count = frames.markers.shape[1]
    lost = np.random.default_rng(1).choice(count, 7, replace=False)
    seen = frames.seen.clone()
    seen[:, lost] = 0
    markers = frames.markers.clone()
    markers[:, lost] = 0
    one = answer(ready, replace(frames, seen=seen, markers=markers))
    other = answer(ready, taken(frames, np.setdiff1d(np.arange(count), lost)))
    off = max(float(np.abs(a - b).max()) for a, b in zip(one, other))
    assert off < 1e-4, off


@pytest.mark.parametrize("count", [3, 17, 40, 90])
def test_any_number_of_markers_gives_a_pose(ready: Ready, body: Body, skin: Skin, count: int) -> None:
    rng = np.random.default_rng(count)
    vertex = rng.choice(skin.vertex, count)
    plain = np.zeros(body.shape_count)
    person = Marked(body.surface(plain)[vertex], body.weights[vertex], body.joints(plain))
    markers = person.rest + 0.01 * rng.normal(size=(5, count, 3))
    markers[2] = np.nan
    found = solve_frames(ready, markers, person)
    identity = np.swapaxes(found.rotations, -1, -2) @ found.rotations
    assert np.allclose(identity, np.eye(3), atol=1e-5) and np.isfinite(found.trans).all()
    assert found.seen.tolist() == [True, True, False, True, True]


def test_a_lab_that_is_turned_and_moved_turns_and_moves_the_answer_alone(
    ready: Ready, body: Body, draw: Callable[..., Task]
) -> None:
    frames = draw(1, 4).frames
    person = Marked(*(array[0].numpy().astype(float) for array in (frames.rest, frames.weights, frames.joints)))
    rng = np.random.default_rng(4)
    markers = person.rest + 0.05 * rng.normal(size=(6, *person.rest.shape))
    markers[0, :9] = np.nan
    turn, move = exp_so3(rng.normal(size=3) * 2), rng.normal(size=3)
    one, other = solve_frames(ready, markers, person), solve_frames(ready, markers @ turn.T + move, person)
    assert np.allclose(turn @ one.rotations[:, 0], other.rotations[:, 0], atol=2e-4)
    assert np.allclose(one.rotations[:, 1:], other.rotations[:, 1:], atol=2e-4)
    root = one.trans + person.joints[0]
    off = np.abs(root @ turn.T + move - (other.trans + person.joints[0])).max()
    assert off < 2e-4, off


def test_the_aligned_frame_is_the_resting_bodys_where_it_is_turned_whole(body: Body, skin: Skin) -> None:
    rng = np.random.default_rng(5)
    for bones in ("whole", "left leg"):
        own = np.isin(skin.owner, [1, 4, 7]) if bones == "left leg" else np.ones(len(skin.vertex), dtype=bool)
        vertex = rng.choice(skin.vertex[own], 12)
        rest = body.surface(np.zeros(body.shape_count))[vertex]
        turn, move = exp_so3(rng.normal(size=(4, 3))), rng.normal(size=(4, 3))
        aligned, R, t = align_to_rest(rest @ np.swapaxes(turn, 1, 2) + move[:, None], rest, body.weights[vertex])
        assert np.allclose(R, turn, atol=1e-6) and np.allclose(t, move, atol=1e-6), bones
        assert np.allclose(aligned, rest, atol=1e-6), bones


def test_examples_say_truly_where_joints_and_markers_are(draw: Callable[..., Task]) -> None:
    task = draw(16, 6)
    bones = task.frames.joints
    turn, place = chain(task.local.numpy()[:1].astype(float), bones[0].numpy().astype(float), np.zeros((1, 3)))
    shifted = place - place[:, :1] + task.place[:1, :1].numpy()
    assert np.allclose(turn, task.turn[:1].numpy(), atol=1e-5)
    assert np.allclose(shifted, task.place[:1].numpy(), atol=1e-4)
    seen = task.frames.seen.numpy() > 0
    off = np.linalg.norm(task.frames.markers.numpy() - task.markers.numpy(), axis=2)[seen]
    assert off.mean() < 2e-3, f"clean markers are off by {1000 * off.mean():.2f} mm"


def test_joints_count_where_markers_tell_of_them(draw: Callable[..., Task]) -> None:
    whole, limb = draw(32, 7), draw(32, 7, parts=1.0)
    assert (told(whole.frames)[1] == 1).float().mean() > 0.9
    assert (told(limb.frames)[1] == 1).float().mean() < 0.5


def test_one_batch_is_learnt_by_heart(draw: Callable[..., Task]) -> None:
    task = draw(12, 8)
    network = Agnostic(SMALL)
    training = TrainSettings(steps=150, seconds=None, rate=4e-3, warm=10, average=0.8, check=150, patience=None)
    judge = judged_on(network, [task])
    start = network.initial(0)
    before = judge(start)
    found = train(start, objective(network, lambda numbers: task), judge, training)
    after = found.figures
    assert after["joe_deg"] < 0.35 * before["joe_deg"] and after["jpe_cm"] < 0.25 * before["jpe_cm"], (before, after)


def test_two_poses_are_put_together_by_how_far_each_can_be_trusted() -> None:
    rng = np.random.default_rng(9)
    other = exp_so3(0.4 * rng.normal(size=(3, 24, 3)))
    apart = 0.2 * rng.normal(size=(3, 24, 3))
    network = other @ exp_so3(apart)
    errors = np.zeros((24, 3, 3))
    errors[1] = np.eye(3) * 1e6  # knows nothing
    errors[2] = np.diag([0, 1e6, np.radians(4) ** 2])  # its first axis surely, its second not at all, its third as well
    found = blended(network, other, errors, 4.0)
    assert np.allclose(found.rotations[:, 0], network[:, 0]) and np.isclose(found.share[0], 1)
    assert np.allclose(found.rotations[:, 1], other[:, 1], atol=1e-6) and found.share[1] < 1e-6
    wanted = other[:, 2] @ exp_so3(apart[:, 2] * [1, 0, 0.5])
    assert np.allclose(found.rotations[:, 2], wanted, atol=1e-6)
    assert np.isclose(found.spread_deg[1], 4.0, atol=1e-3) and found.spread_deg[0] < 1e-6


def test_what_no_marker_tells_of_is_known_to_be_uncertain(body: Body, skin: Skin) -> None:
    arm = np.isin(skin.owner, [INDEX["right_elbow"], INDEX["right_wrist"], INDEX["right_hand"]])
    there = np.flatnonzero(~arm)
    vertex = skin.vertex[there[np.linspace(0, len(there) - 1, 60).astype(int)]]
    plain = np.zeros(body.shape_count)
    skin_at = body.surface(plain)[vertex] + 0.0095 * body.normals(plain)[vertex]
    person = Marked(skin_at, body.weights[vertex], body.joints(plain))
    errors = np.sqrt(np.trace(expected_errors(agnostic_solve.load(), body, person), axis1=1, axis2=2))
    left, right = errors[INDEX["left_elbow"]], errors[INDEX["right_elbow"]]
    assert right > 2 * left, np.degrees([left, right])
