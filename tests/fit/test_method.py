"""The default method finds a known body again from its markers and a poor video."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.method import fit, localize, orient
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from tests.fit.conftest import Scene, simulate

QUICK = LocalizeSettings(yaws=8, few=8, many=16, keep=10)


def _solved(scene: Scene, camera: CameraResult | None = None) -> tuple[Orientation, FittedMotion]:
    count = scene.seen.markers.shape[1]
    found = localize(scene.body, scene.seen, np.zeros(count, bool), QUICK, camera)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, OrientSettings(refine=3), camera)
    time = np.arange(len(scene.joints)) / 30
    return ranked, fit(scene.body, scene.seen, scene.landmarks, found, ranked, time, FitSettings(), silent)


def _same_side(found: np.ndarray, truth: np.ndarray) -> float:
    sides = [{JOINTS[a].split("_")[0], JOINTS[b].split("_")[0]} for a, b in zip(found, truth, strict=True)]
    return float(np.mean([not {"left", "right"} <= side for side in sides]))


def test_a_whole_body_is_found(scene: Scene) -> None:
    ranked, motion = _solved(scene)
    error = 1000 * np.linalg.norm(motion.joints - scene.joints, axis=2)[:, :22].mean()
    assert error < 25, f"joints are {error:.1f} mm off (synthetic, 36 markers)"
    assert _same_side(motion.marker_joint, scene.bones) == 1
    assert ranked.confidence > 0.9, f"confidence {ranked.confidence} at margin {ranked.margin}"
    assert np.nanmedian(motion.residual) < 0.006
    turn = np.degrees(np.arccos((np.trace(scene.camera.R_lab_cam.T @ motion.camera.R_lab_cam) - 1) / 2))
    assert turn < 5, f"camera is turned by {turn:.1f} degrees"


def test_a_single_leg_is_found_on_its_side_when_the_camera_is_known(free_body: Body) -> None:
    whole = simulate(free_body, 6, markers=60)
    legs = np.isin(whole.bones, [JOINTS.index(f"left_{j}") for j in ("hip", "knee", "ankle")])
    seen = whole.seen
    part = Scene(
        whole.body, whole.pose, whole.joints, whole.bones[legs], whole.camera,
        type(seen)(seen.markers[:, legs], seen.prior, seen.tracked, seen.image, seen.visibility, seen.image_size),
        whole.landmarks,
    )  # fmt: skip
    camera = whole.camera
    known = CameraResult(
        camera.R_lab_cam, camera.centre - camera.R_lab_cam @ camera.shift, camera.focal, seen.image_size, 4.0
    )
    _, motion = _solved(part, known)
    assert _same_side(motion.marker_joint, part.bones) == 1
    error = 1000 * np.linalg.norm(motion.joints - part.joints, axis=2)[:, [4, 7]].mean()
    assert error < 45, f"knee and ankle are {error:.1f} mm off (synthetic, {legs.sum()} markers)"


def test_too_few_markers_are_refused(scene: Scene) -> None:
    with pytest.raises(InputError, match="markers are seen in enough frames"):
        localize(scene.body, scene.seen, np.arange(36) > 1, QUICK)


def test_a_candidate_that_is_not_there_is_refused(scene: Scene) -> None:
    found = localize(scene.body, scene.seen, np.zeros(36, bool), LocalizeSettings(yaws=4, few=4, many=6, keep=2))
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, OrientSettings(refine=1))
    with pytest.raises(InputError, match="pin one of"):
        fit(scene.body, scene.seen, scene.landmarks, found, ranked, np.arange(60.0), FitSettings(candidate=99))


def test_a_reflection_across_the_room_is_left_alone(scene: Scene) -> None:
    far = np.concatenate([scene.seen.markers, np.full((60, 1, 3), 30.0)], axis=1)
    seen = replace(scene.seen, markers=far)
    found = localize(scene.body, seen, np.zeros(37, bool), QUICK)
    assert 36 not in found.markers
    assert len(found.markers) == 36


@pytest.mark.parametrize("name", ["yaws", "few", "many", "keep"])
def test_settings_that_cannot_work_are_refused(name: str) -> None:
    with pytest.raises(InputError, match=name):
        LocalizeSettings(**{name: 0})


def test_in_a_short_recording_only_refined_answers_are_compared(free_body: Body) -> None:
    scene = simulate(free_body, 8, frames=10)
    found = localize(scene.body, scene.seen, np.zeros(36, bool), LocalizeSettings(yaws=4, few=14, many=10, keep=8))
    assert np.array_equal(found.few, found.many)
    ranked = orient(scene.body, scene.seen, scene.landmarks, found, OrientSettings(refine=2))
    assert 1 <= sum(candidate.refined for candidate in ranked.candidates) <= 2


@pytest.mark.filterwarnings("error")
def test_frames_without_any_marker_are_passed_over_in_silence(scene: Scene) -> None:
    markers = scene.seen.markers.copy()
    markers[20:25] = np.nan
    found = localize(scene.body, replace(scene.seen, markers=markers), np.zeros(36, bool), QUICK)
    assert not np.isin(found.many, np.arange(20, 25)).any()
