"""A user's own body, read from a file in SMPL's layout: it moves as SMPL's equations say, and is named like ours."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.solver.angles.angles import AngleSettings, joint_angles
from markerscope.solver.body.adapt import load_smpl
from markerscope.solver.body.model import EMBEDDED, Body
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import PARENTS


@pytest.fixture(scope="module")
def embedded() -> Body:
    return Body.load()


def smpl_file(body: Body, index: np.ndarray, faces: np.ndarray, *, correctives: bool) -> dict[str, Any]:
    """Some vertices of a body as the arrays of an SMPL file, with random shapes and pose correctives."""
    rng = np.random.default_rng(0)
    template = body.template[index]
    # Weights of vertices that give the joint centres and add up to 1: the least ones.
    system = np.vstack([template.T, np.ones(len(index))])
    regressor = np.linalg.pinv(system) @ np.vstack([body.joint_template.T, np.ones(24)])
    parents = PARENTS.astype(np.int64)
    parents[0] = 2**32 - 1
    arrays = {
        "v_template": template,
        "shapedirs": rng.normal(0, 0.005, (len(index), 3, 12)),
        "J_regressor": regressor.T,
        "weights": body.weights[index] / body.weights[index].sum(axis=1, keepdims=True),
        "f": faces.astype(np.uint32),
        "kintree_table": np.stack([parents, np.arange(24)]),
    }
    if correctives:
        arrays["posedirs"] = rng.normal(0, 0.002, (len(index), 3, 207))
    return arrays


@pytest.fixture(scope="module")
def arrays(embedded: Body) -> dict[str, Any]:
    return smpl_file(embedded, embedded.lod_index, embedded.lod_faces, correctives=True)


@pytest.fixture(params=["npz", "pkl"])
def own(request: pytest.FixtureRequest, arrays: dict[str, Any], tmp_path: Path) -> Body:
    path = tmp_path / f"SMPL_NEUTRAL.{request.param}"
    if request.param == "npz":
        np.savez(path, **arrays)
    else:
        path.write_bytes(pickle.dumps(arrays, protocol=2))
    return Body.load(path)


def posed_by_loops(arrays: dict[str, Any], vectors: np.ndarray, betas: np.ndarray, trans: np.ndarray) -> np.ndarray:
    """(V, 3) linear blend skinning as Loper et al. (2015) write it, one vertex and one joint at a time."""
    shaped = arrays["v_template"].copy()
    for k, beta in enumerate(betas):
        shaped += beta * arrays["shapedirs"][:, :, k]
    joints = [sum(w * p for w, p in zip(row, shaped, strict=True)) for row in arrays["J_regressor"]]
    rotations = [exp_so3(vector) for vector in vectors]
    feature = np.concatenate([(rotation - np.eye(3)).ravel() for rotation in rotations[1:]])
    world = [np.eye(4) for _ in range(24)]
    for j in range(24):
        local = np.eye(4)
        local[:3, :3] = rotations[j]
        local[:3, 3] = joints[j] - (joints[PARENTS[j]] if j else 0)
        world[j] = world[PARENTS[j]] @ local if j else local
    for j in range(24):
        unposed = np.eye(4)
        unposed[:3, 3] = -joints[j]
        world[j] = world[j] @ unposed
    posed = np.zeros_like(shaped)
    for v in range(len(shaped)):
        rest = np.append(shaped[v] + arrays["posedirs"][v] @ feature, 1.0)
        for j in range(24):
            if arrays["weights"][v, j] > 0:
                posed[v] += arrays["weights"][v, j] * (world[j] @ rest)[:3]
    return posed + trans


def random_pose(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.normal(0, 0.5, (24, 3)), rng.normal(0, 1, 10), rng.normal(0, 1, 3)


def test_a_file_moves_as_smpl_does(own: Body, arrays: dict[str, Any]) -> None:
    poses = [random_pose(seed) for seed in (1, 2)]
    betas = poses[0][1]
    expected = np.stack([posed_by_loops(arrays, vectors, betas, trans) for vectors, _, trans in poses])
    rotations = exp_so3(np.stack([vectors for vectors, _, _ in poses]))
    trans = np.stack([t for _, _, t in poses])
    found, joints = own.pose(rotations, betas, trans)
    worst = np.linalg.norm(found - expected, axis=2).max()
    assert worst < 1e-9, f"a vertex is {worst:.2e} m off"
    chosen = np.array([3, 700, 41])
    assert np.abs(own.pose(rotations, betas, trans, chosen)[0] - expected[:, chosen]).max() < 1e-9
    assert np.abs(joints[:, 0] - (own.joints(betas)[0] + trans)).max() < 1e-12, "the root turns about itself"


def test_numpy_and_torch_agree_on_pose_correctives(own: Body) -> None:
    torch = pytest.importorskip("torch")
    vectors, betas, trans = random_pose(3)
    given = (exp_so3(vectors)[None], betas, trans[None])
    plain, _ = own.pose(*given)
    tensors, _ = own.pose(*(torch.tensor(x) for x in given))
    assert np.abs(tensors.numpy() - plain).max() < 1e-9


def test_the_files_arrays_are_kept(own: Body, arrays: dict[str, Any]) -> None:
    assert own.betas_count == own.shape_count == 10, "components beyond ten are left out"
    assert np.abs(own.weights - arrays["weights"]).max() < 1e-12
    assert np.abs(own.joint_template - arrays["J_regressor"] @ arrays["v_template"]).max() < 1e-12
    assert own.name.startswith("SMPL_NEUTRAL") and len(own.digest) == 16 and own.digest != Body.load().digest


def test_landmarks_and_marker_places_are_carried_over(own: Body, embedded: Body) -> None:
    """Here the file is our own body's coarse mesh, so its landmarks should be ours to within its spacing."""
    betas = np.zeros(10)
    theirs = embedded.landmarks(betas)
    off = {name: np.linalg.norm(point - theirs[name]) for name, point in own.landmarks(betas).items()}
    assert set(off) == set(theirs)
    worst = max(off, key=lambda name: off[name])
    assert off[worst] < 0.03, f"{worst} is {off[worst] * 1000:.0f} mm off"
    agree = own.marker_mask == embedded.marker_mask[embedded.lod_index]
    assert agree.mean() > 0.95


def test_angles_of_a_users_body_are_those_of_the_embedded_one(own: Body, embedded: Body) -> None:
    rotations = exp_so3(random_pose(4)[0][None] * 0.4)
    settings = AngleSettings()
    mine, ours = (
        joint_angles(np.zeros(1), rotations, b.landmarks(np.zeros(10)), b.joints(np.zeros(10)), settings)
        for b in (own, embedded)
    )
    off = np.where(ours.singular | mine.singular, 0, (mine.degrees - ours.degrees + 180) % 360 - 180)
    worst = int(np.abs(off).argmax())
    assert np.abs(off).max() < 15, f"{ours.names[worst]} differs by {off.flat[worst]:.1f} degrees"


def test_a_finer_body_gets_a_coarse_mesh_of_its_own(embedded: Body, tmp_path: Path) -> None:
    arrays = smpl_file(embedded, np.arange(len(embedded.template)), embedded.faces, correctives=False)
    np.savez(tmp_path / "SMPL.npz", **arrays)
    own = load_smpl(tmp_path / "SMPL.npz")
    assert len(own.lod_index) > 0.9 * len(embedded.lod_index)
    edges = {tuple(edge) for edge in own.lod_faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2).tolist()}
    lonely = np.mean([(b, a) not in edges for a, b in edges])
    assert lonely < 0.005, f"{100 * lonely:.1f} % of the edges have a face on one side only"
    corners = own.template[own.lod_index][own.lod_faces]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    assert longest < 0.15, f"an edge is {longest * 1000:.0f} mm long"


def test_the_embedded_file_can_be_named_too(embedded: Body) -> None:
    assert Body.load(EMBEDDED).digest == embedded.digest
