"""Other people's markers beside a person's, through the stages that have to leave them out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit import confidence, method
from markerscope.solver.fit.bundle import Fit
from markerscope.solver.fit.doubts.clouds import clouds
from markerscope.solver.fit.doubts.mirror import in_mirror
from markerscope.solver.fit.method import fit, in_use, localize, orient
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from tests.fit.conftest import Scene, simulate

QUICK = LocalizeSettings(yaws=6, few=8, many=20, keep=24)
WIDE = OrientSettings(refine=2)


def with_markers(scene: Scene, more: np.ndarray) -> Scene:
    return replace(scene, seen=replace(scene.seen, markers=np.concatenate([scene.seen.markers, more], axis=1)))


def test_still_markers_are_left_out_and_listed(scene: Scene) -> None:
    stand = np.random.default_rng(2).normal([0.3, 0.2, 0.5], 0.0003, (60, 2, 3))
    found = localize(scene.body, with_markers(scene, stand).seen, np.zeros(38, bool), QUICK)
    assert found.still.tolist() == [36, 37]
    assert not np.isin([36, 37], found.markers).any()
    kept = localize(
        scene.body, with_markers(scene, stand).seen, np.zeros(38, bool), replace(QUICK, leave_out_still=False)
    )
    assert np.isin([36, 37], kept.markers).all(), "where that is wished they stay"


def test_of_two_people_the_one_of_the_video_is_solved_unless_another_is_asked_for(free_body: Body) -> None:
    scene, other = simulate(free_body, 4, markers=20), simulate(free_body, 4, markers=24)
    both = with_markers(scene, other.seen.markers[::-1] * [-1, 1, 1] + np.array([3.0, 0, 0]))
    found = localize(scene.body, both.seen, np.zeros(44, bool), QUICK)
    assert found.cloud.tolist() == [1] * 20 + [0] * 24
    assert found.taken == 1 and found.markers.max() < 20
    asked = localize(scene.body, both.seen, np.zeros(44, bool), replace(QUICK, part_of_cloud=1))
    assert asked.taken == 0 and asked.markers.min() == 20


def test_one_body_with_a_bare_middle_is_one_body(free_body: Body) -> None:
    scene = simulate(free_body, 6, markers=24)
    assert clouds(scene.seen.markers).max() == 1, "its arms and legs alone carry markers, half a metre apart"
    found = localize(scene.body, scene.seen, np.zeros(24, bool), QUICK)
    assert found.cloud.max() == 0 and len(found.markers) == 24


def test_a_part_of_the_cloud_is_counted_from_one() -> None:
    with pytest.raises(InputError, match="part_of_cloud"):
        LocalizeSettings(part_of_cloud=0)


def test_markers_near_the_body_that_fit_no_place_are_nobody_s(scene: Scene) -> None:
    rng = np.random.default_rng(7)
    course = 0.35 * np.sin(np.linspace(0, 25, 60)[:, None, None] + rng.uniform(0, 6, (1, 4, 3)))
    stray = np.nanmedian(scene.seen.markers, axis=(1,), keepdims=True) + course
    crowd = with_markers(scene, stray)
    found = localize(crowd.body, crowd.seen, np.zeros(40, bool), QUICK)
    assert np.isin(range(36, 40), found.markers).all(), "they are too near to be a cloud of their own"
    ranked = orient(crowd.body, crowd.seen, crowd.landmarks, found, WIDE)
    assert ranked.far.tolist() == [36, 37, 38, 39]
    assert np.isnan(in_use(crowd.seen, found, ranked).markers[:, 36:]).all()
    motion = fit(crowd.body, crowd.seen, crowd.landmarks, found, ranked, np.arange(60) / 30, FitSettings())
    assert (motion.marker_joint[36:] == -1).all() and (motion.marker_joint[:36] >= 0).all()
    assert np.isnan(motion.placed[:, 36:]).all()
    error = 1000 * np.linalg.norm(motion.joints - scene.joints, axis=2)[:, :22].mean()
    assert error < 25, f"joints are {error:.1f} mm off (synthetic, 36 of 40 markers are the person's)"


def test_a_fit_that_has_not_settled_leaves_no_marker_of_the_person_out(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = method.relax

    def unsettled(*given: object, **how: object) -> tuple[Fit, ...]:
        best, *others = whole(*given, **how)  # type: ignore[arg-type]
        rotations = best.state.pose.rotations.copy()
        rotations[:, INDEX["left_shoulder"]] @= exp_so3(np.array([0, 0, 1.2]))
        return replace(best, state=replace(best.state, pose=replace(best.state.pose, rotations=rotations))), *others

    monkeypatch.setattr(method, "relax", unsettled)
    found = localize(scene.body, scene.seen, np.zeros(36, bool), QUICK)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, WIDE)
    assert not len(ranked.far), "an arm that was raised out of its markers comes back to them"
    refined = [one.energy for one in ranked.candidates if one.refined]
    assert refined == sorted(refined) and all(one.refined for one in ranked.candidates[: len(refined)])
    assert (scene.bones[found.markers] == ranked.candidates[0].bone).mean() > 0.8


def test_without_that_wish_every_marker_stays(scene: Scene) -> None:
    found = localize(scene.body, scene.seen, np.zeros(36, bool), QUICK)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, replace(WIDE, leave_out_far=False))
    assert not len(ranked.far)


def test_a_clear_answer_rests_on_a_rival_that_was_followed(scene: Scene) -> None:
    found = localize(scene.body, scene.seen, np.zeros(36, bool), QUICK)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, WIDE)
    assert ranked.runner_up != 0, "an answer is not its own rival"
    if ranked.runner_up < 0:
        assert ranked.confidence <= 0.95, "no rival left is no certainty"
    elif not ranked.candidates[ranked.runner_up].refined:
        assert ranked.margin == ranked.candidates[ranked.runner_up].behind > 1.3
    assert np.isnan(ranked.mirror), "nothing is wrong with the video: its mirror image was not asked"


def test_a_mirrored_video_is_found_by_its_mirror_image(scene: Scene) -> None:
    mirrored = replace(scene, seen=in_mirror(scene.seen))
    found = localize(scene.body, mirrored.seen, np.zeros(36, bool), QUICK)
    ranked = orient(scene.body, mirrored.seen, mirrored.landmarks, found, WIDE)
    assert ranked.mirror > 1.5, f"the right way round it costs {ranked.mirror:.2f} times less"


def test_the_mirror_image_is_tried_where_it_lies_nearer_though_nothing_else_is_wrong(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(method, "video_in_doubt", lambda *given: False)
    monkeypatch.setattr(method, "loose_share", lambda *given: 0.0)
    for seen, tried in ((scene.seen, False), (in_mirror(scene.seen), True)):
        found = localize(scene.body, seen, np.zeros(36, bool), QUICK)
        ranked = orient(scene.body, seen, scene.landmarks, found, replace(WIDE, leave_out_far=False))
        assert ranked.margin > 1.15, "a near tie would be a reason of its own"
        assert (ranked.mirror > 1.3) == tried and np.isnan(ranked.mirror) != tried


def test_the_mirror_image_is_tried_where_a_whole_body_hardly_moves(
    scene: Scene, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(confidence, "stillness", lambda *given: ("The person hardly moves.",))
    found = localize(scene.body, scene.seen, np.zeros(36, bool), QUICK)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, WIDE)
    assert ranked.mirror < 0.7 and ranked.warnings == (), "its shape tells it, and not that of the mirrored video"
    untried = orient(scene.body, scene.seen, scene.landmarks, found, WIDE, try_mirror=False)
    assert np.isnan(untried.mirror) and untried.confidence <= 0.6
