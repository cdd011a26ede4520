"""Joint angles: recovered in every convention, by hand for plain movements, and against a real trial."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from markerscope.solver.angles.angles import AngleSettings, columns_of, conventions, evidence, joint_angles, read_angles
from markerscope.solver.body.anatomy import MODEL_HUMERUS, MODEL_THORAX
from markerscope.solver.body.model import Body
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.markers import lab_rotation
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from markerscope.solver.io.export_angles import angles_long_csv, write_angles

CONVENTIONS = ("opensim", "opensim-xzy", "gait2392", "isb", "isb-xzy", "visual3d", "plugin-gait")
TO_LAB = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])
"""Turns the rest body (x left, y up, z ahead) to stand in the lab (z up) and face along x."""


def turn(x: float = 0, y: float = 0, z: float = 0) -> np.ndarray:
    """A turn about one of the rest body's axes, in degrees."""
    return Rotation.from_rotvec([x, y, z], degrees=True).as_matrix()


# -- forward from random angles ----------------------------------------------------------------------------------


def far_segment(near: np.ndarray, row: dict[str, Any], angles: np.ndarray, reflected: bool) -> np.ndarray:
    """The distal frame that has these angles (T, 3), built by scipy alone."""
    if "axes" in row:
        axes = np.array(row["axes"]) / np.linalg.norm(row["axes"], axis=1, keepdims=True)
        first, second = (Rotation.from_rotvec(np.radians(angles[:, [k]]) * axes[k]) for k in (0, 1))
        relative = (first * second).as_matrix()
    else:
        relative = Rotation.from_euler(row["sequence"], angles, degrees=True).as_matrix()
    if reflected:
        mirror = np.diag([1.0, 1, -1])
        relative = mirror @ relative @ mirror
    return near @ relative


@pytest.mark.parametrize("name", CONVENTIONS)
def test_random_angles_come_back(name: str) -> None:
    rng = np.random.default_rng(1)
    convention, frames = conventions()[name], 50
    pairs = {
        "pelvis": ("lab", "pelvis"),
        "trunk": ("pelvis", "thorax"),
        "hip": ("pelvis", "thigh"),
        "knee": ("thigh", "shank"),
        "ankle": ("shank", "foot"),
        "shoulder": ("thorax", "upper_arm"),
        "elbow": ("upper_arm", "forearm"),
        "wrist": ("forearm", "hand"),
    }
    segments = {"lab": np.tile(lab_rotation("y").T, (frames, 1, 1))}
    segments |= {f"{s}_{n}": np.tile(np.eye(3), (frames, 1, 1)) for s in ("left", "right") for _, n in pairs.values()}
    expected: dict[str, np.ndarray] = {}
    midline = ("lab", "pelvis", "thorax")
    for joint, (near, far) in pairs.items():
        if joint not in convention["joints"]:
            continue
        row = convention["joints"][joint]
        for side in ("",) if far in midline else ("right", "left"):
            angles = rng.uniform(-40, 40, (frames, 3))
            if row.get("sequence") == "YXY":
                angles[:, 1] = rng.uniform(-170, -10, frames)
            reflected = side == "left" and convention["mirror"]
            start = segments[near if near in midline else f"{side}_{near}"]
            segments[far if far in midline else f"{side}_{far}"] = far_segment(start, row, angles, reflected)
            for place, column in enumerate(row["columns"]):
                value = row["signs"][place] * angles[:, place]
                if far in midline and "{" in column:  # one pelvis, said for each side; left says turns the other way
                    expected[column.format(S="R")] = value
                    expected[column.format(S="L")] = value * (1 if place == 0 else -1)
                elif column:
                    expected[column.format(s=side[:1], S=side[:1].upper())] = value
    time = np.arange(frames) / 100
    found = read_angles(time, segments, AngleSettings(convention=name))  # type: ignore[arg-type]
    assert set(found.names) == set(expected)
    for i, column in enumerate(found.names):
        off = (found.degrees[:, i] - expected[column] + 180) % 360 - 180
        assert np.abs(off).max() < 1e-5, f"{column} is off by {np.abs(off).max():.2e} degrees"


# -- plain movements of a square body, by hand -------------------------------------------------------------------


def square_body(convention: str) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Landmarks and joint centres of a body in the T-pose whose segment frames are all exactly square.

    For the conventions of OpenSim its thorax and upper arms are those of the model, which stand square there.
    """
    joints = np.zeros((24, 3))
    left = {
        "hip": (0.1, 0, 0),
        "knee": (0.1, -0.4, 0),
        "ankle": (0.1, -0.8, 0),
        "foot": (0.1, -0.85, 0.15),
        "collar": (0.05, 0.45, 0),
        "shoulder": (0.2, 0.5, 0),
        "elbow": (0.5, 0.5, 0),
        "wrist": (0.75, 0.5, 0),
        "hand": (0.83, 0.5, 0),
    }
    skin = {
        "asis": (0.12, 0.1, 0.1),
        "psis": (0.05, 0.1, -0.1),
        "knee_lateral": (0.15, -0.4, 0),
        "knee_medial": (0.05, -0.4, 0),
        "calcaneus": (0.1, -0.87, -0.05),
        "toe": (0.1, -0.86, 0.18),
        "elbow_lateral": (0.5, 0.53, 0),
        "elbow_medial": (0.5, 0.47, 0),
        "wrist_radius": (0.75, 0.5, 0.03),
        "wrist_ulna": (0.75, 0.5, -0.03),
    }
    landmarks = {
        "sternum_ij": np.array([0, 0.55, 0.1]),
        "c7": np.array([0, 0.55, -0.1]),
        "sternum_px": np.array([0, 0.35, 0.1]),
        "t8": np.array([0, 0.35, -0.1]),
    }
    for side, flip in (("left", np.array([1, 1, 1])), ("right", np.array([-1, 1, 1]))):
        for name, place in left.items():
            joints[INDEX[f"{side}_{name}"]] = flip * place
        for name, place in skin.items():
            landmarks[f"{side}_{name}"] = flip * np.array(place)
    if conventions()[convention]["thorax"] == "model":
        landmarks |= {name: np.array([0, up, ahead]) for name, (ahead, up) in MODEL_THORAX.items()}
        for side, out in (("left", 1), ("right", -1)):
            # Down the arm is outward here, forward is forward, and the lateral side is up.
            at = {name: np.array([-out * down, aside, ahead]) for name, (ahead, down, aside) in MODEL_HUMERUS.items()}
            shift = joints[INDEX[f"{side}_shoulder"]] + at["elbow"] - joints[INDEX[f"{side}_elbow"]]
            for name in ("elbow", "wrist", "hand"):
                joints[INDEX[f"{side}_{name}"]] += shift
            for name in ("wrist_radius", "wrist_ulna"):
                landmarks[f"{side}_{name}"] = landmarks[f"{side}_{name}"] + shift
            for name in ("elbow_lateral", "elbow_medial"):
                landmarks[f"{side}_{name}"] = joints[INDEX[f"{side}_shoulder"]] + at[name]
    for name, height in (("spine1", 0.1), ("spine2", 0.2), ("spine3", 0.35), ("neck", 0.55), ("head", 0.65)):
        joints[INDEX[name]] = (0, height, 0)
    return landmarks, joints


HANGING = {"right_shoulder": turn(z=90), "left_shoulder": turn(z=-90)}
FORWARD_PALMS = {"right_elbow": turn(x=-90), "left_elbow": turn(x=-90)}
STANDING = {"pelvis": np.eye(3), **HANGING, **FORWARD_PALMS}
"""The anatomical position, from the T-pose with the palms down."""


def angles_of(convention: str, **joints: np.ndarray) -> dict[str, float]:
    """The angles of the square body in the anatomical position, but for the joints given."""
    rotations = np.tile(np.eye(3), (1, 24, 1, 1))
    for name, matrix in (STANDING | joints).items():
        rotations[0, INDEX[name]] = matrix
    rotations[:, 0] = TO_LAB @ rotations[:, 0]
    found = joint_angles(np.zeros(1), rotations, *square_body(convention), AngleSettings(convention=convention))  # type: ignore[arg-type]
    values = np.where(found.singular, np.nan, found.degrees)[0]
    return dict(zip(found.names, values, strict=True))


MOVEMENTS: dict[str, tuple[dict[str, np.ndarray], dict[str, dict[str, float]]]] = {
    "the knee bent": (
        {"right_knee": turn(x=60)},
        {
            "opensim": {"knee_angle_r": 60},
            "gait2392": {"knee_angle_r": -60},
            "isb": {"knee_flexion_r": 60},
            "visual3d": {"RKNEE_ANGLE_X": -60},
            "plugin-gait": {"RKneeAnglesX": 60},
        },
    ),
    "the left knee bent": (
        {"left_knee": turn(x=60)},
        {"opensim": {"knee_angle_l": 60}, "visual3d": {"LKNEE_ANGLE_X": -60}, "plugin-gait": {"LKneeAnglesX": 60}},
    ),
    "bow legs": (
        {"right_knee": turn(z=8), "left_knee": turn(z=-8)},
        {
            "opensim": {},
            "isb": {"knee_varus_r": 8, "knee_varus_l": 8},
            "visual3d": {"RKNEE_ANGLE_Y": 8, "LKNEE_ANGLE_Y": -8},
            "plugin-gait": {"RKneeAnglesY": 8, "LKneeAnglesY": 8},
        },
    ),
    "the thigh raised": (
        {"right_hip": turn(x=-30)},
        {
            "opensim": {"hip_flexion_r": 30},
            "isb": {"hip_flexion_r": 30},
            "visual3d": {"RHIP_ANGLE_X": 30},
            "plugin-gait": {"RHipAnglesX": 30},
        },
    ),
    "both legs apart": (
        {"right_hip": turn(z=-20), "left_hip": turn(z=20)},
        {
            "opensim": {"hip_adduction_r": -20, "hip_adduction_l": -20},
            "isb": {"hip_adduction_r": -20, "hip_adduction_l": -20},
            "visual3d": {"RHIP_ANGLE_Y": -20, "LHIP_ANGLE_Y": 20},
            "plugin-gait": {"RHipAnglesY": -20, "LHipAnglesY": -20},
        },
    ),
    "toes turned in": (
        {"right_hip": turn(y=15), "left_hip": turn(y=-15)},
        {
            "opensim": {"hip_rotation_r": 15, "hip_rotation_l": 15},
            "visual3d": {"RHIP_ANGLE_Z": 15, "LHIP_ANGLE_Z": -15},
            "plugin-gait": {"RHipAnglesZ": 15, "LHipAnglesZ": 15},
        },
    ),
    "toes raised": (
        {"right_ankle": turn(x=-20)},
        {
            "isb": {"ankle_dorsiflexion_r": 20},
            "visual3d": {"RANKLE_ANGLE_X": 20},
            "plugin-gait": {"RAnkleAnglesX": 20},
        },
    ),
    "soles turned in": (
        {"right_ankle": turn(z=10), "left_ankle": turn(z=-10)},
        {
            "isb": {"ankle_inversion_r": 10, "ankle_inversion_l": 10},
            "visual3d": {"RANKLE_ANGLE_Y": 10, "LANKLE_ANGLE_Y": -10},
            "plugin-gait": {"RAnkleAnglesY": 10, "LAnkleAnglesY": 10},
        },
    ),
    "turned to the left": (
        {"pelvis": turn(y=30)},
        {
            "opensim": {"pelvis_rotation": 30},
            "isb": {"pelvis_rotation": 30},
            "visual3d": {"PELVIS_ANGLE_Z": 30},
            "plugin-gait": {"RPelvisAnglesZ": 30, "LPelvisAnglesZ": -30},
        },
    ),
    "leaning back": (
        {"pelvis": turn(x=-10)},
        {
            "opensim": {"pelvis_tilt": 10},
            "isb": {"pelvis_tilt": 10},
            "visual3d": {"PELVIS_ANGLE_X": 10},
            "plugin-gait": {"RPelvisAnglesX": -10, "LPelvisAnglesX": -10},
        },
    ),
    "the right hip dropped": (
        {"pelvis": turn(z=8)},
        {
            "opensim": {"pelvis_list": 8},
            "isb": {"pelvis_obliquity": 8},
            "visual3d": {"PELVIS_ANGLE_Y": 8},
            "plugin-gait": {"RPelvisAnglesY": -8, "LPelvisAnglesY": 8},
        },
    ),
    "the trunk bent forwards": (
        {f"spine{i}": turn(x=10) for i in (1, 2, 3)},
        {
            "opensim": {"lumbar_extension": -30},
            "isb": {"trunk_flexion": 30},
            "visual3d": {"TRUNK_ANGLE_X": -30},
            "plugin-gait": {"RSpineAnglesX": 30, "LSpineAnglesX": 30},
        },
    ),
    "the trunk bent to the right": (
        {"spine2": turn(z=12)},
        {
            "opensim": {"lumbar_bending": 12},
            "isb": {"trunk_lateral_bend": 12},
            "visual3d": {"TRUNK_ANGLE_Y": 12},
            "plugin-gait": {"RSpineAnglesY": 12, "LSpineAnglesY": -12},
        },
    ),
    "the trunk turned to the left": (
        {"spine3": turn(y=25)},
        {
            "opensim": {"lumbar_rotation": 25},
            "isb": {"trunk_axial_rotation": 25},
            "visual3d": {"TRUNK_ANGLE_Z": 25},
            "plugin-gait": {"RSpineAnglesZ": -25, "LSpineAnglesZ": 25},
        },
    ),
    "an arm raised forwards": (
        {"right_shoulder": turn(x=-80) @ HANGING["right_shoulder"]},
        {
            "opensim": {"arm_flex_r": 80},
            "isb": {"shoulder_plane_r": 90, "shoulder_elevation_r": -80, "shoulder_rotation_r": -90},
        },
    ),
    "both arms raised sideways": (
        {"right_shoulder": turn(z=90 - 60), "left_shoulder": turn(z=60 - 90)},
        {
            "opensim": {"arm_add_r": -60, "arm_add_l": -60},
            "isb": {
                f"shoulder_{what}_{side}": value
                for side in "rl"
                for what, value in (("plane", 0), ("elevation", -60), ("rotation", 0))
            },
        },
    ),
    "an arm raised sideways overhead": (
        {"left_shoulder": turn(z=130 - 90)},
        {
            "opensim": {"arm_add_l": -130},
            "isb": {"shoulder_plane_l": 0, "shoulder_elevation_l": -130, "shoulder_rotation_l": 0},
        },
    ),
    "an arm turned inwards": (
        {"right_shoulder": turn(y=35) @ HANGING["right_shoulder"]},
        {"opensim": {"arm_rot_r": 35}},
    ),
    "the elbow bent": (
        {"right_elbow": turn(y=80) @ FORWARD_PALMS["right_elbow"], "left_elbow": turn(y=-80) @ turn(x=-90)},
        {
            "opensim": {"elbow_flex_r": 80, "elbow_flex_l": 80},
            "visual3d": {"RELBOW_ANGLE_X": 80, "LELBOW_ANGLE_X": 80},
            "plugin-gait": {"RElbowAnglesX": 80, "LElbowAnglesX": 80},
        },
    ),
    "the palm turned back": (
        {"right_elbow": turn(x=50) @ FORWARD_PALMS["right_elbow"]},
        {
            "opensim": {"pro_sup_r": 50},
            "visual3d": {"RELBOW_ANGLE_Z": 50},
            "plugin-gait": {},
        },
    ),
    "the hand bent to the palm": (
        {"right_wrist": turn(z=30), "left_wrist": turn(z=-30)},
        {"opensim": {"wrist_flex_r": 30, "wrist_flex_l": 30}},
    ),
    "the hand bent to the little finger": (
        {"right_wrist": turn(y=-20), "left_wrist": turn(y=20)},
        {"opensim": {"wrist_dev_r": 20, "wrist_dev_l": 20}},
    ),
}


@pytest.mark.parametrize("movement", MOVEMENTS)
def test_plain_movements_have_the_angle_one_would_say(movement: str) -> None:
    joints, by_convention = MOVEMENTS[movement]
    for convention, moved in by_convention.items():
        rest, found = angles_of(convention), angles_of(convention, **joints)
        assert set(moved) <= set(found)
        for column, value in found.items():
            if column in moved:
                assert abs(value - moved[column]) < 1e-6, f"{convention}: {column} is {value:.2f}, not {moved[column]}"
            elif np.isfinite(value) and np.isfinite(rest[column]):
                assert abs(value - rest[column]) < 1e-6, (
                    f"{convention}: {column} went to {value:.2f} from {rest[column]:.2f}"
                )


SWINGS = ("opensim", "isb")


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize("convention", SWINGS)
def test_an_overhead_swing_ends_where_it_began(convention: str, side: str) -> None:
    """Up in front, down at the side, three times: the arm at the side reads as before, and the same on both sides."""
    shoulder, sign = f"{side}_shoulder", 1 if side == "right" else -1
    tip = 15.0  # never quite hanging, where ISB's sequence is singular
    forwards = [turn(x=-angle) @ HANGING[shoulder] for angle in np.arange(tip, 178, 3)]
    down = [turn(z=sign * (90 - angle)) for angle in np.arange(175, tip, -3.0)]
    frames = (forwards + down) * 3 + forwards[:1]
    rotations = np.tile(np.eye(3), (len(frames), 24, 1, 1))
    for name, matrix in STANDING.items():
        rotations[:, INDEX[name]] = matrix
    rotations[:, INDEX[shoulder]] = frames
    found = joint_angles(
        np.arange(len(frames)) / 100,
        at_home(rotations),
        *square_body(convention),
        AngleSettings(convention=convention),  # type: ignore[arg-type]
    )
    columns = [i for i, name in enumerate(found.names) if name.startswith(("arm", "shoulder")) and name[-1] == side[0]]
    values = found.degrees[:, columns]
    assert len(columns) == 3
    assert np.abs(values[-1] - values[0]).max() < 1e-6
    expected = {"opensim": [tip, 0, 0], "isb": [90, -tip, -90]}[convention]
    assert np.abs(values[-1] - expected).max() < 1e-6, f"{values[-1]} at the side, not {expected}"
    assert np.abs(values).max() <= 200


def raised(step: float = 3.0) -> np.ndarray:
    """The right arm from hanging at the side sideways to 150 degrees."""
    angles = np.arange(0, 150, step)
    rotations = np.tile(np.eye(3), (len(angles), 24, 1, 1))
    for name, matrix in STANDING.items():
        rotations[:, INDEX[name]] = matrix
    rotations[:, INDEX["right_shoulder"]] = [turn(z=-angle) @ HANGING["right_shoulder"] for angle in angles]
    return at_home(rotations)


@pytest.mark.parametrize(("convention", "second"), [("opensim", "opensim-xzy"), ("isb", "isb-xzy")])
def test_an_order_that_reads_the_shoulder_is_named_where_the_usual_one_cannot(convention: str, second: str) -> None:
    rotations, body = raised(), square_body(convention)
    time = np.arange(len(rotations)) / 100
    found, other = (joint_angles(time, rotations, *body, AngleSettings(name)) for name in (convention, second))  # type: ignore[arg-type]
    assert found.singular.any() and second in found.hint and f"of {len(time)} frames" in found.hint
    assert not other.singular.any() and not other.hint
    # the abduction is the arm's elevation, whatever is singular in the other order
    mine = [name for name in other.names if name.startswith(("arm", "shoulder")) and name[-1] == "r"]
    raised_by = -other.degrees[:, other.names.index(mine[0])]
    assert np.abs(raised_by - np.arange(0, 150, 3.0)).max() < 1e-6
    assert len(set(found.names) & set(other.names)) == len(found.names) - 6, "another order has names of its own"


def test_no_order_is_named_where_all_angles_can_be_told() -> None:
    rotations = raised()[:25]
    found = joint_angles(np.arange(25) / 100, rotations, *square_body("opensim"), AngleSettings())
    assert not found.singular.any() and not found.hint


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_reading_lies_within_half_a_turn_of_the_joints_range(convention: str) -> None:
    """Random turns of every joint, in random order: no angle but a heading depends on the frames before."""
    rng = np.random.default_rng(8)
    rotations = Rotation.from_rotvec(rng.normal(0, 1.2, (24 * 60, 3))).as_matrix().reshape(60, 24, 3, 3)
    order = rng.permutation(60)
    found, other = (
        joint_angles(np.arange(60.0), r, *square_body(convention), AngleSettings(convention=convention))  # type: ignore[arg-type]
        for r in (at_home(rotations), at_home(rotations[order]))
    )
    if conventions()[convention]["lab"] == "as recorded":
        free = [name.lower().endswith("pelvis_rotation") for name in found.names]
    else:  # the lab is turned to where the subject faces on average, alike in both
        free = [name.lower() in ("pelvis_angle_z", "rpelvisanglesz", "lpelvisanglesz") for name in found.names]
    assert sum(free) in (1, 2)
    held = ~np.array(free)
    assert np.abs(found.degrees[order][:, held] - other.degrees[:, held]).max() < 1e-6
    ranged = [ends for row in conventions()[convention]["joints"].values() for ends in row.get("range", ()) if ends]
    assert np.abs(found.degrees[:, held]).max() <= 180 + max(abs(sum(ends)) / 2 for ends in ranged) + 1e-6


def test_unmirrored_left_sides_have_mirrored_ranges() -> None:
    """A left leg lifted sideways beyond a right angle is abducted, which counts up there, as on the right down."""
    high = {"right_hip": turn(z=-110), "left_hip": turn(z=110)}
    found = angles_of("visual3d", **high)
    assert [found["RHIP_ANGLE_Y"], found["LHIP_ANGLE_Y"]] == pytest.approx([-110, 110])
    assert [found["RHIP_ANGLE_X"], found["LHIP_ANGLE_X"]] == pytest.approx([0, 0], abs=1e-6)
    ranges = {column.name: column.ranges for column in columns_of("visual3d")}
    right, left = ranges["RHIP_ANGLE_Y"], ranges["LHIP_ANGLE_Y"]
    assert right.tolist() == [[-40, 150], [-120, 60], [-90, 90]] and left.tolist() == [
        [-40, 150],
        [-60, 120],
        [-90, 90],
    ]
    mirrored = {column.name: column.ranges for column in columns_of("isb")}
    assert np.array_equal(mirrored["hip_adduction_r"], mirrored["hip_adduction_l"]), "mirrored before it is read"


def test_jumps_of_the_reading_are_flagged() -> None:
    """An arm swung right round in front comes in again at the other end of its range, and that frame is flagged."""
    rotations = np.tile(np.eye(3), (120, 24, 1, 1))
    for name, matrix in STANDING.items():
        rotations[:, INDEX[name]] = matrix
    rotations[:, INDEX["right_shoulder"]] = [turn(x=-3.0 * i) @ HANGING["right_shoulder"] for i in range(120)]
    found = joint_angles(np.arange(120) / 100, at_home(rotations), *square_body("opensim"), AngleSettings())
    column = found.names.index("arm_flex_r")
    (frame,) = np.flatnonzero(found.jumps[:, column])
    assert found.degrees[frame - 1, column] > 200 and found.degrees[frame, column] < -100
    assert found.jumps.sum() == 1
    about = found.degrees[-1, column]
    assert about == pytest.approx(-3), "back at the side, three degrees behind it"


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_anatomical_position_is_zero(convention: str) -> None:
    carrying = np.degrees(np.arctan(0.03 / 0.25))  # ISB's forearm ends at the ulna, 30 mm beside the wrist's middle
    offset = {"elbow_carrying": carrying, "wrist_ulnar_deviation": -carrying} if convention.startswith("isb") else {}
    for column, value in angles_of(convention).items():
        if np.isfinite(value):
            expected = offset.get(column[:-2], 0.0)
            assert abs(value - expected) < 1e-6, f"{column} is {value:.3f}, not {expected:.3f}"
        else:
            assert column[:-2] in ("shoulder_plane", "shoulder_rotation"), f"{column} should not be singular"


def test_the_ankle_about_the_models_axes() -> None:
    """Raising the toes is nearly all ankle, turning the sole in nearly all subtalar joint."""
    raised = angles_of("opensim", right_ankle=turn(x=-20), left_ankle=turn(x=-20))
    assert abs(raised["ankle_angle_r"] - 20) < 1.5 and raised["ankle_angle_r"] == pytest.approx(raised["ankle_angle_l"])
    assert 2 < angles_of("opensim", right_ankle=turn(z=10))["subtalar_angle_r"] < 12


def test_who_faces_another_way_is_read_there_where_the_convention_says_so() -> None:
    """Leaning forward by 15 while facing back along the lab's first axis."""
    lean = turn(y=180) @ turn(x=15)
    assert angles_of("isb", pelvis=lean)["pelvis_tilt"] == pytest.approx(-15)
    assert angles_of("plugin-gait", pelvis=lean)["RPelvisAnglesX"] == pytest.approx(15)
    assert angles_of("plugin-gait", pelvis=lean)["RPelvisAnglesZ"] == pytest.approx(0, abs=1e-9)
    assert angles_of("visual3d", pelvis=lean)["PELVIS_ANGLE_X"] == pytest.approx(-15)
    assert angles_of("opensim", pelvis=lean)["pelvis_tilt"] == pytest.approx(15), "OpenSim tilts about the lab's axis"


@pytest.mark.parametrize("heading", [-160, -90, -50, -40, 0, 40, 50, 90, 160])
def test_quarter_turns_leave_what_the_subject_turns_beyond_them(heading: int) -> None:
    """To either side: the pelvis then reads as if the trial had been walked along the lab's first axis."""
    lean = turn(y=heading) @ turn(x=15)
    beyond = heading - 90 * round(heading / 90)
    as_walked = angles_of("visual3d", pelvis=turn(y=beyond) @ turn(x=15))
    for axis in "XYZ":
        found = angles_of("visual3d", pelvis=lean)[f"PELVIS_ANGLE_{axis}"]
        assert found == pytest.approx(as_walked[f"PELVIS_ANGLE_{axis}"], abs=1e-6), f"{axis} heading {heading}"
    assert angles_of("plugin-gait", pelvis=turn(y=heading))["RPelvisAnglesX"] == pytest.approx(0, abs=1e-6)


# -- the real body ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_a_mirrored_movement_has_the_same_angles_on_the_other_side(convention: str) -> None:
    body = Body.load()
    rng = np.random.default_rng(5)
    betas = rng.normal(0, 1, body.shape_count)
    across = np.diag([-1.0, 1, 1])
    rotations = Rotation.from_rotvec(rng.normal(0, 0.3, (24 * 40, 3))).as_matrix().reshape(40, 24, 3, 3)
    mirrored = across @ rotations[:, mirror_index()] @ across
    found, other = (
        joint_angles(np.arange(40.0), moved, body.landmarks(betas), body.joints(betas), AngleSettings(convention))  # type: ignore[arg-type]
        for moved in (at_home(rotations), at_home(mirrored))
    )
    two_sided = {"r": "l", "R": "L", "l": "r", "L": "R"}
    for i, name in enumerate(found.names):
        if convention in ("visual3d", "plugin-gait"):
            twin = two_sided.get(name[0], "") + name[1:] if name[0] in "RL" else name
        else:
            twin = name[:-1] + two_sided[name[-1]] if name[-2:] in ("_r", "_l") else name
        theirs = other.degrees[:, other.names.index(twin)]
        anatomical = convention != "visual3d" and twin != name
        first = found.names[i].endswith("_X") or name in ("pelvis_tilt", "lumbar_extension", "trunk_flexion")
        sign = 1 if anatomical or first else -1
        off = (found.degrees[:, i] - sign * theirs + 180) % 360 - 180
        good = ~(found.singular[:, i] | other.singular[:, other.names.index(twin)])
        assert np.abs(off[good]).max() < 0.2, f"{name} and the mirrored {twin} differ by {np.abs(off[good]).max():.3f}"


def at_home(rotations: np.ndarray) -> np.ndarray:
    """The same pose with the root turned into the lab, facing along x."""
    stood = rotations.copy()
    stood[:, 0] = TO_LAB @ stood[:, 0]
    return stood


# -- a real trial ----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def squat(shared_data: Path) -> tuple[JointAngles, dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Our angles of another lab's OpenSim bodies, the same bodies, and published inverse kinematics of the trial."""
    folder = shared_data / "squat_video"
    stored = json.loads((folder / "bodies_mocap.json").read_text())
    lines = (folder / "squats1_ik.mot").read_text().splitlines()
    start = lines.index("endheader")
    names = lines[start + 1].split("\t")
    table = np.array([[float(x) for x in line.split()] for line in lines[start + 2 :]])
    assert "inDegrees=no" in lines
    reference = {name: np.degrees(table[:, i]) for i, name in enumerate(names)}
    time = np.array(stored["time"])
    assert np.abs(time - table[:, 0]).max() < 1e-6
    bodies = {
        name: Rotation.from_euler("XYZ", np.array(body["rotation"])).as_matrix()
        for name, body in stored["bodies"].items()
    }
    names_there = {"thigh": "femur", "shank": "tibia", "foot": "calcn", "upper_arm": "humerus", "forearm": "radius"}
    names_there |= {"hand": "hand"}
    internal = lab_rotation("y").T
    segments = {"pelvis": internal @ bodies["pelvis"], "thorax": internal @ bodies["torso"]}
    for side in ("left", "right"):
        for ours, theirs in names_there.items():
            segments[f"{side}_{ours}"] = internal @ bodies[f"{theirs}_{side[0]}"]
    return read_angles(time, segments, AngleSettings()), reference, bodies


LARGEST_DIFFERENCE = {  # degrees: standard deviation, mean; the two labs' kinematics differ by this much themselves
    "pelvis_tilt": (2, 3),
    "pelvis_list": (1, 1.5),
    "pelvis_rotation": (1, 2),
    "lumbar_extension": (3, 3.5),
    "lumbar_bending": (1, 1),
    "lumbar_rotation": (1, 3.5),
    "hip_flexion": (2, 5),
    "hip_adduction": (2.5, 7),
    "hip_rotation": (5, 3),
    "knee_angle": (4.5, 3),
    "ankle_angle": (7, 4),
    "arm_flex": (3, 3),
    "arm_add": (2, 5),
    "arm_rot": (5, 5),
    "elbow_flex": (3, 10),  # OpenSim's axis is oblique to the humerus
}


@pytest.mark.parametrize("name", LARGEST_DIFFERENCE)
def test_names_and_signs_are_those_of_opensim(squat: Any, name: str) -> None:
    angles, reference, _ = squat
    spread, offset = LARGEST_DIFFERENCE[name]
    for column in (name,) if name in angles.names else (f"{name}_r", f"{name}_l"):
        difference = angles.degrees[:, angles.names.index(column)] - reference[column]
        said = f"{column}: {difference.mean():+.2f} degrees, standard deviation {difference.std():.2f}"
        assert difference.std() < spread and abs(difference.mean()) < offset, said
        if np.ptp(reference[column]) > 20:
            assert np.corrcoef(angles.degrees[:, angles.names.index(column)], reference[column])[0, 1] > 0.85, said


def test_pronation_counts_from_the_palm_forwards_as_in_opensim(squat: Any) -> None:
    """The reference holds it at 120 degrees; the palms face each other or down throughout."""
    angles, _, _ = squat
    for side in "rl":
        found = np.median(angles.degrees[:, angles.names.index(f"pro_sup_{side}")])
        assert 60 < found < 140, f"pro_sup_{side} is {found:.0f}"


def test_opensims_foot_moves_about_the_two_axes_alone(squat: Any) -> None:
    """Its calcaneus has two degrees of freedom against the tibia: our two angles rebuild all of the rotation."""
    angles, _, bodies = squat
    axes = np.array(conventions()["opensim"]["joints"]["ankle"]["axes"])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    for side, flip in (("r", np.eye(3)), ("l", np.diag([1.0, 1, -1]))):
        relative = flip @ np.swapaxes(bodies[f"tibia_{side}"], 1, 2) @ bodies[f"calcn_{side}"] @ flip
        columns = [angles.names.index(f"{name}_angle_{side}") for name in ("ankle", "subtalar")]
        turns = [Rotation.from_rotvec(np.radians(angles.degrees[:, [c]]) * axes[k]) for k, c in enumerate(columns)]
        remaining = np.degrees((turns[0] * turns[1] * Rotation.from_matrix(relative).inv()).magnitude())
        assert remaining.max() < 0.01, f"{remaining.max():.4f} degrees are left"


# -- what is written -------------------------------------------------------------------------------------------


def raised_arm() -> JointAngles:
    """Ten frames of the right arm going up sideways from 70 to 110 degrees."""
    rotations = np.tile(np.eye(3), (41, 24, 1, 1))
    for name, matrix in STANDING.items():
        rotations[:, INDEX[name]] = matrix
    for i, abduction in enumerate(np.arange(70.5, 111.5)):
        rotations[i, INDEX["right_shoulder"]] = turn(z=90 - abduction)
    return joint_angles(np.arange(41) / 100, at_home(rotations), *square_body("opensim"), AngleSettings())


def test_singular_frames_are_empty_in_the_csv_and_counted_beside_it(tmp_path: Path) -> None:
    angles = raised_arm()
    write_angles(tmp_path, angles, {"program": "test"})
    with open(tmp_path / "angles.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time", *angles.names] and len(rows) == 41
    empty = {name: [row[name] == "" for row in rows] for name in angles.names}
    near = [abs(abduction - 90) < 4 for abduction in np.arange(70.5, 111.5)]
    for name in angles.names:
        assert empty[name] == (near if name in ("arm_flex_r", "arm_rot_r") else [False] * 41), name
    off = np.array([float(row["arm_add_r"]) for row in rows]) + np.arange(70.5, 111.5)
    assert np.abs(off).max() < 1.01, f"abduction goes on through 90 degrees, within a frame's step, not {off}"
    about = json.loads((tmp_path / "angles.json").read_text())
    counted = {entry["column"]: entry["singular_frames"] for entry in about["angles"]}
    assert counted["arm_flex_r"] == sum(near) == 8 and counted["arm_add_r"] == 0
    assert about["program"] == "test" and about["units"] == {"time": "s", "angles": "degrees"}
    assert about["zero_pose"] and "evidence" not in about["angles"][0]
    long = list(csv.DictReader(angles_long_csv(angles).splitlines()))
    flagged = [row for row in long if row["singular"] == "1"]
    assert len(long) == 41 * len(angles.names) and len(flagged) == 16
    assert all(row["degrees"] == "" for row in flagged)


def test_evidence_says_which_segments_carry_markers(tmp_path: Path) -> None:
    leg = np.array([INDEX[name] for name in ("left_hip", "left_hip", "left_knee", "left_foot")] + [-1])
    found = evidence("opensim", leg)
    assert found["knee_angle_l"] == found["ankle_angle_l"] == found["subtalar_angle_l"] == "markers"
    assert found["hip_flexion_l"] == "one segment"
    assert found["knee_angle_r"] == found["pelvis_tilt"] == found["lumbar_extension"] == "video only"
    assert set(evidence("isb", np.arange(24)).values()) == {"markers"}
    assert set(evidence("plugin-gait", np.array([-1, -1])).values()) == {"video only"}
    on_clavicle = evidence("opensim", np.array([INDEX["right_collar"], INDEX["right_shoulder"]]))
    assert on_clavicle["arm_flex_r"] == "markers" and on_clavicle["arm_flex_l"] == "one segment"
    write_angles(tmp_path, raised_arm(), {}, found)
    about = json.loads((tmp_path / "angles.json").read_text())
    assert {entry["column"]: entry["evidence"] for entry in about["angles"]} == found


def test_standard_errors_stand_in_the_sidecar_and_where_asked_for_in_columns(tmp_path: Path) -> None:
    angles = raised_arm()
    shape, level = np.full(angles.degrees.shape, 3.0), np.full(angles.degrees.shape, 4.0)
    shape[angles.singular] = level[angles.singular] = np.nan
    definition = np.full(len(angles.names), 1.5)
    errors = AngleErrors(angles.names, shape, level, definition, 2.5, 8.0, float("nan"))
    write_angles(tmp_path, angles, {}, None, errors)
    about = json.loads((tmp_path / "angles.json").read_text())
    assert all(row["standard_error"] == {"level": 4.0, "shape": 3.0, "definition": 1.5} for row in about["angles"])
    assert about["noise"] == {"marker_mm": 2.5, "video_deg": 8.0, "image_share": None}
    assert "_se" not in (tmp_path / "angles.csv").read_text()
    write_angles(tmp_path, angles, {}, None, errors, columns=True)
    with open(tmp_path / "angles.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time", *angles.names, *(f"{name}_se" for name in angles.names)]
    for i, name in enumerate(angles.names):
        told = [row[f"{name}_se"] for row in rows]
        assert told == ["" if flag else "5.0000" for flag in angles.singular[:, i]]


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_every_bone_bears_on_some_angle_or_none(convention: str) -> None:
    """A marker anywhere only ever adds to the evidence."""
    order = {"video only": 0, "one segment": 1, "markers": 2}
    everything = evidence(convention, np.arange(len(JOINTS)))
    for joint in range(len(JOINTS)):
        for column, word in evidence(convention, np.array([joint])).items():
            assert order[word] <= order[everything[column]]


# -- what the documentation says -------------------------------------------------------------------------------


def documented(convention: str) -> str:
    """The table of one convention in ``docs/angles.md``, from the conventions as data."""
    lines = ["| joint | sequence | column | positive |", "| --- | --- | --- | --- |"]
    for joint, row in conventions()[convention]["joints"].items():
        about = row.get("sequence", "two axes")
        for name, sign, axis, positive in zip(
            row["columns"], row["signs"], row.get("sequence", "12"), row["positive"], strict=False
        ):
            if name:
                shown = name.replace("{s}", "r").replace("{S}", "R")
                turn_of = f"{'+' if sign > 0 else '-'}{axis}" if "sequence" in row else f"axis {axis}"
                lines.append(f"| {joint} | {about} | `{shown}` ({turn_of}) | {positive} |")
    return "\n".join(lines)


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_the_documentation_tells_the_conventions_as_they_are(convention: str) -> None:
    page = (Path(__file__).parents[1] / "docs" / "angles.md").read_text(encoding="utf-8")
    chapter = page.split(f"### `{convention}`")[1].split("\n#")[0]
    assert documented(convention) in chapter, f"docs/angles.md should hold\n{documented(convention)}"
    assert conventions()[convention]["title"] in chapter
