"""Joint rotations out of landmarks that a body of known pose shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.lift import lift
from markerscope.solver.fit.shadow import landmarks_of_prior

LIMBS = [INDEX[f"{s}_{j}"] for s in ("left", "right") for j in ("hip", "knee", "shoulder", "elbow")]
FRAMES = 24


def performed() -> PosePrior:
    """Swinging limbs of a person who turns before an upright camera; frames 10 to 12 lost."""
    time = np.arange(FRAMES) / 20
    swing = np.zeros((FRAMES, 24, 3))
    for name, axis, low, high in (
        ("left_hip", 0, -60, 10), ("right_hip", 0, -40, 20), ("left_knee", 0, 10, 70), ("right_knee", 0, 5, 60),
        ("left_shoulder", 2, -20, 40), ("right_shoulder", 1, -10, 50), ("left_elbow", 1, -60, -10),
        ("right_elbow", 1, 10, 80),
    ):  # fmt: skip
        swing[:, INDEX[name], axis] = np.radians(low + (high - low) * (0.5 - 0.5 * np.cos(2 * np.pi * 0.7 * time)))
    rotations = exp_so3(swing)
    for side in ("left", "right"):
        rotations[:, INDEX[f"{side}_shoulder"]] = (
            anatomical.mean_pose()[INDEX[f"{side}_shoulder"]] @ rotations[:, INDEX[f"{side}_shoulder"]]
        )
    heading = exp_so3(np.stack([0 * time, 0.5 + 0.4 * time, 0 * time], axis=1))
    rotations[:, 0] = np.diag([1.0, -1, -1]) @ heading
    tracked = np.ones(FRAMES, dtype=bool)
    tracked[10:13] = False
    return PosePrior(rotations, tracked, time)


@pytest.fixture(scope="module")
def seen() -> Landmarks:
    return landmarks_of_prior(performed(), Body.load())


def test_poses_come_back_from_their_landmarks(seen: Landmarks) -> None:
    truth = performed()
    found = lift(seen, Body.load())
    np.testing.assert_array_equal(found.tracked, truth.tracked)
    np.testing.assert_array_equal(found.time, truth.time)
    off = np.degrees(np.linalg.norm(log_so3(np.swapaxes(truth.rotations, -1, -2) @ found.rotations), axis=-1))
    seen_off = off[truth.tracked]
    assert np.median(seen_off[:, 0]) < 8, f"trunk {np.median(seen_off[:, 0]):.1f} degrees"
    # A limb's turn about its own length shows in the next one alone: bones are compared, not turns.
    assert np.median(seen_off[:, LIMBS]) < 15, f"limbs {np.median(seen_off[:, LIMBS]):.1f} degrees"
    bones = _directions(found.rotations), _directions(truth.rotations)
    apart = np.degrees(np.arccos(np.clip((bones[0] * bones[1]).sum(axis=-1), -1, 1)))
    assert np.median(apart[truth.tracked]) < 3, f"bones {np.median(apart[truth.tracked]):.1f} degrees"
    assert apart[truth.tracked].max() < 12, f"bones {apart[truth.tracked].max():.1f} degrees"
    assert apart[~truth.tracked].max() < 15, "a lost stretch is bridged from both sides"


def _directions(rotations: np.ndarray) -> np.ndarray:
    """(F, 8, 3) of thighs, shanks, upper arms and forearms."""
    _, joints = Body.load().pose(rotations, np.zeros(10), np.zeros((len(rotations), 3)), want_vertices=False)
    child = [INDEX[f"{s}_{j}"] for s in ("left", "right") for j in ("knee", "ankle", "elbow", "wrist")]
    bone = joints[:, child] - joints[:, LIMBS]
    return bone / np.linalg.norm(bone, axis=-1, keepdims=True)


def test_a_person_of_another_size_has_the_same_pose(seen: Landmarks) -> None:
    """The network's metres are guesses."""
    small, large = (
        _directions(lift(replace(seen, world=seen.world * scale), Body.load()).rotations) for scale in (0.9, 1.1)
    )
    apart = np.degrees(np.arccos(np.clip((small * large).sum(axis=-1), -1, 1)))
    assert np.median(apart) < 2, f"{np.median(apart):.1f} degrees"


def test_nobody_in_sight_is_refused(seen: Landmarks) -> None:
    with pytest.raises(InputError, match="no person was found"):
        lift(replace(seen, tracked=np.zeros(FRAMES, dtype=bool)), Body.load())
