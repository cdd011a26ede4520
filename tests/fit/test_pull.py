"""The pull to bony landmarks: its likelihoods in closed form, its slopes, and when it draws markers and when not."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace

import numpy as np
import pytest

from markerscope.solver.body.bony import bony_sites
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.kinematics import forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull import mixture
from markerscope.solver.fit.pull.by_hand import decided
from markerscope.solver.fit.pull.earn import EARNED, Drawn, draw
from markerscope.solver.fit.pull.results import said, summary, words_of
from markerscope.solver.fit.pull.stage import to_landmarks
from markerscope.solver.fit.pull.targets import skin_area, targets_of
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.fit.state import State, Surface, Weights
from markerscope.solver.pipeline.settings import from_table, to_table
from tests.fit.conftest import Scene, simulate

FRAMES = 4
PLACES = ("asis", "psis", "knee_lateral", "ankle_lateral", "calcaneus", "meta5", "acromion", "elbow_lateral")
LAYOUT = (*(f"{side}_{place}" for side in ("left", "right") for place in PLACES), "c7", "sternum_ij")


@dataclass(frozen=True)
class Laid:
    """A fit that is right but for where along the skin its markers sit."""

    scene: Scene
    state: State
    surface: Surface

    def drawn(self, fixed: np.ndarray | None = None, allowed: np.ndarray | None = None) -> Drawn:
        count, landmarks = self.scene.seen.markers.shape[1], len(bony_sites(self.scene.body))
        fixed = np.zeros((count, landmarks), bool) if fixed is None else fixed
        allowed = np.ones((count, landmarks), bool) if allowed is None else allowed
        scene = self.scene
        return draw(scene.body, scene.seen, scene.landmarks, self.state, self.surface, Weights(), fixed, allowed)


def laid(body: Body, true: np.ndarray, believed: np.ndarray, frames: int = FRAMES) -> Laid:
    """Markers that truly sit at ``true`` (M, 3) m on the shaped rest body, and of which a fit believes the others."""
    scene = simulate(body, 3, frames=frames, markers=len(true))
    skin = Skin(body, scene.pose.betas)
    placement, _ = skin.attach(true)
    markers = place_points(placement, forward(body, scene.pose), scene.pose.betas)
    wrong, surface = skin.attach(believed)
    scene = replace(scene, seen=replace(scene.seen, markers=markers))
    return Laid(scene, State(scene.pose, wrong, scene.camera), surface)


def beside(body: Body, places: np.ndarray, by: float, rng: np.random.Generator) -> np.ndarray:
    """Places moved by so many m, in random directions, back onto 9.5 mm above the skin."""
    betas = simulate(body, 3, frames=FRAMES, markers=4).pose.betas
    skin = Skin(body, betas)
    step = rng.normal(size=places.shape)
    normal = skin.attach(places)[1].normal
    step -= np.einsum("mk,mk->m", step, normal)[:, None] * normal
    moved = places + by * step / np.linalg.norm(step, axis=1, keepdims=True)
    surface = skin.attach(moved)[1]
    height = np.einsum("mk,mk->m", moved - surface.point, surface.normal)
    return np.asarray(moved + (0.0095 - height)[:, None] * surface.normal)


def on_landmarks(body: Body) -> np.ndarray:
    """(M, 3) m, the places of ``LAYOUT`` on the body that ``simulate`` draws."""
    betas = simulate(body, 3, frames=FRAMES, markers=4).pose.betas
    targets = targets_of(body, betas, 0.0095)
    return targets.shaped(betas)[[targets.names.index(name) for name in LAYOUT]]


def anywhere(body: Body, count: int, seed: int) -> np.ndarray:
    """(M, 3) m, places that mean nothing."""
    betas = simulate(body, 3, frames=FRAMES, markers=4).pose.betas
    skin = Skin(body, betas)
    chosen = np.random.default_rng(seed).choice(np.intersect1d(skin.index, body.lod_index), count, replace=False)
    return skin.on_vertices(chosen, 0.0095)[0].shaped(betas)


def test_the_density_about_a_landmark_holds_its_share_of_the_skin() -> None:
    area, spread, step = 1.7, 0.02, 0.002
    grid = np.arange(-0.12, 0.12, step)
    distance = np.hypot(*np.meshgrid(grid, grid)).reshape(-1, 1)
    far = np.full((len(distance), 4), np.inf)
    given = mixture.densities(np.concatenate([distance, far], axis=1), spread, area)
    assert given[:, 0].sum() * step**2 == pytest.approx(area / 5, rel=1e-4)
    assert not given[:, 1:].any()


@pytest.mark.parametrize(
    ("given", "ratio", "share"),
    [
        # ln((1 + 2 w) (1 - w)) is greatest where 2 / (1 + 2 w) = 1 / (1 - w)
        ([3.0, 0.0], np.log(1.5 * 0.75), 0.25),
        ([0.9, 0.2], 0.0, 0.0),
        ([9.0, 5.0], np.log((1 + 0.95 * 8) * (1 + 0.95 * 4)), 0.95),
        ([], 0.0, 0.0),
    ],
)
def test_the_likelihood_ratio_is_that_of_the_best_share(given: list[float], ratio: float, share: float) -> None:
    found = mixture.likelihood_ratio(np.array(given))
    assert found == pytest.approx((ratio, share), abs=1e-9)


def test_probabilities_follow_bayes_and_no_landmark_is_given_twice() -> None:
    given = np.array([[4.0, 1.0], [0.0, 0.0], [0.0, 2.0]])
    found = mixture.expectation(given, 0.5)
    assert np.allclose(found, [[4 / 6, 1 / 6], [0, 0], [0, 2 / 3]])
    crowded = mixture.expectation(np.full((8, 1), 50.0), 0.5)
    assert crowded.sum() == pytest.approx(1)
    assert mixture.share_of(found) == pytest.approx(1.5 / 3)
    assert mixture.share_of(np.ones((3, 1))) == 0.95


def test_the_spread_is_that_of_the_hits_beside_what_was_believed() -> None:
    rng = np.random.default_rng(0)
    distance = np.linalg.norm(rng.normal(0, 0.02, (4000, 2)), axis=1)[:, None]
    assert mixture.spread_of(np.ones_like(distance), distance, 0.01, 4) == pytest.approx(0.02, rel=0.02)
    nothing = np.zeros((3, 1)), np.full((3, 1), np.inf)
    assert mixture.spread_of(*nothing, 0.012, 4) == pytest.approx(0.012)


def test_the_skin_is_as_large_as_a_persons(free_body: Body) -> None:
    # A whole person has 1.7 to 2.0 m2 (Du Bois and Du Bois 1916); face, hands' insides and soles carry no markers.
    assert 1.4 < skin_area(free_body) < 2.0


def test_targets_follow_the_landmarks_of_every_shape(free_body: Body) -> None:
    betas = np.random.default_rng(1).normal(0, 0.7, free_body.shape_count)
    targets = targets_of(free_body, betas, 0.0095)
    there = free_body.landmarks(betas)
    for name, place in zip(targets.names, targets.shaped(betas), strict=True):
        assert np.linalg.norm(place - there[name]) == pytest.approx(0.0095, abs=1e-6), name
    other = betas + 0.1
    moved = targets.shaped(other) - targets.shaped(betas)
    expected = [free_body.landmarks(other)[name] - there[name] for name in targets.names]
    assert np.allclose(moved, expected, atol=1e-9)


def test_the_slope_of_the_pull_is_the_finite_difference_of_its_cost(free_body: Body) -> None:
    given = laid(free_body, anywhere(free_body, 5, 0), anywhere(free_body, 5, 0))
    scene, state, surface, weights = given.scene, given.state, given.surface, Weights()
    targets = targets_of(free_body, state.pose.betas, weights.offset)
    chance = np.random.default_rng(0).random((5, len(targets.names)))
    plain = Problem(free_body, scene.seen, scene.landmarks)
    pull = Pull.of(chance, 800.0, targets)
    pulled = Problem(free_body, replace(scene.seen, further=(pull,)), scene.landmarks)
    by = pulled.linearised(state, weights, surface), plain.linearised(state, weights, surface)
    slope, curvature = by[0].g_s - by[1].g_s, by[0].h_ss - by[1].h_ss
    assert np.allclose(by[0].g_f, by[1].g_f) and np.allclose(by[0].h_fs, by[1].h_fs)

    def cost(shared: np.ndarray) -> float:
        moved = plain._moved(state, np.zeros((FRAMES, by[0].g_f.shape[1])), shared)
        return FRAMES * pulled.energies(moved, weights, surface)["landmark_pull"]

    rng = np.random.default_rng(2)
    for _ in range(6):
        step = np.zeros(len(slope))
        step[plain.unknowns.shape] = rng.normal(0, 0.1, plain.unknowns.shape.stop)
        step[plain.unknowns.placement] = rng.normal(0, 0.005, 15)
        ahead, back, here = cost(step), cost(-step), cost(np.zeros(len(slope)))
        # The pull is a quadratic form, so differences are exact.
        assert (ahead - back) / 4 == pytest.approx(slope @ step, rel=1e-6)
        assert (ahead + back - 2 * here) / 2 == pytest.approx(step @ curvature @ step, rel=1e-6)


def test_markers_on_landmarks_are_drawn_to_them(free_body: Body) -> None:
    true = on_landmarks(free_body)
    given = laid(free_body, true, beside(free_body, true, 0.02, np.random.default_rng(0)))
    found = given.drawn()
    assert found.pull.state == "earned" and found.pull.log_ratio > EARNED
    right = [name == known for name, known in zip(found.pull.landmark, LAYOUT, strict=True)]
    assert np.mean(right) >= 0.9
    assert np.nanmedian(found.pull.after) < 0.5 * np.nanmedian(found.pull.before)
    slid = np.linalg.norm(found.state.placement.shaped(found.state.pose.betas) - true, axis=1)
    assert np.median(slid) < 0.012


def test_markers_anywhere_are_left_as_they_are(free_body: Body) -> None:
    for seed in range(6):
        places = anywhere(free_body, 30, seed)
        given = laid(free_body, places, places)
        found = given.drawn()
        assert found.pull.state == "not earned" and found.pull.log_ratio < EARNED
        assert found.state is given.state and found.surface is given.surface
        assert not found.pull.hits and set(found.pull.landmark) == {""}


def test_markers_far_beside_their_landmarks_are_not_drawn(free_body: Body) -> None:
    true = beside(free_body, on_landmarks(free_body), 0.045, np.random.default_rng(1))
    given = laid(free_body, true, true, frames=40)  # enough to hold against the pull
    found = given.drawn()
    assert found.pull.state in ("given up", "not earned")
    assert found.state is given.state


def test_a_pinned_marker_is_drawn_alone_and_a_refused_one_is_not(free_body: Body) -> None:
    names = bony_sites(free_body).names
    places = anywhere(free_body, 12, 4)
    given = laid(free_body, places, places)
    betas = given.state.pose.betas
    far = np.linalg.norm(places[:, None] - targets_of(free_body, betas, 0.0095).shaped(betas), axis=2)
    m, landmark = (int(i) for i in np.unravel_index(far.argmin(), far.shape))
    used = np.arange(12)
    found = given.drawn(*decided([(m, names[landmark])], [], names, used, 12))
    assert found.pull.state == "by hand" and found.pull.landmark[m] == names[landmark]
    assert found.pull.hits == 1 and found.pull.probability[m] == 1
    assert found.pull.after[m] < 0.7 * found.pull.before[m]

    true = on_landmarks(free_body)
    layout = laid(free_body, true, true)
    refused = layout.drawn(*decided([], [(0, LAYOUT[0]), (1, "")], names, np.arange(len(true)), len(true)))
    assert refused.pull.landmark[0] != LAYOUT[0] and refused.pull.landmark[1] == ""
    assert refused.pull.landmark[2] == LAYOUT[2]


@pytest.mark.parametrize(
    ("pinned", "refused", "what"),
    [
        ([(0, "left_asis"), (0, "right_asis")], [], "marker 0 is pinned twice"),
        ([(0, "left_asis"), (1, "left_asis")], [], "landmark left_asis is pinned twice"),
        ([(0, "left_asis")], [(0, "")], "marker 0 is pinned to left_asis and refused there"),
    ],
)
def test_decisions_that_contradict_each_other_are_refused(
    pinned: list[tuple[int, str]], refused: list[tuple[int, str]], what: str
) -> None:
    with pytest.raises(InputError, match=what):
        FitSettings(pinned=tuple(pinned), refused=tuple(refused))


@pytest.mark.parametrize(
    ("pair", "what"),
    [
        ((0, "elbow"), 'there is no landmark "elbow"'),
        ((0, ""), 'there is no landmark ""'),
        ((7, "left_asis"), "there is no marker 7"),
    ],
)
def test_a_pin_must_name_what_there_is(free_body: Body, pair: tuple[int, str], what: str) -> None:
    with pytest.raises(InputError, match=what):
        decided([pair], [], bony_sites(free_body).names, np.arange(3), 3)


def test_decisions_are_kept_in_a_session_file() -> None:
    settings = FitSettings(landmark_pull="off", pinned=((3, "left_asis"),), refused=((4, ""),))
    assert from_table(FitSettings, json.loads(json.dumps(to_table(settings)))) == settings


def test_the_result_speaks_of_every_marker_of_the_recording(free_body: Body) -> None:
    true = on_landmarks(free_body)
    given = laid(free_body, true, true)
    count = len(true) + 2
    used = np.arange(1, count - 1)
    wider = np.full((FRAMES, count, 3), np.nan)
    wider[:, used] = given.scene.seen.markers
    seen = replace(given.scene.seen, markers=wider)
    around = (free_body, seen, given.scene.landmarks, used, np.arange(FRAMES), given.state, given.surface, Weights())
    pull = to_landmarks(*around, FitSettings()).pull
    assert pull.landmark[0] == pull.landmark[-1] == "" and pull.landmark[1] == LAYOUT[0]
    assert np.isnan(pull.before[[0, -1]]).all() and len(pull.probability) == count
    told = summary(pull, [f"M{m}" for m in range(count)])
    assert json.loads(json.dumps(told))["markers"][0]["label"] == "M1"
    assert told["markers"][0]["landmark"] == LAYOUT[0]
    assert words_of(pull)[1].startswith("left asis, ") and words_of(pull)[0] == ""
    assert f"{pull.hits} markers on bony landmarks" in said(pull)
    off = to_landmarks(*around, FitSettings(landmark_pull="off"))
    assert off.pull.state == "off" and off.state is given.state
    assert summary(off.pull, [""] * count)["log_ratio"] is None
