"""Exchanged sides are injected into tracks and must be found and put back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.video.flips import GROUPS, mend_flips

EVERY = tuple(GROUPS)


def columns(group: str) -> tuple[list[int], list[int]]:
    return tuple([LANDMARKS.index(f"{side}_{name}") for name in GROUPS[group]] for side in ("left", "right"))  # type: ignore[return-value]


def exchange(landmarks: Landmarks, rows: dict[str, np.ndarray]) -> Landmarks:
    arrays = {name: getattr(landmarks, name).copy() for name in ("image", "world", "visibility")}
    for group, flipped in rows.items():
        left, right = columns(group)
        for values in arrays.values():
            values[np.ix_(flipped, left + right)] = values[np.ix_(flipped, right + left)]
    return replace(landmarks, **arrays)


def found(landmarks: Landmarks) -> tuple[Landmarks, dict[str, np.ndarray]]:
    mended, flips = mend_flips(landmarks)
    rows = {group: np.zeros(len(landmarks.time), dtype=bool) for group in GROUPS}
    for flip in flips:
        rows[flip.group][flip.start : flip.stop] = True
    return mended, rows


def walker(rate: float = 30.0, seconds: float = 6.0) -> Landmarks:
    """A person walking to the right, seen from their right side, so that legs and arms pass each other."""
    time = np.arange(0, seconds, 1 / rate)
    world = np.zeros((len(time), 33, 3))
    swing = 0.45 * np.sin(2 * np.pi * 0.9 * time)
    for side, sign in (("left", 1.0), ("right", -1.0)):

        def put(name: str, forward: np.ndarray | float, height: float, out: float, side=side, sign=sign) -> None:
            world[:, LANDMARKS.index(f"{side}_{name}")] = np.stack(
                np.broadcast_arrays(forward, -height, sign * out), axis=-1
            )

        leg, arm = sign * swing, -sign * swing
        put("hip", 0, 0, 0.1)
        put("knee", 0.4 * np.sin(leg), -0.4, 0.1)
        put("ankle", 0.8 * np.sin(leg), -0.8, 0.1)
        put("heel", 0.8 * np.sin(leg) - 0.05, -0.85, 0.1)
        put("foot_index", 0.8 * np.sin(leg) + 0.15, -0.85, 0.12)
        put("shoulder", 0, 0.5, 0.18)
        put("elbow", 0.3 * np.sin(arm), 0.2, 0.2)
        for hand, reach in (("wrist", 0.5), ("pinky", 0.58), ("index", 0.6), ("thumb", 0.56)):
            put(hand, reach * np.sin(arm + 0.2), 0.0, 0.2)
        for name in GROUPS["trunk"][:3]:
            put(name, 0.1, 0.7, 0.03)
        put("ear", 0.02, 0.7, 0.07)
        world[:, LANDMARKS.index(f"mouth_{side}")] = (0.1, -0.65, sign * 0.02)
    world[:, LANDMARKS.index("nose")] = (0.13, -0.68, 0)
    noise = np.random.default_rng(0)
    image = 300 * (world[..., :2] + np.stack([1.2 * time - 3, 0 * time], axis=1)[:, None]) + 500
    count = len(time)
    return Landmarks(
        image + noise.normal(0, 1.5, image.shape),
        world + noise.normal(0, 0.01, world.shape),
        np.full((count, 33), 0.9),
        np.ones(count, dtype=bool),
        time,
        np.arange(count),
        (1000, 1000),
    )


def spans(count: int, rng: np.random.Generator, number: int, longest: int) -> np.ndarray:
    rows = np.zeros(count, dtype=bool)
    for _ in range(number):
        start = rng.integers(count)
        rows[start : start + int(np.exp(rng.uniform(0, np.log(longest))))] = True
    return rows


def f1(truth: dict[str, np.ndarray], seen: dict[str, np.ndarray]) -> float:
    both = sum((truth[g] & seen[g]).sum() for g in truth)
    return 2 * both / sum(truth[g].sum() + seen[g].sum() for g in truth)


@pytest.mark.parametrize("groups", [("legs",), ("arms",), EVERY])
@pytest.mark.parametrize("seed", range(5))
def test_injected_flips_of_a_real_track_are_found(
    squat_landmarks: Landmarks, groups: tuple[str, ...], seed: int
) -> None:
    flipped = spans(len(squat_landmarks.time), np.random.default_rng(seed), 6, 20)
    truth = {group: flipped if group in groups else np.zeros_like(flipped) for group in EVERY}
    mended, seen = found(exchange(squat_landmarks, truth))
    score = f1(truth, seen)
    assert score > 0.97, f"F1 {score:.3f}"
    if score == 1:
        np.testing.assert_array_equal(mended.world, squat_landmarks.world)
        np.testing.assert_array_equal(mended.image, squat_landmarks.image)


def test_a_real_track_without_flips_is_left_alone(squat_landmarks: Landmarks) -> None:
    assert mend_flips(squat_landmarks)[1] == ()


def test_passing_legs_are_not_flips() -> None:
    mended, flips = mend_flips(walker())
    assert flips == ()
    np.testing.assert_array_equal(mended.image, walker().image)


@pytest.mark.parametrize("seed", range(6))
def test_flips_among_passing_legs_are_found(seed: int) -> None:
    track = walker()
    flipped = spans(len(track.time), np.random.default_rng(seed), 5, 15)
    truth = dict.fromkeys(EVERY, flipped)
    score = f1(truth, found(exchange(track, truth))[1])
    assert score > 0.9, f"F1 {score:.3f}"


def test_the_body_outvotes_a_majority_of_exchanged_frames() -> None:
    track = walker()
    flipped = np.arange(len(track.time)) >= 0.35 * len(track.time)
    truth = dict.fromkeys(EVERY, flipped)
    score = f1(truth, found(exchange(track, truth))[1])
    assert score > 0.97, f"F1 {score:.3f}"


def test_untracked_rows_stay_empty_and_part_the_track() -> None:
    track = walker()
    lost = np.zeros(len(track.time), dtype=bool)
    lost[40:60] = True
    holes = replace(
        track,
        image=np.where(lost[:, None, None], np.nan, track.image),
        world=np.where(lost[:, None, None], np.nan, track.world),
        visibility=np.where(lost[:, None], 0, track.visibility),
        tracked=~lost,
    )
    mended, flips = mend_flips(holes)
    assert flips == () and np.isnan(mended.image[lost]).all() and np.isfinite(mended.image[~lost]).all()


def gap_in(track: Landmarks, first: int, seconds: float) -> Landmarks:
    """The rows of ``seconds`` from ``first`` on taken out."""
    keep = np.ones(len(track.time), dtype=bool)
    keep[first : first + round(seconds * 30)] = False
    names = ("image", "world", "visibility", "tracked", "time", "frame")
    return replace(track, **{name: getattr(track, name)[keep] for name in names})


@pytest.mark.parametrize("seconds", [0.3, 0.4, 0.9])
def test_legs_that_passed_each_other_while_nobody_looked_are_not_flips(seconds: float) -> None:
    """After a long gap sides start anew: that a leg is where the other was says nothing."""
    track = walker()
    stop = round(seconds * 30)
    first = 60
    # Each leg stands ahead or behind until the gap, and the other way round after it.
    swing = np.where(np.arange(len(track.time)) < first + stop / 2, 0.5, -0.5)
    for name, sign in (("left", 1), ("right", -1)):
        for joint, reach in (("knee", 0.4), ("ankle", 0.8), ("heel", 0.8), ("foot_index", 0.8)):
            column = LANDMARKS.index(f"{name}_{joint}")
            track.world[:, column, 0] = reach * np.sin(sign * swing)
            track.world[:, column, 2] = 0.0  # nor does the body say which is which
            track.image[:, column, 0] = 300 * (track.world[:, column, 0] + 1.2 * track.time - 3) + 500
    assert mend_flips(gap_in(track, first, seconds))[1] == ()


def test_sides_go_on_over_a_short_gap() -> None:
    """What the network calls left after 0.2 s is what was right before, and the body cannot tell."""
    track = walker()
    for name in ("left_elbow", "right_elbow"):
        track.world[:, LANDMARKS.index(name), 2] = 0.0
    count = 40
    flipped = np.arange(len(track.time)) >= len(track.time) - count
    exchanged = exchange(track, {"arms": flipped})
    seen = gap_in(exchanged, len(track.time) - count - 6, 0.2)
    mended, flips = mend_flips(seen)
    assert [(flip.group, flip.start, flip.stop) for flip in flips] == [("arms", len(seen.time) - count, len(seen.time))]
    np.testing.assert_array_equal(mended.world, gap_in(track, len(track.time) - count - 6, 0.2).world)
