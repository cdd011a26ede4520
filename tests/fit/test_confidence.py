"""What the stated confidence does with the margin, and what a subject that stands still takes from it."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.fit.confidence import STEEPNESS_OF_LIMBS, UNRIVALLED, chosen_by_hand, judge
from markerscope.solver.fit.results import Candidate, Orientation

LEG = [INDEX[name] for name in ("left_hip", "left_hip", "left_knee", "left_knee", "left_ankle", "left_ankle")]
ARM = [INDEX[name] for name in ("left_shoulder", "left_shoulder", "left_elbow", "left_elbow", "left_wrist", "spine3")]
LEGS = [*LEG, *(INDEX[JOINTS[bone].replace("left", "right")] for bone in LEG)]
MARGINS = (1.0, 1.05, 1.13, 1.27, 1.5, 2.0, 4.0)


def candidate(energy: float, bones: list[int], swing_deg: float) -> Candidate:
    """A refined answer in which every joint turns by ``swing_deg`` over 50 keyframes."""
    swing = np.radians(np.linspace(0, swing_deg, 50))[:, None, None] * np.array([1.0, 0, 0])
    rotations = exp_so3(np.broadcast_to(swing, (50, 24, 3)))
    count, nowhere = len(bones), np.zeros((len(bones), 3))
    shares = dict.fromkeys(("markers", "prior", "anatomical", "image", "shape", "placement"), energy / 6)
    return Candidate(
        hypothesis=0, refined=True, energies=shares, energy=energy, bone=np.array(bones), vertex=np.arange(count),
        part="left leg", heading_deg=0.0, camera=CameraResult(np.eye(3), np.zeros(3), 900.0, (640, 480), 4.0),
        rest=nowhere, dirs=np.zeros((count, 3, 10)), weights=np.eye(24)[bones], surface=nowhere,
        normal=np.tile([0.0, 0, 1], (count, 1)), betas=np.zeros(10), rotations=rotations, trans=np.zeros((50, 3)),
        trace=(energy,),
    )  # fmt: skip


def judged(margin: float, swing_deg: float = 90.0, bones: list[int] = LEGS) -> Orientation:
    other = [*ARM, *ARM][: len(bones)]
    return judge((candidate(10.0, bones, swing_deg), candidate(10.0 * margin, other, swing_deg)))


def test_the_confidence_rises_with_the_margin_from_a_half_at_a_tie() -> None:
    found = [judged(margin) for margin in MARGINS]
    assert [one.margin for one in found] == pytest.approx(MARGINS)
    assert all(one.runner_up == 1 for one in found)
    stated = [one.confidence for one in found]
    assert stated[0] == pytest.approx(0.5, abs=0.02)
    assert (np.diff(stated) > 0).all(), stated
    assert 0.98 < stated[-1] <= 1, stated


@pytest.mark.parametrize(("margin", "published"), [(1.13, 0.74), (1.27, 0.89)])
def test_the_confidence_is_the_calibrated_one(margin: float, published: float) -> None:
    """Of markers that hold the pelvis: read off some 400 sessions."""
    assert judged(margin).confidence == pytest.approx(published, abs=0.02)


@pytest.mark.parametrize(("margin", "right", "runs"), [(1.45, 14, 18), (2.45, 29, 31)])
def test_of_a_limb_alone_the_same_margin_says_less(margin: float, right: int, runs: int) -> None:
    """Shares of synthetic sessions that were right, margins from 1.3 to 1.7 and above, at the median of each."""
    limb = judged(margin, bones=LEG).confidence
    assert limb < judged(margin).confidence
    assert limb == pytest.approx(right / runs, abs=0.06)


def test_a_subject_that_stands_still_is_never_sure_however_large_the_margin() -> None:
    moving, still = judged(4.0), judged(4.0, swing_deg=2.0)
    assert moving.confidence > 0.9
    assert not any("hardly moves" in words for words in moving.warnings)
    assert still.confidence <= 0.6
    assert any("hardly moves" in words for words in still.warnings)
    assert judged(1.0, swing_deg=2.0).confidence <= 0.5 + 0.02, "the cap raises nothing"


def test_a_whole_body_that_stands_still_is_told_by_its_shape_where_the_answer_is_clear() -> None:
    whole = [*range(22)]
    far, close = ((candidate(10.0, whole, 2.0), candidate(energy, whole[::-1], 2.0)) for energy in (15.0, 12.0))
    clear = judge(far, mirror=0.7)
    assert clear.confidence > 0.95 and clear.warnings == () and clear.mirror == 0.7
    for unclear in (judge(close, mirror=0.7), judge(far, mirror=0.9), judge(far, mirror=2.0), judge(far)):
        assert unclear.confidence == 0.6 and "hardly moves" in unclear.warnings[0]
    apart = judge((candidate(10.0, whole[1:10], 2.0), candidate(15.0, whole[10:19], 2.0)), mirror=0.7)
    assert apart.confidence == 0.6, "two legs and the lower back are no whole body"


def test_a_whole_body_is_no_limb_even_where_no_marker_sits_on_the_pelvis() -> None:
    names = "right_hip right_knee left_knee left_ankle spine2 spine3 left_shoulder right_shoulder left_elbow head neck"
    bones = [INDEX[name] for name in names.split()]
    assert judge((candidate(10.0, bones, 90.0), candidate(15.0, bones[::-1], 90.0))).confidence > 0.95


def test_the_nearest_different_answer_is_the_rival() -> None:
    best, alike, rival, coarse = (candidate(energy, bones, 90.0) for energy, bones in
                                  ((10.0, LEG), (10.1, LEG), (15.0, ARM), (10.2, ARM)))  # fmt: skip
    object.__setattr__(coarse, "refined", False)
    found = judge((best, alike, rival, coarse))
    assert found.runner_up == 2, "the same answer again and one that was never refined say nothing"
    assert found.margin == pytest.approx(1.5)


def test_a_pinned_candidate_is_as_sure_as_the_ranking_says() -> None:
    """The two shares of two rivals are one whole; the warnings of the ranking stay, and who chose is said apart."""
    still = judge((candidate(10.0, LEG, 2.0), candidate(11.0, ARM, 2.0)))
    assert any("hardly moves" in said for said in still.warnings) and len(still.warnings) == 2
    first, said = chosen_by_hand(still, 0, STEEPNESS_OF_LIMBS)
    assert first == still.confidence, "the best stays what it was"
    second, said = chosen_by_hand(still, 1, STEEPNESS_OF_LIMBS)
    assert second == pytest.approx(1 - first) and second < 0.5
    assert said[0].startswith("Candidate 2 was pinned by hand") and f"{100 * second:.0f} %" in said[0]
    assert said[1:] == still.warnings


def test_a_pin_on_the_same_answer_again_says_what_the_best_says() -> None:
    ranked = judge((candidate(10.0, LEG, 90.0), candidate(10.1, LEG, 90.0), candidate(15.0, ARM, 90.0)))
    assert chosen_by_hand(ranked, 1, STEEPNESS_OF_LIMBS)[0] == ranked.confidence


def test_a_pin_on_what_the_search_dropped_goes_by_how_far_it_was_behind() -> None:
    best, dropped, never = candidate(10.0, LEG, 90.0), candidate(3.0, ARM, 90.0), candidate(2.0, ARM, 90.0)
    for one, behind in ((dropped, 1.5), (never, float("nan"))):
        object.__setattr__(one, "refined", False)
        object.__setattr__(one, "behind", behind)
    ranked = judge((best, dropped, never))
    assert chosen_by_hand(ranked, 1, STEEPNESS_OF_LIMBS)[0] == pytest.approx(1 - ranked.confidence)
    assert chosen_by_hand(ranked, 2, STEEPNESS_OF_LIMBS)[0] == pytest.approx(1 - UNRIVALLED)
