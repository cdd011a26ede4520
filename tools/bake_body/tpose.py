"""From the rig's A-pose to SMPL's T-pose, about the anatomical joint centres.

The skin is moved by the *inverse* of linear blend skinning, so that posing the baked body back into the A-pose gives
the sculpted surface again, and errors of skinning are nil near the poses that people are mostly in.
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import INDEX, PARENTS

LEG_ABDUCTION = np.radians(3.0)
"""How far each straight leg leans outwards in the T-pose, so that the thighs do not merge."""


def straighten(
    joints: np.ndarray, vertices: np.ndarray, weights: np.ndarray, at: dict[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (N, V, 3) and joints (N, 24, 3) in the T-pose with the pelvis at the origin.

    Parameters
    ----------
    joints : (N, 24, 3) m, anatomical centres in the A-pose
    vertices : (N, V, 3) m in the A-pose
    weights : (V, 24)
    at : landmarks (N, 3) by name, in the A-pose
    """
    turns = np.stack([rotations(joints, at, i) for i in range(len(joints))])
    placed = np.zeros_like(joints)
    for j in range(1, 24):
        parent = PARENTS[j]
        offset = joints[:, j] - joints[:, parent]
        placed[:, j] = placed[:, parent] + np.einsum("nab,nb->na", turns[:, parent], offset)
    back = turns.transpose(0, 1, 3, 2)
    shift = joints - np.einsum("njab,njb->nja", back, placed)
    skin = np.empty(vertices.shape)
    for n in range(len(vertices)):  # one body at a time: the blended matrices are large
        matrix = np.tensordot(weights, back[n], axes=1)
        skin[n] = np.linalg.solve(matrix, (vertices[n] - weights @ shift[n])[..., None])[..., 0]
    return skin, placed


def rotations(joints: np.ndarray, at: dict[str, np.ndarray], n: int) -> np.ndarray:
    """(24, 3, 3) of body ``n``: how each bone turns, in the lab, from the A-pose to the T-pose."""
    turns = np.tile(np.eye(3), (24, 1, 1))
    point = {name: joints[n, j] for name, j in INDEX.items()}
    for side, sign in (("left", 1.0), ("right", -1.0)):
        mark = {name[len(side) + 1 :]: xyz[n] for name, xyz in at.items() if name.startswith(side)}
        shoulder, elbow, wrist, hand = (point[f"{side}_{j}"] for j in ("shoulder", "elbow", "wrist", "hand"))
        out, up, front = np.array([sign, 0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, 1.0])
        arm = {
            "shoulder": _turn(elbow - shoulder, mark["elbow_lateral"] - mark["elbow_medial"], out, up),
            "elbow": _turn(wrist - elbow, mark["wrist_radius"] - mark["wrist_ulna"], out, front),
            "wrist": _turn(hand - wrist, mark["wrist_radius"] - mark["wrist_ulna"], out, front),
        }
        arm["hand"] = arm["wrist"]

        hip, knee, ankle = (point[f"{side}_{j}"] for j in ("hip", "knee", "ankle"))
        down = np.array([sign * np.sin(LEG_ABDUCTION), -np.cos(LEG_ABDUCTION), 0])
        outward = sign * (mark["knee_lateral"] - mark["knee_medial"])
        thigh = _turn(knee - hip, outward, down, np.array([1.0, 0, 0]))
        shank = _least(thigh @ (ankle - knee), down) @ thigh
        sole = mark["toe"] - mark["calcaneus"]
        foot = _least(np.array([sole[0], 0, sole[2]]), front)  # stays flat, points ahead
        leg = {"hip": thigh, "knee": shank, "ankle": foot, "foot": foot}
        for joint, turn in (arm | leg).items():
            turns[INDEX[f"{side}_{joint}"]] = turn
    return turns


def _turn(along: np.ndarray, across: np.ndarray, to_along: np.ndarray, to_across: np.ndarray) -> np.ndarray:
    """The rotation that takes one direction exactly and a second one as nearly as may be to two given ones."""
    return _frame(to_along, to_across) @ _frame(along, across).T


def _frame(along: np.ndarray, across: np.ndarray) -> np.ndarray:
    x = along / np.linalg.norm(along)
    z = np.cross(x, across)
    z = z / np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _least(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The smallest rotation from one direction to another."""
    a, b = a / np.linalg.norm(a), b / np.linalg.norm(b)
    x, y, z = np.cross(a, b)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + cross + cross @ cross / (1 + a @ b)
