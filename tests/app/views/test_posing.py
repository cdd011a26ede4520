"""Bodies posed quickly against the solver's own posing, and between and beyond given poses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from markerscope.app.views.bodies import BodyTrack, keyframes_of, of_candidate, of_hypothesis, of_iteration, of_motion
from markerscope.app.views.posing import BONE_EDGES, Pose, bones_of, mesh_of, pose_at
from markerscope.solver.body.bone_meshes import bone_meshes
from markerscope.solver.body.model import Body
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS
from markerscope.solver.fit.published.results import PaperLocalization, Trace
from markerscope.solver.fit.results import Candidate, Localization
from tests.app.views.conftest import Made, make


@pytest.mark.parametrize("detail", ["coarse", "full"])
def test_a_frame_is_where_the_solver_poses_it(made: Made, detail: str) -> None:
    motion, track = made.motion, of_motion(made.body, made.motion)
    index = made.body.lod_index if detail == "coarse" else slice(None)
    for frame in (0, 17, 59):
        wanted, joints = made.body.pose(motion.rotations[[frame]], motion.betas, motion.trans[[frame]], index)
        found = track.vertices(float(motion.time[frame]), detail)  # type: ignore[arg-type]
        error = np.abs(found - wanted[0]).max()
        assert error < 2e-6, f"{error} m"
        assert found.dtype == np.float32
        assert np.abs(track.joints(float(motion.time[frame])) - joints[0]).max() < 1e-12
    faces = track.faces(detail)  # type: ignore[arg-type]
    assert faces.min() == 0 and faces.max() == len(found) - 1


def test_bones_are_where_the_solver_poses_them(made: Made) -> None:
    motion, track = made.motion, of_motion(made.body, made.motion)
    wanted = bone_meshes().posed(made.body, motion.rotations[[17]], motion.betas, motion.trans[[17]])[0]
    found = track.bones.at(track.pose(float(motion.time[17])))
    assert np.abs(found - wanted).max() < 2e-6
    fewer = bones_of(made.body, motion.betas[:6]).at(track.pose(0.0))
    rest = np.pad(motion.betas[:6], (0, len(motion.betas) - 6))
    wanted = bone_meshes().posed(made.body, motion.rotations[[0]], rest, motion.trans[[0]])[0]
    assert np.abs(fewer - wanted).max() < 2e-6, "coefficients that are not given are zero"


def test_far_from_the_origin_single_precision_still_suffices(made: Made) -> None:
    pose = Pose(made.motion.rotations[3], made.motion.trans[3] + np.array([1000.0, -1000, 0]))
    wanted = made.body.pose(pose.rotations[None], made.motion.betas, pose.trans[None])[0][0]
    error = np.abs(mesh_of(made.body, made.motion.betas).at(pose) - wanted).max()
    assert error < 3e-4, f"{error} m"


def test_pose_dependent_correctives_are_in(made: Made) -> None:
    rng = np.random.default_rng(0)
    few = rng.choice(len(made.body.template), 300, replace=False)
    body = replace(
        made.body,
        template=made.body.template[few],
        shape_dirs=made.body.shape_dirs[few],
        weights_index=made.body.weights_index[few],
        weights_value=made.body.weights_value[few],
        pose_dirs=rng.normal(0, 0.01, (300, 3, 207)),
        _torch={},
    )
    frame = slice(7, 8)
    wanted = body.pose(made.motion.rotations[frame], made.motion.betas, made.motion.trans[frame])[0][0]
    found = mesh_of(body, made.motion.betas).at(Pose(made.motion.rotations[7], made.motion.trans[7]))
    error = np.abs(found - wanted).max()
    assert error < 2e-6, f"{error} m"


def test_fewer_shape_coefficients_leave_the_rest_at_zero(made: Made) -> None:
    pose = Pose(made.motion.rotations[0], made.motion.trans[0])
    few, padded = made.motion.betas[:4], np.concatenate([made.motion.betas[:4], np.zeros(made.body.shape_count - 4)])
    assert np.array_equal(mesh_of(made.body, few).at(pose), mesh_of(made.body, padded).at(pose))


def test_between_two_poses_every_joint_turns_evenly(made: Made) -> None:
    motion = made.motion
    times = motion.time[[10, 20]]
    pose = pose_at(times, motion.rotations[[10, 20]], motion.trans[[10, 20]], 0.3 * times[0] + 0.7 * times[1])
    for joint in range(24):
        ends = Rotation.from_matrix(motion.rotations[[10, 20], joint])
        wanted = Slerp([0, 1], ends)(0.7).as_matrix()
        assert np.abs(pose.rotations[joint] - wanted).max() < 1e-9, JOINTS[joint]
    assert np.allclose(pose.trans, 0.3 * motion.trans[10] + 0.7 * motion.trans[20])


def test_given_poses_are_taken_as_they_are_and_ends_are_held(made: Made) -> None:
    motion = made.motion
    some = np.array([5, 15, 40])
    track = BodyTrack(
        made.body, motion.betas, motion.time[some], motion.rotations[some], motion.trans[some],
        np.zeros(0, int), np.zeros(0, int),
    )  # fmt: skip
    assert track.pose(motion.time[15]).rotations is not None
    assert np.array_equal(track.pose(motion.time[15]).rotations, motion.rotations[15])
    assert track.is_given(motion.time[15]) and not track.is_given(motion.time[16])
    assert [track.nearest(t) for t in motion.time[[0, 9, 11, 27, 28, 59]]] == [0, 0, 1, 1, 2, 2]
    for beyond, end in ((motion.time[0], 5), (motion.time[59], 40)):
        assert np.allclose(track.pose(beyond).rotations, motion.rotations[end])
        assert np.allclose(track.pose(beyond).trans, motion.trans[end])
    single = replace_times(track, slice(1, 2))
    assert np.array_equal(single.pose(motion.time[50]).trans, motion.trans[15])
    assert single.nearest(0.0) == 0


def replace_times(track: BodyTrack, part: slice) -> BodyTrack:
    return BodyTrack(
        track.body, track.betas, track.times[part], track.rotations[part], track.trans[part], track.markers,
        track.vertex,
    )  # fmt: skip


def test_the_skin_below_a_marker_is_its_vertex(made: Made) -> None:
    track = of_motion(made.body, made.motion)
    places = track.skin_places(float(made.motion.time[12]), 14)
    assert np.abs(places[:12] - made.motion.placed[12, :12]).max() < 2e-6
    assert np.isnan(places[12:]).all()


def test_bones_join_each_joint_to_its_parent() -> None:
    assert len(BONE_EDGES) == 23
    assert (INDEX["left_hip"], INDEX["left_knee"]) in {(int(a), int(b)) for a, b in BONE_EDGES}


def candidate(made: Made, frames: np.ndarray, refined: bool) -> Candidate:
    """The truth as a candidate whose markers stand 20 mm off the skin along x of the rest body."""
    vertex = made.motion.marker_vertex[:12]
    rest = made.body.template[vertex] + np.array([0.02, 0, 0])
    return Candidate(
        0, refined, {"markers": 1.0}, 1.0, made.motion.marker_joint[:12], vertex, "whole body", 0.0,
        made.motion.camera, rest, made.body.shape_dirs[vertex], made.body.weights[vertex], rest, rest,
        made.motion.betas, made.motion.rotations[frames], made.motion.trans[frames], (2.0, 1.0),
    )  # fmt: skip


def test_a_candidate_stands_where_it_was_at_its_keyframes(made: Made) -> None:
    few, many = np.array([3, 30]), np.array([3, 20, 30, 55])
    used = np.arange(12)
    found = Localization(
        used, few, many, np.zeros((1, 12), int), np.zeros((1, 12), int), np.eye(3)[None], np.zeros((1, 2, 3)),
        np.ones(1), ("whole body",), np.zeros(1),
    )  # fmt: skip
    for refined, frames in ((True, many), (False, few)):
        one = candidate(made, frames, refined)
        assert np.array_equal(keyframes_of(one, found), frames)
        ghost = of_candidate(made.body, one, found, made.markers)
        time = float(made.motion.time[30])
        assert ghost.is_given(time)
        assert np.abs(ghost.joints(time) - made.motion.joints[30]).max() < 1e-9
        places, skin = ghost.marker_places(time, 14), ghost.skin_places(time, 14)
        assert np.abs(skin[:12] - made.motion.placed[30, :12]).max() < 2e-6
        # Blending turns shortens a step a little where bones meet.
        step = np.linalg.norm(places - skin, axis=1)[:12]
        assert np.all((step > 0.014) & (step < 0.0201)), step


def test_a_hypothesis_is_the_videos_body_turned_and_shifted(made: Made) -> None:
    """Work it out by hand: the root joint is where ``trans`` says, and the body is the video's turned as a whole."""
    rng = np.random.default_rng(1)
    time = np.linspace(-1, 3, 30)
    prior = PosePrior(exp_so3(0.2 * rng.normal(0, 1, (30, 24, 3)).cumsum(axis=0) * 0.1), np.ones(30, bool), time)
    few = np.array([4, 33])
    turn = exp_so3(np.array([0.1, 0.2, 2.0]))[None]
    trans = rng.normal(0, 1, (1, 2, 3))
    found = Localization(
        np.arange(12), few, few, made.motion.marker_vertex[None, :12], made.motion.marker_joint[None, :12], turn, trans,
        np.ones(1), ("head",), np.zeros(1),
    )  # fmt: skip
    track = of_hypothesis(made.body, found, 0, prior, made.sync, made.markers)
    at = float(made.markers.time[33])
    video_time = at - 0.25
    after = int(np.searchsorted(time, video_time))
    share = (video_time - time[after - 1]) / (time[after] - time[after - 1])
    spin = prior.rotations[after - 1, 0]
    spin = spin @ exp_so3(share * log_so3(spin.T @ prior.rotations[after, 0]))
    pose = track.pose(at)
    assert np.allclose(pose.rotations[0], turn[0] @ spin, atol=1e-9)
    assert np.allclose(track.joints(at)[0], trans[0, 1], atol=1e-9)


def test_an_iteration_of_a_trace_is_the_pose_it_kept(made: Made) -> None:
    frames = np.array([0, 8, 20, 44])
    kept = np.array([0, 2, 3])
    vectors = log_so3(made.motion.rotations[frames[kept]])
    trace = Trace(
        np.array([0, 5]), np.array([2.0, 1.0]), kept, np.stack([0 * vectors, vectors]).astype(np.float32),
        np.stack([made.motion.trans[frames[kept]]] * 2).astype(np.float32),
        np.stack([np.zeros(18), made.motion.betas]),
    )  # fmt: skip
    found = PaperLocalization(
        np.arange(12), frames, 3, 5, np.zeros((0, 3), int), (), -1, 0.6, 0.0, np.zeros((4, 3)), np.zeros(10)
    )
    last = of_iteration(made.body, trace, 1, found, made.markers, made.motion.marker_vertex[:12])
    time = float(made.motion.time[20])
    assert last.is_given(time)
    error = np.abs(last.joints(time) - made.motion.joints[20]).max()
    assert error < 1e-5, f"{error} m"
    first = of_iteration(made.body, trace, 0, found, made.markers, np.zeros(0, int))
    assert np.allclose(first.pose(time).rotations, np.eye(3))
    assert np.isnan(first.skin_places(time, 14)).all()


def test_other_shapes_make_other_bodies(body: Body) -> None:
    one, other = make(body, 1), make(body, 2)
    assert of_motion(body, one.motion).coarse is not of_motion(body, other.motion).coarse
