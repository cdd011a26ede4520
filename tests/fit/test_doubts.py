"""Every rule on inputs small enough to see through: what it catches, what it leaves alone, and what it says."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3, mean_rotation
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from markerscope.solver.fit.doubts.agreement import agreement, disagreement
from markerscope.solver.fit.doubts.clouds import clouds, one_body, several, taken_cloud
from markerscope.solver.fit.doubts.doubt import CAP, Doubt, Evidence, named
from markerscope.solver.fit.doubts.far import far, suspects
from markerscope.solver.fit.doubts.mirror import both_sides, in_mirror, mirrored, video_in_doubt
from markerscope.solver.fit.doubts.misfit import off_the_skin, off_their_places
from markerscope.solver.fit.doubts.offset import lone_limb
from markerscope.solver.fit.doubts.picture import off_the_picture
from markerscope.solver.fit.doubts.rigid import greatest_distance, one_group
from markerscope.solver.fit.doubts.rules import RULES, verdict
from markerscope.solver.fit.doubts.still import still, still_markers
from markerscope.solver.fit.doubts.turn import camera_turn, turning_camera
from markerscope.solver.fit.lift import mirror_landmarks
from markerscope.solver.fit.state import Observations

T = 60
LEG = [INDEX[name] for name in ("left_hip", "left_knee", "left_ankle", "left_foot")]


def moving(seed: int = 0, size: float = 0.5) -> np.ndarray:
    """(T, 24, 3, 3), every joint swinging on its own course."""
    rng = np.random.default_rng(seed)
    time = np.linspace(0, 6, T)[:, None, None]
    swing = size * np.sin(rng.uniform(1, 4, (24, 3)) * time + rng.uniform(0, 6, (24, 3)))
    return exp_so3(swing)


def sound(**changed: object) -> Evidence:
    """A solve that nothing speaks against: six markers on six bones of a body that moves as in its video."""
    rotations = moving()
    evidence = Evidence(
        labels=tuple("ABCDEF"),
        joint=np.array([0, 1, 4, 2, 5, 3]),
        residual=np.full((T, 6), 0.004),
        skin=np.full(6, 0.010),
        m2s=0.010,
        affinity=0.05 * (1 - np.eye(6)),
        rotations=rotations,
        video=rotations,
        tracked=np.ones(T, dtype=bool),
        reprojection=5.0,
        image_size=(720, 1280),
        sync_confidence=0.9,
        sync_lead=60.0,
        still=np.zeros(0, dtype=int),
        cloud=np.zeros(6, dtype=int),
        taken=0,
        far=np.zeros(0, dtype=int),
    )
    return replace(evidence, **changed)  # type: ignore[arg-type]


def test_nothing_speaks_against_a_sound_solve() -> None:
    found = verdict(sound(), 0.97)
    assert found.doubts == () and found.confidence == pytest.approx(0.97, abs=0.005)
    assert found.nobody == () and found.suspect == ()


TROUBLE: dict[str, tuple[dict[str, object], str]] = {
    "several clouds": ({"cloud": np.array([0, 0, 0, 1, 1, 1])}, "part_of_cloud"),
    "still markers": ({"still": np.array([2])}, "(C)"),
    "far markers": ({"far": np.array([1, 4])}, "(B, E)"),
    "one rigid group": ({"affinity": np.full((6, 6), 0.002)}, "one piece"),
    "markers off the skin": ({"m2s": 0.045}, "45 mm from the skin"),
    "markers off their places": ({"residual": np.full((T, 6), 0.035)}, "35 mm from where"),
    "mirrored video": ({"mirror": 2.4}, "2.4 times less"),
    "off the picture": ({"reprojection": 20.0}, "20 px from the person"),
    "another movement": ({"video": moving(99)}, "correlation"),
    "turning camera": (
        {"video": exp_so3(np.linspace(0, 1.2, T)[:, None, None] * np.array([0, 1.0, 0])) @ moving()},
        "degrees",
    ),
    "lone limb": ({"joint": np.array([1, 4, 7, 10, 1, 4]), "sync_confidence": 0.25, "sync_lead": 0.3}, "left side"),
}


@pytest.mark.parametrize("kind", TROUBLE)
def test_each_rule_has_its_own_sentence_and_caps_the_confidence(kind: str) -> None:
    changed, says = TROUBLE[kind]
    found = verdict(sound(**changed), 0.99)
    assert kind in [doubt.kind for doubt in found.doubts]
    doubt = next(doubt for doubt in found.doubts if doubt.kind == kind)
    assert (says in doubt.sentence and ":" in doubt.sentence) or "." in doubt.sentence
    assert found.confidence == CAP
    assert verdict(sound(**changed), 0.3).confidence == 0.3, "a doubt makes nothing surer"


def test_there_is_an_example_of_every_rule() -> None:
    assert len(TROUBLE) == len(RULES)


@pytest.mark.parametrize(
    ("rule", "name", "just_right"),
    [
        (off_the_skin, "m2s", 0.0399),
        (off_their_places, "residual", np.full((T, 6), 0.0299)),
        (off_the_picture, "reprojection", 15.3),
        (off_the_picture, "reprojection", float("nan")),
        (one_group, "affinity", np.full((6, 6), 0.0081)),
        (mirrored, "mirror", 1.29),
        (mirrored, "mirror", float("nan")),
        (off_the_skin, "m2s", float("nan")),
    ],
)
def test_up_to_its_limit_a_rule_is_silent(
    rule: Callable[[Evidence], Doubt | None], name: str, just_right: object
) -> None:
    assert rule(sound(**{name: just_right})) is None


def test_without_landmarks_there_is_no_picture_to_be_off() -> None:
    assert off_the_picture(sound(reprojection=100.0, image_size=(0, 0))) is None


# still markers ------------------------------------------------------------------------------------------------------


def wandering(count: int, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.normal(0, 0.2, count * 3).reshape(1, count, 3) + 0.05 * np.sin(
        np.linspace(0, 9, T)[:, None, None] + rng.uniform(0, 6, (count, 3))
    )


def test_a_marker_on_a_chair_is_still() -> None:
    markers = wandering(6)
    markers[:, 2] = np.random.default_rng(1).normal([1.0, 0.0, 0.4], 0.0003, (T, 3))
    markers[10:20, 2] = np.nan
    assert still_markers(markers).tolist() == [2]


def test_a_planted_foot_and_a_person_who_stands_still_are_no_chair() -> None:
    markers = wandering(6)
    markers[:, 2] = 0.004 * np.sin(np.linspace(0, 3, T))[:, None] + [1.0, 0, 0]
    assert not len(still_markers(markers))
    assert not len(still_markers(np.zeros((T, 5, 3)) + np.arange(5)[None, :, None])), (
        "all stand: nothing moves past them"
    )
    breathing = 0.003 * np.sin(np.linspace(0, 9, T))[:, None, None] + np.arange(5.0)[None, :, None]
    breathing = np.repeat(breathing, 3, axis=2)
    breathing[:, 0] = 0.0
    assert not len(still_markers(breathing)), "of a person who stands a foot may not move at all"


# clouds -------------------------------------------------------------------------------------------------------------


def person(count: int, at: float, seed: int) -> np.ndarray:
    """(T, count, 3) m, a column of markers 0.1 m apart that sways as one."""
    sway = 0.1 * np.sin(np.linspace(0, 9, T) + seed)[:, None, None] * np.array([1.0, 0.5, 0])
    column = np.stack([np.full(count, at), np.zeros(count), 0.1 * np.arange(count)], axis=1)
    return column + sway


def test_two_people_are_two_clouds_the_larger_first() -> None:
    both = np.concatenate([person(9, 0.0, 1), person(12, 0.7, 3)], axis=1)
    assert clouds(both).tolist() == [1] * 9 + [0] * 12


def test_a_few_markers_that_are_near_belong_to_the_person() -> None:
    raised_hand = person(3, 0.45, 3)  # nearer than half a metre, moving on its own
    assert clouds(np.concatenate([person(14, 0.0, 1), raised_hand], axis=1)).tolist() == [0] * 17
    a_chair = person(3, 0.8, 3)
    assert clouds(np.concatenate([person(14, 0.0, 1), a_chair], axis=1)).tolist() == [0] * 14 + [1] * 3


def test_one_or_two_lone_markers_are_no_cloud() -> None:
    lone = np.full((T, 2, 3), [5.0, 0, 0])
    lone[:, 1] = [0, 7.0, 0]
    assert clouds(np.concatenate([person(14, 0.0, 1), lone], axis=1)).tolist() == [0] * 14 + [-1, -1]


def test_never_seen_together_is_not_together() -> None:
    both = np.concatenate([person(9, 0.0, 1), person(9, 0.1, 1)], axis=1)
    both[: T // 2, 9:] = np.nan
    both[T // 2 :, :9] = np.nan
    assert set(clouds(both)) == {0, 1}


def test_the_cloud_nearest_to_the_video_is_taken_unless_another_is_asked_for() -> None:
    cloud = np.array([0] * 12 + [1] * 9 + [2] * 3)
    costs = {0: 0.02, 1: 0.005, 2: 0.0001}
    cost = lambda columns: costs[int(cloud[columns[0]])]  # noqa: E731
    assert taken_cloud(cloud, None, cost) == 1, "three markers come near to anything: they are nobody to be solved"
    assert taken_cloud(cloud, 3, cost) == 2
    limb_of_another = np.array([0] * 40 + [1] * 9)
    assert taken_cloud(limb_of_another, None, lambda columns: costs[int(limb_of_another[columns[0]])]) == 0
    for one in (cloud, np.zeros(5, int)):
        with pytest.raises(InputError, match=f"cloud 9 was asked for, the markers form {one.max() + 1}"):
            taken_cloud(one, 9, cost)
    assert taken_cloud(np.zeros(5, int), None, cost) == 0


def test_what_one_body_covers_is_one_body() -> None:
    cloud = np.array([0] * 12 + [1] * 9 + [2] * 3 + [-1])
    squares = np.concatenate([np.full(12, 0.003), np.full(9, 0.01), np.full(3, 0.09), [0.0]])
    cost = lambda columns: float(squares[columns].mean())  # noqa: E731
    assert one_body(cloud, cost).tolist() == [0] * 21 + [1] * 3 + [-1], "100 mm are within reach, 300 are not"
    squares[12:21] = 0.05
    assert one_body(cloud, cost).tolist() == cloud.tolist()
    squares[-4:-1] = 0.01
    assert one_body(cloud, cost).tolist() == [0] * 12 + [1] * 9 + [0] * 3 + [-1]


def test_the_other_clouds_are_named() -> None:
    doubt = several(sound(cloud=np.array([0, 0, 0, 1, 1, 1]), taken=1))
    assert doubt is not None and doubt.markers == (0, 1, 2)
    assert "Cloud 2 was solved" in doubt.sentence and "(A, B, C)" in doubt.sentence
    assert verdict(sound(cloud=np.array([0, 0, 0, 1, 1, 1]), taken=1), 1.0).nobody == (0, 1, 2)


def test_a_long_list_of_names_is_cut() -> None:
    assert named([f"M{i}" for i in range(20)], range(20)).endswith("M6 and 13 more")
    assert named(["a", "b"], [1]) == "b"


# far and suspect markers --------------------------------------------------------------------------------------------


def test_markers_off_their_places_are_suspect_and_far_ones_are_said() -> None:
    residual = np.full((T, 6), 0.004)
    residual[:, 3] = 0.025
    residual[:20, 4] = 0.5  # a third of the time: a swap or a flicker, not somebody else's
    assert suspects(residual).tolist() == [3]
    assert far(sound(residual=residual)) is None
    residual[:, 5] = 0.11
    doubt = far(sound(residual=residual))
    assert doubt is not None and doubt.markers == (5,)
    assert far(sound(skin=np.array([0.01, 0.01, 0.13, 0.01, 0.01, np.nan]))) is not None


@pytest.mark.filterwarnings("error")
def test_a_marker_that_was_never_seen_says_nothing() -> None:
    residual = np.full((T, 6), 0.004)
    residual[:, 0] = np.nan
    assert not len(suspects(residual)) and far(sound(residual=residual)) is None


# one group ----------------------------------------------------------------------------------------------------------


def test_markers_of_one_bone_are_one_group_even_where_the_skin_moves() -> None:
    doubt = one_group(sound(joint=np.full(6, INDEX["left_hip"])))
    assert doubt is not None and "one bone" in doubt.sentence


def test_left_out_markers_do_not_hide_that_the_rest_is_one_piece() -> None:
    affinity = np.full((6, 6), 0.002)
    affinity[5] = affinity[:, 5] = 0.3
    assert one_group(sound(affinity=affinity, joint=np.array([1, 4, 1, 4, 1, -1]))) is not None
    assert one_group(sound(affinity=affinity)) is None


def test_a_limb_held_still_is_longer_than_any_bone() -> None:
    stiff = np.full((6, 6), 0.002)
    assert one_group(sound(affinity=stiff, span=0.49)) is not None
    assert one_group(sound(affinity=stiff, span=0.55)) is None
    assert one_group(sound(affinity=stiff, span=0.55, joint=np.full(6, 1))) is not None, "all on one bone all the same"


def test_the_greatest_distance_is_between_points_that_are_there() -> None:
    assert greatest_distance(np.array([[0, 0, 0], [0.3, 0.4, 0], [9, 9, np.nan]])) == pytest.approx(0.5)
    assert np.isnan(greatest_distance(np.full((2, 3), np.nan)))


# video --------------------------------------------------------------------------------------------------------------


def test_agreement_is_a_correlation_about_each_joint_s_mean() -> None:
    rotations, held = moving(), np.array([*LEG, 0, 2, 5])
    tracked = np.ones(T, dtype=bool)
    assert agreement(rotations, rotations, tracked, held) == pytest.approx(1.0)
    offset = exp_so3(np.random.default_rng(5).normal(0, 0.3, (24, 3)))
    assert agreement(rotations, rotations @ offset, tracked, held) > 0.8, "a constant error is no other movement"
    assert abs(agreement(rotations, moving(99), tracked, held)) < 0.5


def test_joints_that_no_marker_holds_or_that_stand_do_not_count() -> None:
    rotations, tracked = moving(), np.ones(T, dtype=bool)
    assert np.isnan(agreement(rotations, rotations, tracked, np.array(LEG[:3]))), "two joints are too few"
    standing = moving(size=0.02)
    assert np.isnan(agreement(standing, standing, tracked, np.arange(24)))
    assert np.isnan(agreement(rotations, rotations, np.zeros(T, dtype=bool), np.arange(24)))
    assert disagreement(sound(tracked=np.zeros(T, dtype=bool))) is None


def test_a_camera_s_turn_is_told_whatever_the_person_does() -> None:
    rotations, tracked = moving(), np.ones(T, dtype=bool)
    tilt = exp_so3(np.array([0.3, -2.0, 0.5]))
    spread, drift = camera_turn(rotations, tilt @ rotations, tracked)
    assert spread < 1e-4 and drift < 1e-4, "a camera that stands may stand anyhow"
    rotations[:, 0] = exp_so3(np.array([0.1, 0.4, 0.2]))
    pan = exp_so3(np.radians(60) * np.linspace(0, 1, T)[:, None] * np.array([0, 1.0, 0]))
    spread, drift = camera_turn(rotations, pan[:, None] @ rotations, tracked)
    assert drift == pytest.approx(40, abs=1), "from the middle of the first third to that of the last"
    assert spread == pytest.approx(60 / np.sqrt(12), abs=0.5)
    late = tracked & (np.arange(T) >= 50)
    assert camera_turn(rotations, pan[:, None] @ rotations, late)[1] < 10, "only tracked frames are looked at"


def test_a_constant_error_of_the_video_is_no_turn_of_the_camera_where_the_person_turns_round() -> None:
    rotations = moving()
    rotations[:, 0] = exp_so3(np.linspace(0, np.pi, T)[:, None] * np.array([0.0, 0, 1]))
    video = rotations.copy()
    video[:, 0] = exp_so3(np.array([0.3, -2.0, 0.5])) @ rotations[:, 0] @ exp_so3(np.radians([20, 10, 15.0]))
    spread, drift = camera_turn(rotations, video, np.ones(T, dtype=bool))
    assert spread < 1 and drift < 1


def test_a_shaking_camera_is_told_by_its_spread() -> None:
    rotations = moving()
    shake = exp_so3(np.radians(60) * np.sin(np.linspace(0, 20 * np.pi, T))[:, None] * np.array([0, 1.0, 0]))
    doubt = turning_camera(sound(video=shake[:, None] @ rotations))
    assert doubt is not None and "to and fro" in doubt.sentence


def test_a_limb_that_does_not_hold_the_pelvis_says_nothing_of_the_camera() -> None:
    pan = exp_so3(np.linspace(0, 1.2, T)[:, None, None] * np.array([0, 1.0, 0])) @ moving()
    assert turning_camera(sound(video=pan, joint=np.array([1, 2, 4, 5, 7, 8]))) is not None, "two legs do"
    assert turning_camera(sound(video=pan, joint=np.array([1, 4, 7, 10, 1, 4]))) is None
    assert turning_camera(sound(video=pan, joint=np.array([1, 4, 7, 10, 1, 0]))) is None, "nor one on the hip bone"
    assert turning_camera(sound(video=pan, joint=np.array([1, 4, 7, 0, 3, 0]))) is not None, "three hold it"
    assert turning_camera(sound(video=pan, joint=np.array([16, 17, 18, 19, 20, 21]))) is None


def test_a_lone_limb_is_doubted_only_where_another_offset_is_as_good() -> None:
    leg = np.array([1, 4, 7, 10, 1, 4])
    said = lone_limb(sound(joint=leg, sync_confidence=0.53, sync_lead=6.4, sync_rival=0.0))
    assert said is not None and "+0.00 s is nearly as good" in said.sentence and "period" in said.sentence
    assert lone_limb(sound(joint=leg)) is None
    assert lone_limb(sound(joint=leg, sync_confidence=0.2, sync_lead=16.0)) is None, "no other offset comes near"
    assert lone_limb(sound(sync_confidence=0.2, sync_lead=0.3)) is None, "markers on both sides tell them apart"
    assert lone_limb(sound(joint=np.array([0, 3, 6, 9, 12, 15]), sync_confidence=0.2, sync_lead=0.3)) is None


def test_a_lone_limb_of_which_no_other_offset_could_be_compared_is_doubted_unless_it_was_given() -> None:
    leg, none = np.array([1, 4, 7, 10, 1, 4]), float("inf")
    said = lone_limb(sound(joint=leg, sync_confidence=0.2, sync_lead=none))
    assert said is not None and "nearly as good" not in said.sentence
    assert lone_limb(sound(joint=leg, sync_confidence=1.0, sync_lead=none)) is None


def test_the_side_of_a_lone_limb_is_no_surer_than_the_offset() -> None:
    leg = np.array([1, 4, 7, 10, 1, 4])
    assert verdict(sound(joint=leg, sync_confidence=0.5), 0.97).confidence == pytest.approx((0.97 + 0.5) / 2)
    assert verdict(sound(joint=leg, sync_confidence=0.5), 0.4).confidence == pytest.approx(0.4), (
        "it makes nothing surer"
    )
    assert verdict(sound(joint=leg, sync_confidence=1.0), 0.97).confidence == pytest.approx(0.97)
    assert verdict(sound(joint=leg, sync_confidence=0.5), 1.0).confidence == pytest.approx(0.75), "none is beyond it"


def test_a_whole_body_is_no_surer_than_that_its_offset_is_not_grossly_wrong() -> None:
    by_lead = [verdict(sound(sync_lead=lead), 0.97).confidence for lead in (0.0, 1.0, 9.6, 16.0, 60.0, float("inf"))]
    assert by_lead[0] == pytest.approx(0.5) and by_lead[1] < 0.6, "another offset is as good: a guess"
    assert 0.6 < by_lead[2] < 0.85 and by_lead[3] > 0.85 and by_lead[4] > 0.96
    assert by_lead[:5] == sorted(by_lead[:5])
    assert verdict(sound(sync_lead=0.0), 0.3).confidence == pytest.approx(0.3), "it makes nothing surer"
    none = float("inf")
    assert verdict(sound(sync_lead=none, sync_confidence=0.2), 0.97).confidence < 0.6, "no other could be compared"
    assert verdict(sound(sync_lead=none, sync_confidence=1.0), 0.97).confidence == pytest.approx(0.97), "it was given"


# mirror -------------------------------------------------------------------------------------------------------------


def seen_by_video(rotations: np.ndarray) -> Observations:
    count = len(mirror_landmarks())
    image = np.random.default_rng(3).uniform(0, 700, (T, count, 2))
    return Observations(np.zeros((T, 4, 3)), rotations, np.ones(T, bool), image, np.ones((T, count)), (720, 1280))


def test_the_mirror_image_of_the_mirror_image_is_the_video() -> None:
    seen = seen_by_video(moving())
    once, twice = in_mirror(seen), in_mirror(in_mirror(seen))
    np.testing.assert_allclose(twice.prior, seen.prior, atol=1e-12)
    np.testing.assert_allclose(twice.image, seen.image, atol=1e-9)
    assert np.linalg.det(once.prior).min() > 0.99, "rotations stay rotations"


def test_a_mirrored_right_knee_is_a_left_knee_bent_as_far_and_out_is_out() -> None:
    rotations = np.tile(np.eye(3), (T, 24, 1, 1))
    rotations[:, INDEX["right_knee"]] = exp_so3(np.array([0.7, 0, 0]))
    rotations[:, INDEX["right_shoulder"]] = exp_so3(np.array([0, 0, 0.4]))
    other = in_mirror(seen_by_video(rotations)).prior[0]
    np.testing.assert_allclose(other[INDEX["left_knee"]], exp_so3(np.array([0.7, 0, 0])), atol=1e-12)
    np.testing.assert_allclose(other[INDEX["left_shoulder"]], exp_so3(np.array([0, 0, -0.4])), atol=1e-12)
    np.testing.assert_allclose(other[INDEX["right_knee"]], np.eye(3), atol=1e-12)


def test_landmarks_change_sides_and_the_picture_is_flipped() -> None:
    seen = seen_by_video(moving())
    from markerscope.solver.core.landmarks import LANDMARKS
    from markerscope.solver.fit.lift import _UNUSED

    used = [name for name in LANDMARKS if name not in _UNUSED]
    left, right = used.index("left_knee"), used.index("right_knee")
    other = in_mirror(seen)
    np.testing.assert_allclose(other.image[:, left, 0], 720 - seen.image[:, right, 0])
    np.testing.assert_allclose(other.image[:, left, 1], seen.image[:, right, 1])


def test_the_mirror_is_tried_where_the_video_is_in_doubt() -> None:
    rotations, joint = moving(), np.array([*LEG, 0, 2, 5, 8])
    assert not video_in_doubt(rotations, seen_by_video(rotations), joint, 5.0)
    assert video_in_doubt(rotations, seen_by_video(rotations), joint, 50.0)
    assert video_in_doubt(rotations, seen_by_video(moving(99)), joint, 5.0)
    assert both_sides(joint) and not both_sides(np.array(LEG))
    assert mirror_index()[INDEX["left_knee"]] == JOINTS.index("right_knee")


def test_a_mean_rotation_is_the_middle_of_a_sweep() -> None:
    sweep = exp_so3(np.linspace(-0.5, 1.1, 9)[:, None] * np.array([0.0, 0.0, 1.0]))
    np.testing.assert_allclose(mean_rotation(sweep), exp_so3(np.array([0, 0, 0.3])), atol=1e-12)


def test_a_doubt_about_nothing_in_particular_has_no_figure() -> None:
    assert still(sound()) is None and np.isnan(Doubt("kind", "sentence").value)
