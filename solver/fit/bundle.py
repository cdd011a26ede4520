"""The default method: joint bundle adjustment of pose, shape, marker placement and camera.

Every hypothesis of where the markers sit is relaxed on a few keyframes; the best few go on with their markers free to
slide to their true places, first coarsely, then finely; the least total energy wins, and its margin over the next
different answer is the confidence.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.parallel import spread
from markerscope.solver.core.progress import Found, Progress, silent, tell
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.fit.confidence import alike
from markerscope.solver.fit.kinematics import Points, Pose, blended_turn, forward, place_points
from markerscope.solver.fit.localize import Hypothesis
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.refine import carried_over
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights
from markerscope.solver.fit.terms.term import Energies

_SAME_ENERGY = 1.03
_SAME_TURN = np.radians(3.0)
_ENOUGH = 1e-3
"""A phase ends when a step gains less than this share of the energy."""

_SHOWN = 12
"""Hypotheses that were left behind and are kept to be looked at."""
_SETTLED, _MOST_ROUNDS = 0.95, 4
"""Further rounds of choosing places end when one leaves more than this share of the energy."""


@dataclass(frozen=True)
class Phase:
    """One stretch of the descent: how coarse markers are taken, whether they choose a new place first, how many steps.

    While markers sit on whole vertices their errors are the same in every frame, so the video's pose must hold against
    them: ``prior`` scales its spread.
    """

    marker: float
    kernel: float
    steps: int
    reassign: bool = False
    free_placement: bool = False
    free_shape: bool = True
    prior: float = 1.0


@dataclass(frozen=True)
class Round:
    """One phase for a whole pool of hypotheses, and who goes on from it.

    Attributes
    ----------
    phase : the descent of each
    doubt : n markers tell answers apart whose costs differ by this over the root of n, as a share; nearer ones go on
    most : so many at most
    """

    phase: Phase
    doubt: float
    most: int


_PLACED = Phase(0.02, 0.08, 3, reassign=True, free_placement=True)
SEARCH = (
    Round(Phase(0.04, 0.16, 3, free_shape=False, prior=0.5), 2.8, 96),
    Round(Phase(0.03, 0.12, 3, reassign=True, prior=0.5), 2.8, 48),
    Round(Phase(0.025, 0.10, 3, reassign=True, prior=0.5), 2.8, 32),
    Round(_PLACED, 1.7, 24),
    Round(_PLACED, 1.5, 20),
    Round(_PLACED, 1.3, 16),
    Round(_PLACED, 1.2, 16),
)
"""On few keyframes: poor starts are dropped early, more of them the clearer it is which are poor."""
_TRIED, _NEAR_RIVAL = 3, 1.3
_CATCH_UP = (SEARCH[2].phase, _PLACED, _PLACED)
"""Answers left behind that are followed to see how far behind the best different one is, and how; one that turns out to
be as near as this is refined like the others."""
FINE = (
    Phase(0.015, 0.06, 4, reassign=True, free_placement=True),
    Phase(0.01, 0.04, 6, free_placement=True),
)
"""On many keyframes."""


@dataclass(frozen=True)
class Fit:
    """A hypothesis after relaxation.

    Attributes
    ----------
    start : the hypothesis it began as
    state : pose of the keyframes, marker placement, camera
    surface : the skin below each marker
    energies : its cost by kind of evidence, per frame
    trace : total energy after every step
    poses : after every step, of the keyframes that it was solved on then
    refined : True once it was solved on all keyframes
    behind : times the best answer's energy, on few keyframes, once it was left behind; NaN where that is not known
    """

    start: Hypothesis
    state: State
    surface: Surface
    energies: Energies
    trace: tuple[float, ...]
    poses: tuple[Pose, ...] = ()
    refined: bool = False
    behind: float = float("nan")


def start_state(
    problem: Problem, guess: Hypothesis, weights: Weights, camera: Camera | None = None, skin: Skin | None = None
) -> tuple[State, Surface]:
    """The video's body laid over the markers as a hypothesis says; ``skin`` is the mean body's, where it is at hand."""
    betas = np.zeros(problem.body.shape_count)
    skin = skin or Skin(problem.body, betas)
    placement, surface = skin.on_vertices(guess.vertex, weights.offset)
    rotations = problem.seen.prior.copy()
    rotations[:, 0] = guess.R_lab_cam @ rotations[:, 0]
    pose = Pose(rotations, guess.trans - problem.body.joints(betas)[0], betas)
    if camera is None:
        camera = locate_camera(problem, pose, guess.R_lab_cam, weights)
    return State(pose, placement, camera), surface


def locate_camera(problem: Problem, pose: Pose, turn: np.ndarray, weights: Weights) -> Camera:
    """A camera of known orientation and guessed focal length, placed so that the posed body falls on its landmarks."""
    centre = problem.seen.lab_centre
    focal = weights.focal_guess * max(max(problem.seen.image_size), 1)
    camera = Camera(turn, np.array([0.0, 0, 4.0]), centre, focal)
    if not problem.in_image.any():
        return camera
    points = place_points(problem.landmarks, forward(problem.body, pose), pose.betas)
    local = ((points - centre) @ turn)[problem.in_image]
    ray = (problem.pixels[problem.in_image] - np.array(problem.seen.image_size) / 2) / focal
    # x + tx = u (z + tz), likewise y: linear in the shift
    a = np.zeros((2 * len(local), 3))
    a[0::2, 0] = a[1::2, 1] = 1
    a[0::2, 2], a[1::2, 2] = -ray[:, 0], -ray[:, 1]
    b = (ray * local[:, 2:] - local[:, :2]).ravel()
    shift = np.linalg.lstsq(a, b, rcond=None)[0]
    return replace(camera, shift=shift if shift[2] > 0.5 else camera.shift)


def descend(
    problem: Problem,
    state: State,
    surface: Surface,
    phases: tuple[Phase, ...],
    base: Weights,
    watch: Callable[[Pose], None] = lambda pose: None,
) -> tuple[State, Surface, tuple[float, ...]]:
    """Damped Gauss-Newton through the given phases; each step is kept only if it costs less.

    Parameters
    ----------
    watch : told the pose after every step
    """
    trace: list[float] = []
    for phase in phases:
        weights = phase_weights(base, phase)
        if phase.reassign:
            state, surface = reassign(problem, state, weights)
        damping, cost = 1e-3, problem.energies(state, weights, surface).total
        for _ in range(phase.steps):
            for _attempt in range(4):
                trial = problem.step(state, weights, surface, damping)
                trial_cost = problem.energies(trial, weights, surface).total
                if trial_cost < cost:
                    break
                damping *= 10
            else:
                break
            gain = (cost - trial_cost) / cost
            state, cost, damping = trial, trial_cost, max(damping * 0.3, 1e-6)
            if weights.free_placement:
                state, surface = reattach(problem.body, state)
                cost = problem.energies(state, weights, surface).total
            trace.append(cost)
            watch(state.pose)
            if gain < _ENOUGH:
                break
    return state, surface, tuple(trace)


def phase_weights(base: Weights, phase: Phase) -> Weights:
    """The weights of one phase."""
    return replace(
        base,
        marker=phase.marker,
        marker_kernel=phase.kernel,
        prior_deg=base.prior_deg * phase.prior,
        root_deg=base.root_deg * phase.prior,
        free_placement=base.free_placement and phase.free_placement,
        free_shape=base.free_shape and phase.free_shape,
    )


def reattach(body: Body, state: State) -> tuple[State, Surface]:
    """The same placement, riding on the skin that is below it now."""
    skin = Skin(body, state.pose.betas)
    placement, surface = skin.attach(state.placement.shaped(state.pose.betas))
    return replace(state, placement=placement), surface


def place_costs(problem: Problem, state: State, offset: float) -> tuple[Points, np.ndarray, np.ndarray]:
    """What it costs to put each marker on each place of the skin, given the poses.

    Parameters
    ----------
    offset : m, of a marker above the skin

    Returns
    -------
    The V places, where they are (N, V, 3) m, and the squared distance of each marker from each, summed over the frames
    that show it, (V, M) m^2
    """
    body, betas = problem.body, state.pose.betas
    skin = Skin(body, betas)
    index = np.intersect1d(body.lod_index, skin.index)
    candidates = Points(
        skin.surface[index] + offset * skin.normal(index) - body.shape_dirs[index] @ betas,
        body.shape_dirs[index],
        body.weights[index],
    )
    placed = place_points(candidates, forward(body, state.pose), betas)  # (N, V, 3)
    flat = placed.transpose(1, 0, 2).reshape(len(index), -1)
    square = np.einsum("nvk,nvk->vn", placed, placed) @ problem.present
    product = flat @ problem.target.transpose(0, 2, 1).reshape(flat.shape[1], -1)
    return candidates, placed, square - 2 * product + np.einsum("nmk,nmk->m", problem.target, problem.target)


def reassign(problem: Problem, state: State, weights: Weights) -> tuple[State, Surface]:
    """Each marker moved to the place on the skin that its whole trajectory fits best, given the poses.

    In every frame the marker is carried back to the rest body as if it rode on a vertex; the vertex whose carried
    marker strays least from its skin, over all frames together, takes it.
    """
    body, betas = problem.body, state.pose.betas
    skin = Skin(body, betas)
    index = np.intersect1d(body.lod_index, skin.index)
    candidates, placed, distance = place_costs(problem, state, weights.offset)
    links = forward(body, state.pose)
    count = np.maximum(problem.present.sum(axis=0), 1)
    best = distance.argmin(axis=0)
    chosen = candidates.take(best)
    # from the vertex to the mean place of the marker in that vertex's own moving frame
    turn = blended_turn(chosen, links)
    residual = problem.target - placed[:, best]
    carried = np.einsum("nmji,nmj->nmi", turn, residual) * problem.present[..., None]
    offset = np.clip(carried.sum(axis=0) / count[:, None], -0.03, 0.03)
    normal = skin.normal(index[best])
    offset -= np.einsum("mk,mk->m", offset, normal)[:, None] * normal
    placement, surface = skin.attach(chosen.shaped(betas) + offset)
    return replace(state, placement=placement), surface


def relax(
    body: Body,
    seen: Observations,
    landmarks: Points,
    guesses: tuple[Hypothesis, ...],
    few: np.ndarray,
    many: np.ndarray,
    base: Weights,
    *,
    keep: int = 4,
    camera: Camera | None = None,
    progress: Progress = silent,
) -> tuple[Fit, ...]:
    """Every hypothesis relaxed coarsely on few keyframes, the best ``keep`` finely on many.

    Parameters
    ----------
    seen : all T frames
    guesses : with ``trans`` for the frames ``few``
    few, many : ascending frame numbers of the coarse and the fine keyframes

    Returns
    -------
    The refined fits, least energy first, then the best of those that were left behind, the latest left first
    """
    problem = Problem(body, seen.at(few), landmarks)

    skin = Skin(body, np.zeros(body.shape_count))

    def begun(guess: Hypothesis) -> Fit:
        state, surface = start_state(problem, guess, base, camera, skin)
        return Fit(guess, state, surface, problem.energies(state, base, surface), ())

    pool = [begun(guess) for guess in guesses]
    say = partial(_tell, progress, guesses)
    left: list[Fit] = []
    best = np.inf
    for i, round_ in enumerate(SEARCH):
        progress(0.6 * i / len(SEARCH), f"relaxing {len(pool)} hypotheses")
        judge = phase_weights(base, round_.phase)
        pool = spread(partial(_advance, problem, phases=(round_.phase,), base=base, judge=judge), pool)
        say(pool)
        pool.sort(key=lambda fit: fit.energies.total)
        pool = _basins(pool) if round_.phase.free_placement else pool
        limit = (1 + round_.doubt / np.sqrt(problem.present.shape[1])) * pool[0].energies.total
        going = [fit for fit in pool[: round_.most] if fit.energies.total <= limit]
        left = pool[len(going) :] + left
        settled = round_.phase is _PLACED and pool[0].energies.total > _SETTLED * best
        best = pool[0].energies.total if round_.phase is _PLACED else np.inf
        pool = going
        if settled:
            break
    chosen = _varied(pool, keep)
    left = [fit for fit in pool if not any(fit is one for one in chosen)] + left
    whole = Problem(body, seen.at(many), landmarks)
    judge = _judging(phase_weights(base, FINE[-1]), whole)
    progress(0.6, f"refining {len(chosen)} hypotheses")

    def closer_look(fit: Fit) -> Fit:
        pose = carried_over(body, seen, few, fit.state).at(many)
        return _advance(
            whole,
            replace(fit, state=replace(fit.state, pose=pose), refined=True),
            phases=FINE[:1],
            base=base,
            judge=judge,
        )

    fine = _basins(spread(closer_look, chosen))
    say(fine)
    fine = spread(partial(_advance, whole, phases=FINE[1:], base=base, judge=judge), fine)
    fine.sort(key=lambda fit: fit.energies.total)
    say(fine)
    if all(same_stand(fine[0], fit) for fit in fine):
        coarse = next(fit for fit in chosen if fit.start is fine[0].start)
        left = _with_rival(problem, coarse, fine[0], left, base)
        if left and left[0].behind < _NEAR_RIVAL:
            rival = _advance(whole, closer_look(left[0]), phases=FINE[1:], base=base, judge=judge)
            fine = _basins([*fine, replace(rival, behind=float("nan"))])
            left = left[1:]
            say(fine)
    return tuple(fine) + tuple(left[:_SHOWN])


def same_stand(one: Fit, other: Fit) -> bool:
    """Whether two fits are the same answer."""
    bones, others = (fit.state.placement.weights.argmax(1) for fit in (one, other))
    return alike(bones, others, one.state.camera.R_lab_cam, other.state.camera.R_lab_cam)


def _with_rival(problem: Problem, coarse: Fit, best: Fit, left: list[Fit], base: Weights) -> list[Fit]:
    """Those that were left behind, the best different answer among them first, with what it costs beside the best.

    They were left early, when energies said little. So the rival descends as far as the best had on few keyframes.

    Parameters
    ----------
    coarse : the best answer as it was then
    """
    judge = phase_weights(base, _PLACED)
    tried = [fit for fit in left if not same_stand(best, fit)][:_TRIED]
    for fit in tried:
        rival = _advance(problem, fit, phases=_CATCH_UP, base=base, judge=judge)
        if not same_stand(best, rival):
            rival = replace(rival, behind=rival.energies.total / max(coarse.energies.total, 1e-9), poses=fit.poses)
            return [rival, *(other for other in left if other is not fit)]
    return left


def settled_again(problem: Problem, fits: Sequence[Fit], base: Weights) -> tuple[Fit, ...]:
    """The same fits; those that are refined choose their places anew until that gains nothing, and are ranked again."""
    judge = _judging(phase_weights(base, FINE[-1]), problem)
    fine = spread(partial(_to_its_end, problem, base=base, judge=judge), [fit for fit in fits if fit.refined])
    fine.sort(key=lambda fit: fit.energies.total)
    return *fine, *(fit for fit in fits if not fit.refined)


def _to_its_end(problem: Problem, fit: Fit, *, base: Weights, judge: Weights) -> Fit:
    for _ in range(_MOST_ROUNDS):
        before = fit.energies.total
        fit = _advance(problem, fit, phases=FINE, base=base, judge=judge)
        if fit.energies.total > _SETTLED * before:
            break
    return fit


def _tell(progress: Progress, guesses: Sequence[Hypothesis], fits: Sequence[Fit]) -> None:
    """Report how the hypotheses stand to whoever watches."""
    row = {id(guess): i for i, guess in enumerate(guesses)}
    for fit in fits:
        values = {"energy": fit.energies.total, "refined": fit.refined}
        tell(progress, Found("candidate", row[id(fit.start)], values))


def _judging(weights: Weights, problem: Problem) -> Weights:
    """The weights by which answers are compared.

    Where the video's landmarks are there, its pose was lifted from them: it counts half, lest the same errors, those of
    depth above all, are counted twice.
    """
    if not problem.in_image.any():
        return weights
    wider = np.sqrt(2)
    return replace(weights, prior_deg=weights.prior_deg * wider, root_deg=weights.root_deg * wider)


def _advance(problem: Problem, fit: Fit, *, phases: tuple[Phase, ...], base: Weights, judge: Weights) -> Fit:
    """The same fit after some more phases of descent."""
    poses: list[Pose] = []
    state, surface, trace = descend(problem, fit.state, fit.surface, phases, base, poses.append)
    energies = problem.energies(state, judge, surface)
    return replace(
        fit, state=state, surface=surface, energies=energies, trace=fit.trace + trace, poses=fit.poses + tuple(poses)
    )


def _basins(fits: list[Fit]) -> list[Fit]:
    """The fits less those that have run into a better one: same bones, same camera, nearly the same energy."""
    kept: list[Fit] = []
    for fit in sorted(fits, key=lambda fit: fit.energies.total):
        bones = fit.state.placement.weights.argmax(1)
        for one in kept:
            turn = np.linalg.norm(log_so3(one.state.camera.R_lab_cam.T @ fit.state.camera.R_lab_cam))
            near = fit.energies.total < _SAME_ENERGY * one.energies.total
            if near and turn < _SAME_TURN and (bones == one.state.placement.weights.argmax(1)).mean() > 0.95:
                break
        else:
            kept.append(fit)
    return kept


def _varied(pool: list[Fit], keep: int) -> list[Fit]:
    """The best fits, but no more than two that give the markers to nearly the same bones."""
    chosen: list[Fit] = []
    for fit in pool:
        bones = fit.state.placement.weights.argmax(1)
        alike = sum((bones == one.state.placement.weights.argmax(1)).mean() > 0.8 for one in chosen)
        if alike < 2:
            chosen.append(fit)
        if len(chosen) == keep:
            break
    return chosen
