"""One reader per program: the fields it writes, and nothing else."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.priors.fragments import Piece, joined, one_person
from markerscope.solver.io.priors.track import Track, numbers, rotations_from_matrices, rotations_from_vectors

_Y_UP = np.diag([1.0, -1, -1])
"""Turns a y-up world to a level camera's axes (x right, y down, z away)."""
_Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
_AGAIN = "export the reconstruction again"
_KINDS = {72: "smpl", 156: "smplh", 165: "smplx"}
"""Whose body a row of rotation vectors belongs to, by its length; 66 are anybody's."""
_RATES = ("mocap_frame_rate", "mocap_framerate", "fps")


def read_phalp(data: dict[Any, Any], where: str) -> Track:
    """4D-Humans / PHALP: per frame, lists parallel to ``tid``; an entry with ``tracked_time`` > 0 is a stale ghost."""
    found: dict[int, dict[int, Any]] = {}
    for order, entry in enumerate(data.values()):
        time = entry.get("time") if isinstance(entry, dict) else None
        frame = int(time) if isinstance(time, int | np.integer) else order
        for person, body in _real_entries(entry, where):
            found.setdefault(person, {}).setdefault(frame, body)
    if not found:
        raise InputError("no person was tracked in any of its frames", where, "use a video that shows the whole person")
    pieces: dict[int, Piece] = {}
    for person, bodies in found.items():
        frames = sorted(bodies)
        matrices = np.stack([_phalp_pose(bodies[f], where) for f in frames])
        pieces[person] = Piece(np.array(frames), rotations_from_matrices(matrices, "smpl", where))
    chain, notes = one_person(pieces)
    piece = joined(pieces, chain)
    last = max(max(per_frame) for per_frame in found.values())
    shapes = [found[person][int(f)].get("betas") for person in chain for f in pieces[person].frames]
    sizes = {np.size(shape) for shape in shapes if isinstance(shape, np.ndarray)}
    alike = len(sizes) == 1 and all(isinstance(shape, np.ndarray) for shape in shapes)
    betas = np.stack([np.ravel(shape) for shape in shapes]) if alike else None
    seen = np.ones(len(piece.frames), bool)
    track = Track(piece.rotations, piece.frames, seen, notes=notes, betas=betas, kind="smpl")
    return _extended(track, max(last, len(data) - 1))


def _real_entries(entry: Any, where: str) -> list[tuple[int, Any]]:
    """(track id, body) of the people that were really seen in a frame."""
    if isinstance(entry, dict) and not {"tid", "smpl"} & set(entry):  # nobody was there yet
        return []
    if not isinstance(entry, dict) or not isinstance(entry.get("tid"), list) or not isinstance(entry.get("smpl"), list):
        raise InputError("one of its frames has no lists 'tid' and 'smpl'", where, _AGAIN)
    ids, bodies = entry["tid"], entry["smpl"]
    ages = entry.get("tracked_time") or [0] * len(ids)
    if len(ids) != len(bodies) or not isinstance(ages, list) or len(ages) != len(ids):
        raise InputError("one of its frames has lists of different lengths", where, _AGAIN)
    if not all(isinstance(n, int | np.integer) for n in (*ids, *ages)):
        raise InputError("one of its frames has track ids that are not numbers", where, _AGAIN)
    return [(int(i), body) for i, body, age in zip(ids, bodies, ages) if age == 0]


def _phalp_pose(body: Any, where: str) -> np.ndarray:
    if not isinstance(body, dict) or not {"global_orient", "body_pose"} <= set(body):
        raise InputError("one of its bodies lacks 'global_orient' or 'body_pose'", where, _AGAIN)
    root, joints = (
        numbers(body["global_orient"], "global_orient", where),
        numbers(body["body_pose"], "body_pose", where),
    )
    if root.size != 9 or joints.size != 23 * 9:
        raise InputError("one of its bodies does not have 1 + 23 rotation matrices", where, _AGAIN)
    return np.concatenate([root.reshape(1, 3, 3), joints.reshape(23, 3, 3)])


def _extended(track: Track, last: int) -> Track:
    """The same track up to the video's last frame, which the person may have left before."""
    if last <= track.frames[-1]:
        return track
    nothing = np.full((1, *track.rotations.shape[1:]), np.nan)
    return Track(
        np.concatenate([track.rotations, nothing]),
        np.append(track.frames, last),
        np.append(track.tracked, False),
        notes=track.notes,
        betas=track.betas,
        kind=track.kind,
    )


def read_wham(data: dict[Any, Any], where: str) -> Track:
    """WHAM: per subject ``pose`` (T, 72) in the camera's axes, and ``frame_ids`` where it was seen."""
    pieces: dict[Hashable, Piece] = {}
    for person, subject in data.items():
        rotations = rotations_from_vectors(np.atleast_2d(numbers(subject["pose"], "pose", where)), "pose", where)
        ids = subject.get("frame_ids", subject.get("frame_id"))
        frames = _frames(ids, "frame_ids", len(rotations), where)
        if (np.diff(frames) <= 0).any():
            raise InputError("its frame numbers are not ascending counts", where, _AGAIN)
        if len(frames):
            pieces[person] = Piece(frames, rotations)
    if not pieces:
        raise InputError("it has no frames", where, _AGAIN)
    chain, notes = one_person(pieces)
    piece = joined(pieces, chain)
    longest = max(chain, key=lambda person: len(pieces[person].frames))
    seen = np.ones(len(piece.frames), bool)
    betas = data[longest].get("betas")
    return Track(piece.rotations, piece.frames, seen, notes=notes, betas=betas, kind="smpl")


def read_tram(data: dict[Any, Any], where: str) -> Track:
    """TRAM: ``pred_rotmat`` (T, 24, 3, 3) in the camera's axes, and ``frame`` where it was seen."""
    rotations = rotations_from_matrices(numbers(data["pred_rotmat"], "pred_rotmat", where), "pred_rotmat", where)
    frames = _frames(data.get("frame"), "frame", len(rotations), where)
    return Track(rotations, frames, np.ones(len(frames), bool), betas=data.get("pred_shape"), kind="smpl")


def read_gvhmr(data: dict[Any, Any], where: str) -> Track:
    """GVHMR: SMPL-X ``global_orient`` (L, 3) and ``body_pose`` (L, 63), in the camera or in a y-up world."""
    name = "smpl_params_incam" if "smpl_params_incam" in data else "smpl_params_global"
    parameters = data[name]
    if not isinstance(parameters, dict) or not {"global_orient", "body_pose"} <= set(parameters):
        raise InputError(f"'{name}' lacks 'global_orient' or 'body_pose'", where, _AGAIN)
    vectors = _joined(parameters["global_orient"], parameters["body_pose"], where)
    rotations = rotations_from_vectors(vectors, "body_pose", where)
    notes: tuple[str, ...] = ("SMPL-X has no hand joints of SMPL's kind; the hands are held straight.",)
    if name == "smpl_params_global":
        rotations[:, 0] = _Y_UP @ rotations[:, 0]
        notes += ("The root is in a world frame (y up); the solver finds its rotation to the lab.",)
    seen = np.ones(len(rotations), bool)
    betas = parameters.get("betas")
    return Track(rotations, np.arange(len(rotations)), seen, notes=notes, betas=betas, kind="smplx")


def read_amass(data: dict[str, Any], where: str) -> Track:
    """AMASS layout: ``poses`` (T, 72 | 156 | 165) or ``root_orient`` and ``pose_body``, a rate, perhaps ``tracked``."""
    if "poses" in data:
        vectors = numbers(data["poses"], "poses", where)
    else:
        vectors = _joined(data["root_orient"], data["pose_body"], where)
    if vectors.ndim < 2 or not len(vectors):
        raise InputError("it has no frames", where, _AGAIN)
    rotations = rotations_from_vectors(vectors, "poses", where)
    tracked = np.ones(len(rotations), bool)
    if "tracked" in data:
        tracked = numbers(data["tracked"], "tracked", where).astype(bool)
        if tracked.shape != (len(rotations),):
            raise InputError(
                f"its field 'tracked' has {tracked.size} entries for {len(rotations)} frames",
                where,
                "give one per frame",
            )
    rate = next((float(numbers(data[k], k, where).ravel()[0]) for k in _RATES if np.size(data.get(k, ())) == 1), None)
    time = numbers(data["time"], "time", where) if "time" in data else None
    rotations, note = _level(rotations, tracked)
    kind = _KINDS.get(vectors.reshape(len(vectors), -1).shape[1], "")
    if {"bone_lengths", "shaped"} & set(data):  # written by this program, of its own body
        kind = ""
    betas = data.get("betas") if kind else None
    return Track(rotations, np.arange(len(rotations)), tracked, rate, time, (note,), betas, kind)


def _level(rotations: np.ndarray, tracked: np.ndarray) -> tuple[np.ndarray, str]:
    """The root turned so that the body's mean up direction is a camera's (-y), where the file's axis can be told."""
    up = np.nan_to_num(rotations[tracked, 0, :, 1]).mean(axis=0) if tracked.any() else np.zeros(3)
    axis = int(np.argmax(np.abs(up)))
    turned = rotations.copy()
    if up[axis] > 0.6 and axis in (1, 2):
        turned[:, 0] = (_Y_UP if axis == 1 else _Z_UP) @ rotations[:, 0]
        frame = f"a world frame ({'xyz'[axis]} up)"
    elif up[axis] < -0.6 and axis == 1:
        frame = "a camera's frame (y down)"
    else:
        frame = "an unknown fixed frame"
    return turned, f"The root is taken to be in {frame}; the solver finds its rotation to the lab."


def _joined(root: Any, joints: Any, where: str) -> np.ndarray:
    root, joints = numbers(root, "global_orient", where), numbers(joints, "body_pose", where)
    root, joints = (a.reshape(len(a), -1) if a.ndim else a.reshape(1, 1) for a in (root, joints))
    if len(root) != len(joints) or root.shape[1] != 3:
        raise InputError("its root and body poses do not match in length", where, _AGAIN)
    return np.concatenate([root, joints], axis=1)


def _frames(ids: Any, name: str, count: int, where: str) -> np.ndarray:
    """(count,) the video frame of each pose; counted from 0 where the file does not say."""
    if ids is None:
        return np.arange(count)
    frames = numbers(np.asarray(ids) if isinstance(ids, list) else ids, name, where).ravel()
    if len(frames) != count or not (np.abs(frames) < 2**31).all():
        raise InputError(f"its field '{name}' has {len(frames)} entries for {count} poses", where, _AGAIN)
    return frames.astype(np.int64)
