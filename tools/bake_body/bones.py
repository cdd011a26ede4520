"""Lay the bones of Rajagopal's model into the body and write ``resources/body/bones.npz``.

    python -m tools.bake_body.bones WHEEL

WHEEL is that of nimblephysics 0.10.52.1 (``pip download --no-deps nimblephysics==0.10.52.1``). Which point of the model
belongs to which of the body is in ``bones.toml``. Run it after the body was baked anew.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from markerscope.solver.body.bone_meshes import FILE, STIFFNESS, anchor_places, carried
from markerscope.solver.body.bony import BonySites
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX
from tools.bake_body.fingers import straight_fingers
from tools.bake_body.rajagopal import Mesh, Model, joined, pieces

TABLE = Path(__file__).with_name("bones.toml")
FACES = 15_900
"""What all bones have together: 15 ms to draw in software."""
LEAST = 60
"""Faces that every separate bone keeps."""
STEP = 1e-4
"""m that places are rounded to in the file."""
TO_REST = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])
"""The model's axes (forward, up, right) in the body's (left, up, forward)."""
_TRUNK = ("pelvis", "spine1", "spine2", "spine3", "neck", "head")
_LUMBAR, _NECK = (0.03, 0.14), (0.41, 0.50)
"""m up in the model's torso: where vertebrae pass from the pelvis to the thorax, and from the thorax to the skull."""
_BETWEEN = {
    "lumbar": ("left_psis", "right_psis", "left_asis", "right_asis", "spine1", "spine2", "spine3", "t8"),
    "cervical": ("c7", "sternum_ij", "neck", "head", "bp_left_ear", "bp_right_ear"),
}
"""What vertebrae are tied to that belong to neither pelvis, thorax nor skull."""
_NEAR = 0.02
"""m from a joint, where its bone begins to move as a whole."""
PATELLA_WITH_SHANK = 0.8
"""The kneecap turns about the thigh by 0.85 of the knee's angle and comes nearer to its axis (the model's splines)."""


@dataclass(frozen=True)
class Part:
    """A bone laid into the rest body: its mesh, segment, and the two joints that share it."""

    mesh: Mesh
    segment: str
    first: int
    second: int
    share: float


def lay(model: Model, body: Body) -> tuple[list[Part], dict[str, dict[str, np.ndarray]]]:
    """Every bone in the rest pose of the body's mean shape, and the anchors of each segment with their places."""
    table = tomllib.loads(TABLE.read_text(encoding="utf-8"))["segment"]
    nothing = np.zeros(body.shape_count)
    places = anchor_places(body, nothing)
    inward = _inward(body)
    straight = straight_fingers(model)
    parts: list[Part] = []
    anchors: dict[str, dict[str, np.ndarray]] = {}
    maps: dict[str, Callable[[np.ndarray], np.ndarray]] = {}
    for key, row in table.items():
        source, target, names = [], [], []
        for *frame, point, name, depth in row["anchors"]:
            name = name.format(side="right")
            own = model.frame(frame[0] if frame else row["frame"], row["frame"])
            source.append(own[:3, :3] @ point + own[:3, 3])
            target.append(places[name] + depth / 1000 * inward.get(name, 0.0))
            names.append(name)
        model_points, places_there = np.array(source) @ TO_REST.T, np.array(target)
        maps[key] = partial(carried, model_points, places_there, stiffness=row.get("stiffness", STIFFNESS))
        _report(key.format(side="right"), names, maps[key](model_points) - places_there)
        for sided in ("right", "left") if "{side}" in key else ("",):
            segment = key.format(side=sided)
            own = [name.replace("right", sided) if sided else name for name in names]
            anchors[segment] = {name: places[name] for name in own}
            for mesh, frame, joint in row["parts"]:
                whole = straight.get(mesh) or model.mesh(mesh.replace("{side}", "right"), frame)
                turn = model.frame(frame, row["frame"])
                points = (whole.vertices @ turn[:3, :3].T + turn[:3, 3]) @ TO_REST.T
                laid = Mesh(maps[key](points), whole.faces)
                laid = _mirrored(laid) if sided == "left" else _outward(laid)
                parts.append(_with_joints(laid, segment, joint.format(side=sided)))
    for segment, own in _BETWEEN.items():
        anchors[segment] = {name: places[name] for name in own}
    return parts + _spine(model, maps, places), anchors


def _with_joints(mesh: Mesh, segment: str, joint: str) -> Part:
    if joint == "patella":
        side = segment.split("_")[0]
        return Part(mesh, segment, INDEX[f"{side}_hip"], INDEX[f"{side}_knee"], PATELLA_WITH_SHANK)
    return Part(mesh, segment, INDEX[joint], INDEX[joint], 0.0)


def _spine(
    model: Model, maps: Mapping[str, Callable[[np.ndarray], np.ndarray]], places: Mapping[str, np.ndarray]
) -> list[Part]:
    """Each vertebra where pelvis, thorax and skull, as they were laid, would have it, the nearer one more."""
    to_pelvis = model.frame("torso", "pelvis")
    found = []
    for piece in pieces(model.mesh("hat_spine", "torso")):
        points = piece.vertices @ TO_REST.T
        thorax = maps["thorax"](points)
        by_pelvis = maps["pelvis"]((piece.vertices + to_pelvis[:3, 3]) @ TO_REST.T)
        by_head = maps["head"](points)
        up = piece.vertices[:, 1:2]
        low, high = (np.interp(up, ends, (0, 1)) for ends in (_LUMBAR, _NECK))
        low, high = (x * x * (3 - 2 * x) for x in (low, high))
        laid = thorax + (1 - low) * (by_pelvis - thorax) + high * (by_head - thorax)
        middle = piece.vertices[:, 1].mean()
        segment = "lumbar" if middle < _LUMBAR[1] else "cervical" if middle > _NECK[0] + 0.01 else "thorax"
        found.append(Part(_outward(Mesh(laid, piece.faces)), segment, *_joints_at(laid[:, 1].mean(), places)))
    return found


def _joints_at(height: float, places: Mapping[str, np.ndarray]) -> tuple[int, int, float]:
    """The two joints of the trunk that a vertebra moves with, and the share of the second.

    A joint's bone reaches from it to the next joint; in the middle of it a vertebra moves with it alone.
    """
    at = {name: places[name][1] for name in _TRUNK}
    knots = {
        (at["pelvis"] + at["spine1"]) / 2: 0,
        (at["spine1"] + at["spine2"]) / 2: 1,
        (at["spine2"] + at["spine3"]) / 2: 2,
        at["spine3"] + _NEAR: 3,
        at["neck"] - _NEAR: 3,  # the thorax is one piece
        (at["neck"] + at["head"]) / 2: 4,
        at["head"] + _NEAR: 5,
    }
    place = float(np.interp(height, list(knots), list(knots.values())))
    first, second = int(np.floor(place)), int(np.ceil(place))
    return INDEX[_TRUNK[first]], INDEX[_TRUNK[second]], place - first


def _inward(body: Body) -> dict[str, np.ndarray]:
    """Unit vectors (3,) into the body at every landmark on the skin, by name."""
    count = len(body.landmark_names)
    every = BonySites(
        body.landmark_names, np.arange(count), body.landmark_vertices, body.landmark_values, body.landmark_bone
    )
    normals = every.normals(body, body.template)
    return {name: -normals[i] for i, name in enumerate(every.names) if body.landmark_joint[i] < 0}


def _mirrored(mesh: Mesh) -> Mesh:
    return _outward(Mesh(mesh.vertices * [-1, 1, 1], mesh.faces))


def _outward(mesh: Mesh) -> Mesh:
    """Faces turned so that the bone has a positive volume."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] - mesh.vertices.mean(axis=0) for i in range(3))
    inside_out = np.einsum("fd,fd->", a, np.cross(b, c)) < 0
    return Mesh(mesh.vertices, mesh.faces[:, ::-1] if inside_out else mesh.faces)


def thin_out(parts: list[Part], faces: int) -> list[Part]:
    """The same bones with about ``faces`` faces in all, by quadric error (Garland and Heckbert 1997)."""
    import open3d

    counts = np.array([len(part.mesh.faces) for part in parts], float)
    low, high = 0.0, 1.0
    for _ in range(40):  # the share that all but the smallest bones keep
        share = (low + high) / 2
        low, high = (share, high) if _kept(counts, share).sum() < faces else (low, share)
    found = []
    for part, wanted in zip(parts, _kept(counts, low)):
        mesh = open3d.geometry.TriangleMesh(
            open3d.utility.Vector3dVector(part.mesh.vertices),
            open3d.utility.Vector3iVector(np.ascontiguousarray(part.mesh.faces, dtype=np.int32)),
        )
        mesh.remove_duplicated_vertices()
        mesh.remove_degenerate_triangles()
        mesh = mesh.simplify_quadric_decimation(int(wanted))
        mesh.remove_unreferenced_vertices()
        found.append(replace(part, mesh=Mesh(np.asarray(mesh.vertices), np.asarray(mesh.triangles))))
    return found


def _kept(counts: np.ndarray, share: float) -> np.ndarray:
    return np.clip(counts * share, np.minimum(counts, LEAST), counts).round()


def packed(parts: list[Part], anchors: Mapping[str, Mapping[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """The arrays of the file."""
    whole = joined([part.mesh for part in parts])
    counts = [len(part.mesh.vertices) for part in parts]
    segments = list(anchors)
    # Neighbouring faces have neighbouring numbers: their differences take half the room.
    faces = np.diff(whole.faces, axis=0, prepend=0)
    return {
        "step": np.array(STEP),
        "vertices": (whole.vertices / STEP).round().astype(np.int16),
        "faces": faces.astype(np.int32 if np.abs(faces).max() > 32767 else np.int16),
        "segment": np.repeat([segments.index(part.segment) for part in parts], counts).astype(np.uint8),
        "first_joint": np.repeat([part.first for part in parts], counts).astype(np.uint8),
        "second_joint": np.repeat([part.second for part in parts], counts).astype(np.uint8),
        "second_share": np.repeat([round(255 * part.share) for part in parts], counts).astype(np.uint8),
        "anchors_count": np.array([len(own) for own in anchors.values()], dtype=np.uint8),
        "anchor_names": np.array([name for own in anchors.values() for name in own]),
        "anchor_places": np.array([place for own in anchors.values() for place in own.values()], dtype=np.float32),
    }


def _report(segment: str, names: list[str], off: np.ndarray) -> None:
    """Print how far the model's points come to lie from the body's, (K, 3) m."""
    far = 1000 * np.linalg.norm(off, axis=1)
    print(f"  {segment:16s}mm off: " + ", ".join(map("{} {:.0f}".format, names, far)))


def main() -> None:
    """Read the wheel, write the npz."""
    parser = argparse.ArgumentParser(description="Lay the bones of Rajagopal et al. (2016) into the embedded body.")
    parser.add_argument("wheel", type=Path, help="of nimblephysics 0.10.52.1")
    parser.add_argument("--out", type=Path, default=FILE)
    arguments = parser.parse_args()
    parts, anchors = lay(Model(arguments.wheel), Body.load())
    parts = thin_out(parts, FACES)
    temporary = arguments.out.with_suffix(".part.npz")
    np.savez_compressed(temporary, **packed(parts, anchors))  # type: ignore[arg-type]
    temporary.replace(arguments.out)
    count = sum(len(part.mesh.faces) for part in parts)
    print(f"{len(parts)} bones, {count} faces; {arguments.out.name}: {arguments.out.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
