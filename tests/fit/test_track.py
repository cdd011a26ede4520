"""A known person followed through a trial without names: which column is which marker, and who it is not."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.kinematics import Points, forward, place_points
from markerscope.solver.fit.known.body import KnownBody, known_body
from markerscope.solver.fit.known.hold import matched
from markerscope.solver.fit.known.method import KnownFitSettings, KnownSettings, comparison, fitted, located, ranked
from markerscope.solver.fit.known.person_file import read_person, write_person
from markerscope.solver.fit.known.same import said
from markerscope.solver.fit.known.track import follow, told
from markerscope.solver.fit.labelled.solve import observed
from tests.fit.conftest import Scene, simulate
from tests.fit.test_known import fitted as solved_trial

COUNT = 40
TWELVE = [1, 2, 4, 5, 7, 8, 16, 17, 18, 19, 20, 21]


@pytest.fixture(scope="module")
def person() -> tuple[Body, Points, KnownBody]:
    body, placement, motion = solved_trial(11, COUNT)
    return body, placement, replace(known_body(body, motion), off_m=0.002)


def another_trial(body: Body, placement: Points, betas: np.ndarray, seed: int) -> tuple[Scene, np.ndarray, np.ndarray]:
    """A movement that the person was not seen in, its columns shuffled: scene, (T, M, 3) m, true place of each."""
    scene = simulate(body, seed, frames=24)
    pose = replace(scene.pose, betas=betas)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(placement.rest))
    seen = place_points(placement, forward(body, pose), betas)[:, order] + rng.normal(0, 0.001, (24, len(order), 3))
    return replace(scene, pose=pose, joints=forward(body, pose).place), seen, order


def test_every_column_is_told_and_the_joints_are_found(person: tuple[Body, Points, KnownBody]) -> None:
    body, placement, known = person
    scene, markers, order = another_trial(body, placement, known.betas, 21)
    tracked = follow(body, known, markers, 12)
    costs = [track.cost for track in tracked.tracks]
    assert costs == sorted(costs)
    assert (tracked.tracks[0].place == order).all()
    seen = observed(markers, scene.pose)
    found = located(body, known, tracked, markers)
    ranks = ranked(body, known, tracked, seen, found, KnownSettings())
    assert ranks.confidence > 0.9 and not ranks.warnings
    motion = fitted(body, seen, found, ranks, np.arange(24) / 6, KnownFitSettings())
    error = 1000 * np.linalg.norm(motion.joints - scene.joints, axis=2)[:, TWELVE].mean()
    assert error < 10, f"{error:.1f} mm (synthetic)"
    assert (motion.marker_joint[np.argsort(order)] == placement.weights.argmax(axis=1)).all()


def test_a_track_that_broke_off_is_the_same_marker_in_two_columns(person: tuple[Body, Points, KnownBody]) -> None:
    body, placement, known = person
    _, markers, order = another_trial(body, placement, known.betas, 22)
    halves = np.concatenate([markers, markers[:, :3], np.full((24, 1, 3), np.nan)], axis=1)
    halves[10:, :3], halves[:10, COUNT : COUNT + 3] = np.nan, np.nan
    halves[:, -1] = markers[:, 5] + np.array([1.5, 0, 0])  # nobody's
    place = follow(body, known, halves, 12).tracks[0].place
    assert (place[:COUNT] == order).all()
    assert (place[COUNT:-1] == order[:3]).all()
    assert place[-1] == -1


def test_two_columns_seen_together_are_never_one_marker() -> None:
    where = np.zeros((5, 2, 3))
    where[:, 1, 0] = 0.5
    seen = np.stack([where[:, 0] + 0.001, where[:, 0] + 0.004], axis=1)
    assert told(where, seen, seen).tolist() == [0, -1]


def test_another_person_and_moved_markers_are_told_apart(person: tuple[Body, Points, KnownBody]) -> None:
    body, placement, known = person
    rng = np.random.default_rng(5)
    taller = known.betas.copy()
    taller[-body.shape_count + body.betas_count :] += rng.normal(0, 1.2, body.shape_count - body.betas_count)
    taller[: body.betas_count] += rng.normal(0, 1.2, body.betas_count)
    moved = replace(placement, rest=placement.rest + rng.normal(0, 0.015, placement.rest.shape))
    cases = {
        "": (placement, known.betas),
        "another person": (placement, taller),
        "markers were likely moved": (moved, known.betas),
    }
    for says, (places, betas) in cases.items():
        _, markers, _ = another_trial(body, places, betas, 23)
        tracked = follow(body, known, markers, 12)
        doubts = said(comparison(body, known, tracked, markers), known.off_m, moved=False).doubts
        assert bool(doubts) == bool(says), (says, doubts)
        assert says in "".join(doubts)


def test_a_person_as_a_file_is_the_same_person(person: tuple[Body, Points, KnownBody], tmp_path: Path) -> None:
    body, _, known = person
    write_person(tmp_path / "person.npz", known)
    again = read_person(tmp_path / "person.npz", body)
    assert (again.betas == known.betas).all() and again.off_m == known.off_m
    assert (again.placement.rest == known.placement.rest).all() and (again.poses == known.poses).all()
    content = (tmp_path / "person.npz").read_bytes()
    write_person(tmp_path / "person.npz", known)
    assert (tmp_path / "person.npz").read_bytes() == content, "results are known by what it holds"
    (tmp_path / "person.npz").write_bytes(content[:100])
    with pytest.raises(InputError, match="holds no person"):
        read_person(tmp_path / "person.npz", body)
    write_person(tmp_path / "person.npz", known)
    with pytest.raises(InputError, match="another body"):
        read_person(tmp_path / "person.npz", Body.load())


def test_a_trial_with_too_little_in_sight_is_refused(person: tuple[Body, Points, KnownBody]) -> None:
    body, _, known = person
    with pytest.raises(InputError, match="enough markers"):
        follow(body, known, np.full((10, 4, 3), np.nan))


def test_places_of_a_trial_are_matched_to_those_known() -> None:
    known = np.eye(3)
    own = known[[2, 0, 1]] + 0.01
    assert matched(np.vstack([own, [[5.0, 5, 5]]]), known).tolist() == [2, 0, 1, -1]
