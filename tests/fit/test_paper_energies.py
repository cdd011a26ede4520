"""The published method's terms against plain loops, its candidates against the counts of the tree, its descent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import Cancelled
from markerscope.solver.core.progress import silent
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import JOINTS, PARENTS
from markerscope.solver.fit.published.chains import candidate_chains
from markerscope.solver.fit.published.descent import minimise
from markerscope.solver.fit.published.energies import (
    marker_term,
    one_way_chamfer,
    pose_term,
    shape_term,
    two_way_chamfer,
)
from markerscope.solver.fit.published.localize import box_share
from markerscope.solver.fit.published.results import BodyState
from markerscope.solver.fit.published.rigid import RigidBody
from markerscope.solver.fit.published.sequence import (
    Sequence,
    chain_vertices,
    frames_at,
    mesh_vertices,
    sequence_of,
    turned_video,
)
from markerscope.solver.fit.published.settings import PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.published.solve import nearest_on_average
from markerscope.solver.fit.published.turns import about_vertical, from_six, to_six
from markerscope.solver.fit.state import Observations

torch = pytest.importorskip("torch")
FRAMES, MARKERS, SHAPES = 4, 5, 10
SOMEWHERE = (2.0, -1.0, 1.0)


@pytest.fixture(scope="module")
def sequence(free_body: Body) -> Sequence:
    """Random poses, and markers anywhere about them; some are lost, and the video loses the person once."""
    rng = np.random.default_rng(3)
    rotations = exp_so3(0.3 * rng.normal(size=(FRAMES, 24, 3)))
    markers = rng.normal(SOMEWHERE, 0.5, (FRAMES, MARKERS, 3))
    markers[0, 1] = markers[2, 3] = np.nan
    tracked = np.array([True, True, False, True])
    none = np.zeros((FRAMES, 0))
    seen = Observations(markers, rotations, tracked, none[..., None].repeat(2, -1), none, (0, 0))
    return sequence_of(free_body, seen, np.arange(FRAMES), np.arange(MARKERS), SHAPES, 0.3 * rng.normal(size=SHAPES))


def guess(sequence: Sequence, seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rotations, betas and trans near nothing in particular."""
    rng = np.random.default_rng(seed)
    rotations = exp_so3(0.4 * rng.normal(size=(FRAMES, 24, 3)))
    return rotations, rng.normal(size=SHAPES), rng.normal(SOMEWHERE, 0.3, (FRAMES, 3))


def posed(sequence: Sequence, state: tuple[np.ndarray, np.ndarray, np.ndarray], vertices: np.ndarray) -> np.ndarray:
    placed: np.ndarray = sequence.body.pose(*state, vertices)[0]
    return placed


def nearest_squares(sequence: Sequence, points: np.ndarray) -> list[float]:
    markers, seen = sequence.markers.numpy(), sequence.seen.numpy()
    return [
        min(float(((p - markers[t, m]) ** 2).sum()) for p in points[t])
        for t in range(FRAMES)
        for m in range(MARKERS)
        if seen[t, m]
    ]


def test_one_way_chamfer_is_the_mean_over_seen_markers_of_the_nearest_square(sequence: Sequence) -> None:
    vertices = mesh_vertices(sequence.body, "coarse")[::20]
    state = guess(sequence)
    value = float(one_way_chamfer(sequence, *map(torch.as_tensor, (*state, vertices))))
    expected = np.mean(nearest_squares(sequence, posed(sequence, state, vertices)))
    assert value == pytest.approx(expected, rel=1e-6)


def test_its_derivatives_are_those_of_its_value(sequence: Sequence) -> None:
    vertices = torch.as_tensor(mesh_vertices(sequence.body, "coarse")[::20])
    state = [torch.as_tensor(value).requires_grad_() for value in guess(sequence)]
    one_way_chamfer(sequence, *state, vertices).backward()
    rng = np.random.default_rng(5)
    for i, value in enumerate(state):
        way = torch.as_tensor(rng.normal(size=tuple(value.shape)))
        ends = []
        for step in (1e-5, -1e-5):
            moved = [v.detach() + (step * way if k == i else 0) for k, v in enumerate(state)]
            ends.append(float(one_way_chamfer(sequence, *moved, vertices)))
        assert float((value.grad * way).sum()) == pytest.approx((ends[0] - ends[1]) / 2e-5, rel=1e-4)


def test_two_way_chamfer_adds_the_mean_over_vertices_of_the_nearest_marker(sequence: Sequence) -> None:
    vertices = mesh_vertices(sequence.body, "coarse")[::40]
    points = posed(sequence, guess(sequence), vertices)
    both, one = two_way_chamfer(torch.as_tensor(points), sequence.markers, sequence.seen)
    markers, seen = sequence.markers.numpy(), sequence.seen.numpy()
    back = [min(((p - m) ** 2).sum() for m in markers[t][seen[t]]) for t in range(FRAMES) for p in points[t]]
    assert one == pytest.approx(np.mean(nearest_squares(sequence, points)))
    assert both == pytest.approx(one + np.mean(back))


def test_the_rigid_body_is_the_videos_pose_turned_shifted_and_shaped(sequence: Sequence) -> None:
    vertices = chain_vertices(sequence.body, mesh_vertices(sequence.body, "coarse"), np.array([1, 4]))
    assert set(sequence.body.weights[vertices].argmax(1)) == {1, 4}
    _, betas, trans = guess(sequence, 1)
    yaw = 0.7
    turned = turned_video(sequence.rotations.numpy(), np.degrees(yaw))
    points = posed(sequence, (turned, betas, trans), vertices)
    rigid = RigidBody.of(sequence, vertices)
    given = torch.tensor([yaw], dtype=torch.float64), torch.as_tensor(trans), torch.as_tensor(betas)
    expected = np.mean(nearest_squares(sequence, points))
    assert float(rigid.one_way(*given)) == pytest.approx(expected, rel=1e-5)
    both, one = two_way_chamfer(torch.as_tensor(points), sequence.markers, sequence.seen)
    assert rigid.two_way(*given) == pytest.approx((both, one), rel=1e-5)


def test_the_terms_are_plain_means(sequence: Sequence) -> None:
    rng = np.random.default_rng(9)
    betas, other = rng.normal(size=(2, SHAPES))
    assert float(shape_term(*map(torch.as_tensor, (betas, other)))) == pytest.approx(
        sum((a - b) ** 2 for a, b in zip(betas, other, strict=True)) / SHAPES
    )
    one, two = exp_so3(rng.normal(size=(2, FRAMES, 24, 3)))
    expected = sum(((one[t, j] - two[t, j]) ** 2).sum() for t in range(FRAMES) for j in range(1, 24))
    assert float(pose_term(*map(torch.as_tensor, (one, two)))) == pytest.approx(expected / (FRAMES * 23 * 9))
    points = rng.normal(size=(FRAMES, MARKERS, 3))
    markers, seen = sequence.markers.numpy(), sequence.seen.numpy()
    gaps = [
        (np.linalg.norm(points[t, m] - markers[t, m]) - 0.0095) ** 2
        for t in range(FRAMES)
        for m in range(MARKERS)
        if seen[t, m]
    ]
    found = marker_term(torch.as_tensor(points), sequence.markers, sequence.seen, 0.0095)
    assert float(found) == pytest.approx(np.mean(gaps))


def test_ten_degrees_on_every_joint_cost_stage_4_as_much_as_26_mm_on_every_marker() -> None:
    still = np.broadcast_to(np.eye(3), (1, 24, 3, 3)).copy()
    bent = still @ exp_so3(np.broadcast_to([np.radians(10), 0, 0], (1, 24, 3)).copy())
    cost = PaperSolveSettings().marker_pose * float(pose_term(torch.as_tensor(bent), torch.as_tensor(still)))
    assert np.sqrt(cost) == pytest.approx(0.026, abs=5e-4)


def test_a_marker_gets_the_vertex_nearest_on_average_while_the_video_is_tracked(sequence: Sequence) -> None:
    among = mesh_vertices(sequence.body, "coarse")[::10]
    state = guess(sequence, 2)
    markers, seen = sequence.markers.numpy().copy(), sequence.seen.numpy().copy()
    seen[:, 4] = [False, False, True, False]  # only while the video has lost the person
    changed = replace(sequence, seen=torch.as_tensor(seen))
    found = nearest_on_average(changed, BodyState(state[0], state[2], state[1]), among)
    points = posed(sequence, state, among)
    tracked = sequence.tracked.numpy()
    for m in range(MARKERS):
        frames = [t for t in range(FRAMES) if seen[t, m] and (tracked[t] or m == 4)]
        mean = [np.mean([np.linalg.norm(points[t, v] - markers[t, m]) for t in frames]) for v in range(len(among))]
        assert found[m] == among[int(np.argmin(mean))]


def test_the_box_is_compared_frame_by_frame(sequence: Sequence) -> None:
    vertices = mesh_vertices(sequence.body, "coarse")
    points = posed(sequence, (sequence.rotations.numpy(), np.zeros(1), np.zeros((FRAMES, 3))), vertices)
    markers, seen = sequence.markers.numpy(), sequence.seen.numpy()
    shares = sorted(np.prod(np.ptp(markers[t][seen[t]], axis=0)) / np.prod(np.ptp(points[t], axis=0)) for t in range(4))
    found = box_share(sequence, vertices)
    assert shares[1] * (1 - 1e-5) <= found <= shares[2] * (1 + 1e-5), f"{found} of {shares}"


@pytest.mark.parametrize(("bones", "chains"), [(1, 24), (3, 26), (8, 120), (14, 324), (20, 65), (24, 1), (30, 1)])
def test_chains_are_the_connected_subtrees(bones: int, chains: int) -> None:
    size = min(bones, 24)
    count, kept = candidate_chains(bones)
    assert count == chains
    for chain in kept:
        assert len(chain) == size
        assert sum(int(PARENTS[j]) not in chain for j in chain) == 1, "one bone alone has its parent outside"


@pytest.mark.parametrize("bones", [6, 11, 14, 21])
def test_chains_that_nearly_repeat_another_are_left_out(bones: int) -> None:
    from markerscope.solver.core.skeleton import subtrees

    _, kept = candidate_chains(bones, 0.9)
    shared = max((len(a & b) for i, a in enumerate(kept) for b in kept[:i]), default=0)
    assert shared <= 0.9 * bones
    assert all(any(chain == k or len(chain & k) > 0.9 * bones for k in kept) for chain in subtrees(bones))
    assert (len(kept) == len(subtrees(bones))) == (bones <= 10), "one bone of ten is ten per cent"


def test_six_numbers_hold_a_rotation() -> None:
    turns = torch.as_tensor(exp_so3(np.random.default_rng(1).normal(size=(7, 2, 3))))
    assert torch.allclose(from_six(to_six(turns)), turns, atol=1e-12)
    loose = from_six(torch.as_tensor(np.random.default_rng(2).normal(size=(9, 3, 2))))
    assert torch.allclose(loose @ loose.transpose(1, 2), torch.eye(3, dtype=torch.float64).expand(9, 3, 3), atol=1e-12)
    assert torch.allclose(torch.linalg.det(loose), torch.ones(9, dtype=torch.float64))
    assert np.allclose(about_vertical(torch.tensor([0.4])).numpy()[0], exp_so3(np.array([0, 0, 0.4])), atol=1e-6)


def test_frames_are_some_30_a_second() -> None:
    assert np.array_equal(frames_at(np.arange(100) / 30, 30), np.arange(100))
    assert np.array_equal(frames_at(5 + np.arange(100) / 25, 30), np.arange(100))
    frames = frames_at(2.5 + np.arange(1000) / 100, 30)
    assert np.array_equal(frames[:7], [0, 3, 7, 10, 13, 17, 20])
    assert frames[-1] == 999
    assert np.diff(frames).max() <= 4
    assert np.array_equal(frames_at(np.array([1.0]), 30), [0])


def descent(iterations: int, progress=silent):
    """The least of a stretched bowl, whose bottom is at 1..6."""
    x = torch.zeros(6, dtype=torch.float64, requires_grad=True)
    bottom, slope = torch.arange(1.0, 7.0, dtype=torch.float64), torch.logspace(0, 2, 6, dtype=torch.float64)
    still = BodyState(np.broadcast_to(np.eye(3), (2, 24, 3, 3)), np.zeros((2, 3)), np.zeros(1))
    ended = minimise(
        lambda: {"bowl": (slope * (x - bottom).square()).sum(), "floor": 0 * x.sum() + 2.0},
        [x],
        lambda: replace(still, betas=x.detach().numpy().copy()),
        lr=1.0,
        iterations=iterations,
        progress=progress,
        text="rolling",
    )
    return ended, x.detach().numpy()


def test_descent_ends_at_the_bottom_and_says_so() -> None:
    ended, x = descent(500)
    assert np.allclose(x, np.arange(1, 7), atol=1e-3)
    assert ended.converged
    assert ended.iterations < 100
    assert ended.energy == pytest.approx(2.0, abs=1e-4)
    assert set(ended.energies) == {"bowl", "floor"}


@pytest.mark.parametrize("cap", [1, 2, 3, 5, 6])
def test_the_cap_is_kept_and_the_trace_shows_the_way(cap: int) -> None:
    ended, x = descent(cap)
    assert ended.iterations == cap
    assert not ended.converged
    trace = ended.trace
    assert trace.iteration.tolist() == sorted({0, *(n for n in (1, 2, 4) if n < cap), cap})
    assert (np.diff(trace.energy) < 0).all()
    assert trace.energy[-1] == ended.energy
    assert np.array_equal(trace.betas[0], np.zeros(6))
    assert np.array_equal(trace.betas[-1], x)


def test_stopping_on_the_way_changes_nothing() -> None:
    """The trace's stops must not make L-BFGS forget: a single uninterrupted run ends at the same place."""
    _, x = descent(6)
    y = torch.zeros(6, dtype=torch.float64, requires_grad=True)
    bottom, slope = torch.arange(1.0, 7.0, dtype=torch.float64), torch.logspace(0, 2, 6, dtype=torch.float64)
    optimizer = torch.optim.LBFGS([y], lr=1.0, max_iter=6, max_eval=10**6, line_search_fn="strong_wolfe")

    def closure():
        optimizer.zero_grad()
        value = (slope * (y - bottom).square()).sum()
        value.backward()
        return value

    optimizer.step(closure)
    assert np.allclose(x, y.detach().numpy(), atol=1e-9)


def test_descent_can_be_cancelled_between_evaluations() -> None:
    asked = []

    def progress(fraction: float, text: str) -> None:
        asked.append((fraction, text))
        if len(asked) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        descent(500, progress)
    assert len(asked) == 3
    assert asked[0] == (0.0, "rolling")


@pytest.mark.parametrize("wrong", [{"iterations": 0}, {"betas": 0}])
def test_settings_that_cannot_be_meant_are_refused(wrong: dict[str, int]) -> None:
    for settings in (PaperLocalizeSettings, PaperSolveSettings):
        with pytest.raises(ValueError, match="has to be above 0"):
            settings(**wrong)


def test_every_bone_has_vertices_to_be_near_to(free_body: Body) -> None:
    vertices = mesh_vertices(free_body, "coarse")
    without = [JOINTS[j] for j in range(24) if not len(chain_vertices(free_body, vertices, np.array([j])))]
    assert not without
    assert len(mesh_vertices(free_body, "full")) == len(free_body.template)
