"""Segment frames: square on a square body, right-handed and mirrored on the real one."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.body.anatomy import MODEL_THORAX, SEGMENT_JOINT, UPRIGHT, segment_frames
from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX

ACROSS = np.diag([-1.0, 1, 1])
ISB = {"pelvis": "spines", "thorax": "isb", "upper_arm": "epicondyles", "forearm": "ulna"}
OPENSIM = {"pelvis": "upright", "thorax": "model", "upper_arm": "model", "forearm": "wrist"}


@pytest.fixture(scope="module")
def body() -> Body:
    return with_bone_lengths(Body.load())


def frames_of(body: Body, betas: np.ndarray, *, isb: bool) -> dict[str, np.ndarray]:
    how = ISB if isb else OPENSIM
    return segment_frames(body.landmarks(betas), body.joints(betas), **how)


@pytest.mark.parametrize("isb", [False, True])
def test_frames_are_right_handed_rotations_of_every_segment(body: Body, isb: bool) -> None:
    rng = np.random.default_rng(0)
    for betas in (np.zeros(body.shape_count), rng.normal(0, 1, body.shape_count)):
        frames = frames_of(body, betas, isb=isb)
        assert set(frames) == set(SEGMENT_JOINT)
        for name, frame in frames.items():
            assert np.abs(frame.T @ frame - np.eye(3)).max() < 1e-9 and np.linalg.det(frame) > 0, name


@pytest.mark.parametrize("isb", [False, True])
def test_left_frames_are_the_right_ones_mirrored(body: Body, isb: bool) -> None:
    """Both sides have Z to the subject's right, so a mirrored left frame is the right one with Z reversed."""
    frames = frames_of(body, np.zeros(body.shape_count), isb=isb)
    for name in ("thigh", "shank", "foot", "upper_arm", "forearm", "hand"):
        expected = ACROSS @ frames[f"left_{name}"] @ np.diag([1, 1, -1])
        error = np.degrees(np.abs(expected - frames[f"right_{name}"]).max())
        assert error < 0.05, f"{name} differs by {error:.3f} degrees"


def test_axes_point_where_they_should(body: Body) -> None:
    """In the rest pose (x left, y up, z ahead): legs stand, arms lie out to the sides with the palms down."""
    frames = frames_of(body, np.zeros(body.shape_count), isb=True)
    standing = {
        "pelvis": 15,
        "thorax": 15,
        **{f"{s}_{n}": 6 for s in ("left", "right") for n in ("thigh", "shank", "foot")},
    }
    for name, allowed in standing.items():
        off = np.degrees(np.arccos((np.trace(UPRIGHT.T @ frames[name]) - 1) / 2))
        assert off < allowed, f"{name} stands {off:.1f} degrees off"
    up, ahead = np.array([0.0, 1, 0]), np.array([0.0, 0, 1])
    for side, outwards in (("left", np.array([1.0, 0, 0])), ("right", np.array([-1.0, 0, 0]))):
        to_radius = 1 if side == "right" else -1  # Z points to the right; the thumb does so on the right hand
        for name, expected in (("upper_arm", up), ("forearm", ahead), ("hand", ahead)):
            frame = frames[f"{side}_{name}"]
            assert frame[:, 1] @ -outwards > np.cos(np.radians(10)), f"{side} {name}: Y is not proximal"
            off = np.degrees(np.arccos(to_radius * frame[:, 2] @ expected))
            assert off < 12, f"{side} {name}: Z is {off:.1f} degrees off"


def test_the_trunk_as_isb_defines_it() -> None:
    """Wu et al. 2002 and 2005, on points with round numbers."""
    points = {
        "left_asis": np.array([0.12, 1.0, 0.1]),
        "right_asis": np.array([-0.12, 1.0, 0.1]),
        "left_psis": np.array([0.04, 1.03, -0.06]),
        "right_psis": np.array([-0.04, 1.03, -0.06]),
        "sternum_ij": np.array([0, 1.45, 0.08]),
        "c7": np.array([0, 1.5, -0.08]),
        "sternum_px": np.array([0, 1.25, 0.12]),
        "t8": np.array([0, 1.25, -0.08]),
    }
    body = Body.load()
    rest = np.zeros(body.shape_count)
    frames = segment_frames({**body.landmarks(rest), **points}, body.joints(rest), **ISB)
    slope = np.arctan2(0.03, 0.16)
    expected = np.array([[0, 0, -1], [-np.sin(slope), np.cos(slope), 0], [np.cos(slope), np.sin(slope), 0]])
    assert np.abs(frames["pelvis"] - expected).max() < 1e-12, "the pelvis tips forward with the plane of its spines"
    long_axis = np.array([0, 1.475 - 1.25, 0.0 - 0.02])
    assert np.abs(frames["thorax"][:, 1] - long_axis / np.linalg.norm(long_axis)).max() < 1e-12
    assert np.abs(frames["thorax"][:, 2] - [-1, 0, 0]).max() < 1e-12


def test_the_forearm_ends_where_asked(body: Body) -> None:
    betas = np.zeros(body.shape_count)
    joints, landmarks = body.joints(betas), body.landmarks(betas)
    for isb, end in ((True, landmarks["right_wrist_ulna"]), (False, joints[INDEX["right_wrist"]])):
        along = joints[INDEX["right_elbow"]] - end
        found = frames_of(body, betas, isb=isb)["right_forearm"][:, 1]
        assert np.abs(found - along / np.linalg.norm(along)).max() < 1e-12


def test_the_upper_arm_of_the_model_is_turned_against_its_epicondyles(body: Body) -> None:
    """Epicondyles and joints of the model's own right humerus, in the model's frame of it: that frame must come out."""
    to_rest = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
    lateral, medial = np.array([0.0106, -0.2800, 0.0243]), np.array([0.0027, -0.2796, -0.0327])
    rest = np.zeros(body.shape_count)
    for side, mirror in (("right", np.eye(3)), ("left", np.diag([-1.0, 1, 1]))):
        place = mirror @ to_rest
        joints = body.joints(rest).copy()
        joints[INDEX[f"{side}_shoulder"]] = 0
        joints[INDEX[f"{side}_elbow"]] = place @ np.array([0.013144, -0.286273, -0.009595])
        points = {f"{side}_elbow_lateral": place @ lateral, f"{side}_elbow_medial": place @ medial}
        frames = segment_frames({**body.landmarks(rest), **points}, joints, **OPENSIM)
        off = np.degrees(np.arccos((np.trace(UPRIGHT.T @ frames[f"{side}_upper_arm"]) - 1) / 2))
        assert off < 0.01, f"{side}: {off:.3f} degrees"


def test_the_thorax_of_the_model_is_laid_over_its_landmarks(body: Body) -> None:
    """The model's own points give an upright thorax; tipped forward by 10 degrees and enlarged, one that is."""
    rest = np.zeros(body.shape_count)
    for tip in (0.0, 10.0):
        c, s = np.cos(np.radians(tip)), np.sin(np.radians(tip))
        points = {
            name: np.array([0.0, 1.2 * (c * up - s * ahead), 1.2 * (c * ahead + s * up)])
            for name, (ahead, up) in MODEL_THORAX.items()
        }
        frames = segment_frames({**body.landmarks(rest), **points}, body.joints(rest), **OPENSIM)
        expected = UPRIGHT @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
        assert np.abs(frames["thorax"] - expected).max() < 1e-12


def test_the_thorax_of_the_model_does_not_depend_on_build(body: Body) -> None:
    """Fat lies over the xiphoid and the spine: the turn must not follow it by more than some degrees."""
    rng = np.random.default_rng(3)
    tilts = []
    for _ in range(20):
        betas = np.concatenate([rng.normal(0, 1, body.betas_count), np.zeros(body.shape_count - body.betas_count)])
        thorax = frames_of(body, betas, isb=False)["thorax"]
        tilts.append(np.degrees(np.arctan2(thorax[2, 1], thorax[1, 1])))
    assert np.std(tilts) < 2
    assert 5 < np.mean(tilts) < 15, "at rest the body's thorax stands as the model's does when it leans forward"
