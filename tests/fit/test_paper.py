"""The published method on simulated sessions: what it finds, what it keeps for inspection, and its baseline."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.fit.localize import R_LAB_UPRIGHT_CAMERA
from markerscope.solver.fit.published.localize import localize_paper
from markerscope.solver.fit.published.motion import full_shape, motion_of
from markerscope.solver.fit.published.ranking import orientation_of
from markerscope.solver.fit.published.registration import register
from markerscope.solver.fit.published.results import BodyState, PaperLocalization, PaperSolve
from markerscope.solver.fit.published.settings import PaperFitSettings, PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.published.solve import solve_paper
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.fit.state import Observations
from markerscope.solver.pipeline.codec import decode, encode
from tests.fit.conftest import Scene, simulate

CAP = 24
FRAMES = 24


@pytest.fixture(scope="module")
def short(free_body: Body) -> Scene:
    """A whole body for 4 s, six frames a second."""
    return simulate(free_body, 4, frames=FRAMES, markers=36)


@pytest.fixture(scope="module")
def time() -> np.ndarray:
    return np.arange(FRAMES) / 6


@pytest.fixture(scope="module")
def found(short: Scene, time: np.ndarray) -> PaperLocalization:
    return localize_paper(short.body, short.seen, time, np.arange(36) % 14, PaperLocalizeSettings())


@pytest.fixture(scope="module")
def solved(short: Scene, found: PaperLocalization) -> PaperSolve:
    return solve_paper(short.body, short.seen, found, PaperSolveSettings(iterations=CAP))


@pytest.fixture(scope="module")
def ranked(short: Scene, found: PaperLocalization, solved: PaperSolve) -> Orientation:
    return orientation_of(short.body, short.seen, short.landmarks, found, solved)


@pytest.fixture(scope="module")
def motion(
    short: Scene, time: np.ndarray, found: PaperLocalization, solved: PaperSolve, ranked: Orientation
) -> FittedMotion:
    return motion_of(short.body, short.seen, time, found, solved, ranked)


def joint_error(scene: Scene, state: BodyState) -> float:
    """Mm, mean over the frames in use and all but the hands."""
    betas = full_shape(scene.body, state.betas)
    joints = scene.body.pose(state.rotations, betas, state.trans, want_vertices=False)[1]
    return float(1000 * np.linalg.norm(joints - scene.joints, axis=2)[:, :22].mean())


def turned(one: float, other: float) -> float:
    return abs((one - other + 180) % 360 - 180)


def true_yaw(scene: Scene) -> float:
    """Degrees of the camera's heading from the one that a yaw of 0 stands for."""
    view = scene.camera.R_lab_cam[:, 2]
    return float(np.degrees(np.arctan2(view[1], view[0]))) - 90


def test_a_large_box_makes_the_whole_body_of_it(short: Scene, found: PaperLocalization) -> None:
    assert found.box > 0.4
    assert found.whole_body
    assert (found.groups, found.chains, len(found.pruned)) == (14, 324, 57)
    assert found.pruned.shape[1] == 14
    assert not found.candidates, "chains that decide nothing are not searched"
    middle = np.nanmedian(short.seen.markers, axis=1)
    assert np.allclose(found.trans + short.body.joint_template[0], middle), "the root joint is on the median marker"
    assert np.array_equal(found.frames, np.arange(FRAMES))


def test_it_ends_closer_than_it_began_at_the_right_yaw(
    short: Scene, found: PaperLocalization, solved: PaperSolve
) -> None:
    starts = [yaw.start_deg for yaw in solved.yaws]
    assert starts == [0, 90, 180, 270]
    right = min(range(4), key=lambda i: turned(starts[i], true_yaw(short)))
    assert solved.chosen == right, f"chose {starts[solved.chosen]} for {true_yaw(short):.0f} degrees"
    wrong = [yaw.one_way for i, yaw in enumerate(solved.yaws) if i != right]
    assert min(wrong) > 2 * solved.yaws[right].one_way
    best = solved.yaws[right]
    begun = best.pose.descent.trace
    first = BodyState(exp_so3(begun.rotation_vectors[0].astype(float)), begun.trans[0], begun.betas[0])
    states = (first, best.pose.body, best.markers.body, solved.refined.body)
    errors = [joint_error(short, state) for state in states]
    said = f"stages 1, 2, 4, 5 end {' '.join(f'{e:.0f}' for e in errors)} mm off"
    assert errors[0] > 1.5 * errors[1], said
    assert errors[1] > errors[2], said
    assert errors[3] < 80, said


def test_the_trace_shows_the_way_and_the_cap_is_kept(
    solved: PaperSolve, short: Scene, found: PaperLocalization
) -> None:
    stages = [stage for yaw in solved.yaws for stage in (yaw.pose, yaw.markers)] + [solved.refined]
    for stage in stages:
        trace = stage.descent.trace
        assert stage.descent.iterations == CAP
        assert not stage.descent.converged
        assert stage.descent.evaluations >= CAP
        assert trace.iteration.tolist() == [0, 1, 2, 4, 8, 16, CAP]
        assert (np.diff(trace.energy) < 0).all()
        assert trace.energy[-1] == pytest.approx(stage.descent.energy)
        assert trace.rotation_vectors.shape == (7, FRAMES, 24, 3)
        shown = exp_so3(trace.rotation_vectors[-1].astype(float))
        assert np.abs(shown - stage.body.rotations[trace.frames]).max() < 1e-5
        assert np.abs(trace.trans[-1] - stage.body.trans[trace.frames]).max() < 1e-5
        assert np.array_equal(trace.betas[-1], stage.body.betas)
    begun = solved.yaws[1].pose.descent.trace
    assert np.allclose(begun.trans[0], found.trans, atol=1e-5)
    assert np.allclose(begun.betas[0], 0)
    root = exp_so3(np.array([0, 0, np.pi / 2])) @ R_LAB_UPRIGHT_CAMERA @ short.seen.prior[:, 0]
    assert np.abs(exp_so3(begun.rotation_vectors[0, :, 0].astype(float)) - root).max() < 1e-5
    for before, after in pairwise((solved.yaws[0].pose, solved.yaws[0].markers)):
        assert np.allclose(before.body.trans, after.descent.trace.trans[0], atol=1e-5)


def test_stage_5_is_held_to_stage_4(solved: PaperSolve) -> None:
    """Its pose term is against stage 4's pose: nothing at first, so it ends far lower than stage 4's own."""
    best = solved.yaws[solved.chosen]
    assert solved.refined.descent.energies["pose"] < 0.5 * best.markers.descent.energies["pose"]


def test_the_yaws_are_ranked_as_candidates(
    short: Scene, found: PaperLocalization, solved: PaperSolve, ranked: Orientation
) -> None:
    assert [c.hypothesis for c in ranked.candidates] == np.argsort([y.one_way for y in solved.yaws]).tolist()
    best = ranked.candidates[0]
    assert turned(best.heading_deg, true_yaw(short) + 90) < 15
    assert best.energy == pytest.approx(1e6 * solved.yaws[solved.chosen].one_way)
    assert best.part == "whole body"
    assert np.array_equal(best.rotations, solved.refined.body.rotations)
    assert ranked.margin > 2
    assert ranked.runner_up > 0
    assert 0.6 < ranked.confidence < 1
    assert any("stopped at 24 iterations" in warning for warning in ranked.warnings)
    tilt = np.degrees(np.arccos((np.trace(best.camera.R_lab_cam.T @ short.camera.R_lab_cam) - 1) / 2))
    assert tilt < 20, f"the camera is {tilt:.0f} degrees off"
    assert best.camera.reprojection_px < 60


def test_the_motion_is_the_refined_body(short: Scene, motion: FittedMotion, solved: PaperSolve) -> None:
    assert np.allclose(motion.rotations, solved.refined.body.rotations, atol=1e-9)
    assert np.allclose(motion.trans, solved.refined.body.trans)
    assert motion.betas.shape == (short.body.shape_count,)
    assert np.array_equal(motion.marker_vertex, solved.vertex)
    skin = short.body.pose(motion.rotations, motion.betas, motion.trans, solved.vertex)[0]
    height = np.linalg.norm(motion.placed - skin, axis=2)
    assert np.abs(np.median(height) - 0.0095) < 5e-4, "markers stand 9.5 mm off their vertices"
    assert np.nanmedian(motion.residual) < 0.03
    same = np.mean(motion.marker_joint == short.bones)
    assert same > 0.5, f"{same:.0%} of the markers on their bone"


def test_frames_between_are_interpolated(short: Scene, found: PaperLocalization, solved: PaperSolve) -> None:
    """At four times the rate the same frames are used, and the ones between lie between."""
    often = 4 * (FRAMES - 1) + 1
    columns = np.arange(often)
    seen = short.seen
    nearest = (columns / 4).round().astype(int)
    dense = Observations(
        seen.markers[nearest], seen.prior[nearest], seen.tracked[nearest], seen.image[nearest],
        seen.visibility[nearest], seen.image_size,
    )  # fmt: skip
    every = replace(found, frames=columns[::4])
    ranked = orientation_of(short.body, dense, short.landmarks, every, solved)
    motion = motion_of(short.body, dense, columns / 24, every, solved, ranked)
    assert np.allclose(motion.rotations[::4], solved.refined.body.rotations, atol=1e-9)
    between = 0.5 * (motion.trans[4] + motion.trans[8])
    assert np.allclose(motion.trans[6], between)
    assert motion.placed.shape == (often, 36, 3)


def test_another_yaw_can_be_pinned(
    short: Scene, time: np.ndarray, found: PaperLocalization, solved: PaperSolve, ranked: Orientation
) -> None:
    pinned = motion_of(short.body, short.seen, time, found, solved, ranked, PaperFitSettings(candidate=2))
    stage_4 = ranked.candidates[2]
    assert pinned.chosen == 2
    assert "pinned" in pinned.warnings[0]
    assert pinned.warnings[1:] == ranked.warnings, "what speaks against the ranking stays"
    times = stage_4.energy / ranked.candidates[0].energy
    assert pinned.confidence == pytest.approx(1 / (1 + times)), "a decision by hand is no evidence"
    moved = np.linalg.norm(log_so3(np.swapaxes(pinned.rotations[:, 0], 1, 2) @ stage_4.rotations[:, 0]), axis=1)
    assert np.degrees(np.median(moved)) < 15, "stage 5 begins at the pinned yaw's stage 4"
    with pytest.raises(InputError, match="pin one of 1 to 4"):
        motion_of(short.body, short.seen, time, found, solved, ranked, PaperFitSettings(candidate=4))


def test_everything_can_be_stored(solved: PaperSolve, found: PaperLocalization) -> None:
    for value, kind in ((solved, PaperSolve), (found, PaperLocalization)):
        back = decode(*encode(value), kind)
        assert encode(back)[0] == encode(value)[0]
    assert isinstance(back, PaperLocalization)


@pytest.fixture(scope="module")
def leg(free_body: Body) -> tuple[Scene, Observations]:
    """Markers of the left leg, seen by a faultless video whose camera is level and looks along y."""
    whole = simulate(free_body, 6, frames=FRAMES, markers=60)
    legs = np.isin(whole.bones, [INDEX[f"left_{j}"] for j in ("hip", "knee", "ankle", "foot")])
    prior = whole.pose.rotations.copy()
    prior[:, 0] = exp_so3(np.array([0, 0, 0.2])) @ prior[:, 0]
    prior[:, 0] = R_LAB_UPRIGHT_CAMERA.T @ prior[:, 0]
    return whole, replace(whole.seen, markers=whole.seen.markers[:, legs], prior=prior)


def test_a_part_is_searched_among_all_chains(leg: tuple[Scene, Observations], time: np.ndarray) -> None:
    whole, seen = leg
    count = seen.markers.shape[1]
    groups = np.arange(count) % 3
    groups[0] = -1
    found = localize_paper(whole.body, seen, time, groups, PaperLocalizeSettings(iterations=40))
    assert found.markers.tolist() == list(range(1, count))
    assert found.box < 0.4
    assert (found.groups, found.chains, len(found.candidates)) == (3, 26, 26)
    best = found.candidates[found.chosen]
    assert best.chamfer == min(c.chamfer for c in found.candidates)
    assert all(JOINTS[b].startswith("left") for b in best.bones), [JOINTS[b] for b in best.bones]
    assert (found.yaw_deg, found.trans is best.trans) == (best.yaw_deg, True)
    assert turned(best.yaw_deg, -np.degrees(0.2)) < 12, f"yaw {best.yaw_deg:.0f} degrees"
    for fit in found.candidates:
        assert fit.one_way <= fit.chamfer
        expected = 10 * fit.one_way, 0.1 * np.mean(fit.betas**2)
        assert tuple(fit.descent.energies.values()) == pytest.approx(expected, rel=1e-4)
        assert fit.descent.iterations <= 40
        assert fit.descent.trace.iteration[0] == 0


def test_a_known_pose_is_registered(leg: tuple[Scene, Observations], time: np.ndarray) -> None:
    """With a faultless video, turned by 100 degrees, the baseline puts the body where it was but for its shape."""
    whole, _ = leg
    prior = whole.pose.rotations.copy()
    prior[:, 0] = R_LAB_UPRIGHT_CAMERA.T @ exp_so3(np.array([0, 0, np.radians(100)])) @ prior[:, 0]
    seen = replace(whole.seen, prior=prior)
    settings = PaperLocalizeSettings()
    found = localize_paper(whole.body, seen, time, np.zeros(60, int), settings)
    assert found.whole_body
    motion = register(whole.body, seen, whole.landmarks, time, found, settings)
    error = 1000 * np.linalg.norm(motion.joints - whole.joints, axis=2)[:, :22].mean()
    assert error < 45, f"joints are {error:.0f} mm off"
    assert np.allclose(motion.rotations[:, 1:], whole.pose.rotations[:, 1:])
    assert not motion.betas.any()
    moved = np.median(np.linalg.norm(motion.rotations[:, 0] - whole.pose.rotations[:, 0], axis=(1, 2)))
    assert moved < np.sqrt(2) * np.radians(8)


def test_a_cancelled_solve_ends_at_once(short: Scene, found: PaperLocalization) -> None:
    asked: list[float] = []

    def progress(fraction: float, text: str) -> None:
        asked.append(fraction)
        assert "fitting the pose" in text
        if len(asked) == 4:
            raise Cancelled

    with pytest.raises(Cancelled):
        solve_paper(short.body, short.seen, found, PaperSolveSettings(iterations=CAP), progress=progress)
    assert len(asked) == 4


def test_what_nothing_can_be_made_of_is_refused(short: Scene, time: np.ndarray) -> None:
    groups = np.where(np.arange(36) < 2, 0, -1)
    with pytest.raises(InputError, match="only 2 markers"):
        localize_paper(short.body, short.seen, time, groups, PaperLocalizeSettings())
    blind = replace(short.seen, tracked=np.zeros(FRAMES, bool))
    with pytest.raises(InputError, match="tracks the person at no time"):
        localize_paper(short.body, blind, time, np.zeros(36, int), PaperLocalizeSettings())
