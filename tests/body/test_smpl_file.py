"""Reading a user's SMPL file: a small body in SMPL's layout, in every container SMPL comes in."""

from __future__ import annotations

import pickle
import sys
import types
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from markerscope.solver.body.smpl_file import read_smpl_file
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import PARENTS

VERTICES = 60


def small_body(joints: int = 24, shapes: int = 12) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    template = rng.uniform(-0.5, 0.5, (VERTICES, 3))
    template[:2, 1] = -1.1, 0.6
    weights = rng.uniform(size=(VERTICES, joints))
    regressor = rng.uniform(size=(joints, VERTICES)) * (rng.uniform(size=(joints, VERTICES)) < 0.2)
    regressor[:, 0] += 0.1
    parents = np.resize(PARENTS, joints).astype(np.int64)
    parents[0] = 2**32 - 1
    return {
        "v_template": template,
        "shapedirs": rng.normal(size=(VERTICES, 3, shapes)),
        "posedirs": rng.normal(size=(VERTICES, 3, 207)),
        "J_regressor": regressor / regressor.sum(axis=1, keepdims=True),
        "weights": weights / weights.sum(axis=1, keepdims=True),
        "f": rng.integers(0, VERTICES, (80, 3)).astype(np.uint32),
        "kintree_table": np.stack([parents, np.arange(joints)]).astype(np.uint32),
        "bs_type": "lrotmin",
    }


def check(found: dict[str, np.ndarray], body: dict[str, Any]) -> None:
    for name in ("v_template", "posedirs", "J_regressor", "weights", "f"):
        np.testing.assert_allclose(found[name], body[name], atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(found["shapedirs"], body["shapedirs"][:, :, :10])
    np.testing.assert_array_equal(found["parents"], PARENTS)


def test_npz(tmp_path: Path) -> None:
    body = small_body()
    np.savez(tmp_path / "SMPL_NEUTRAL.npz", **body)
    check(read_smpl_file(tmp_path / "SMPL_NEUTRAL.npz"), body)


@pytest.mark.parametrize("protocol", [0, 2, 4])
@pytest.mark.parametrize("layout", ["csc", "csr", "coo"])
def test_pickle_with_chumpy_and_sparse_arrays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, protocol: int, layout: str
) -> None:
    module = types.ModuleType("chumpy.ch")
    ch = type("Ch", (), {"__module__": "chumpy.ch"})
    module.Ch = ch
    monkeypatch.setitem(sys.modules, "chumpy", types.ModuleType("chumpy"))
    monkeypatch.setitem(sys.modules, "chumpy.ch", module)
    body = small_body()
    stored = dict(body, J_regressor=scipy.sparse.csc_matrix(body["J_regressor"]).asformat(layout))
    for name in ("shapedirs", "v_template"):
        wrapped = ch()
        wrapped.x, wrapped._dirty_vars, wrapped._itr, wrapped._depends_on_deps = body[name], set(), None, {}
        stored[name] = wrapped
    path = tmp_path / "basicmodel.pkl"
    path.write_bytes(pickle.dumps(stored, protocol))
    monkeypatch.delitem(sys.modules, "chumpy.ch")
    check(read_smpl_file(path), body)


def test_a_file_without_pose_correctives(tmp_path: Path) -> None:
    body = small_body(shapes=4)
    del body["posedirs"]
    np.savez(tmp_path / "a.npz", **body)
    found = read_smpl_file(tmp_path / "a.npz")
    assert "posedirs" not in found and found["shapedirs"].shape == (VERTICES, 3, 4)


@pytest.mark.parametrize(("joints", "word"), [(52, "SMPL-H"), (55, "SMPL-X"), (16, "MANO"), (30, "30 joints")])
def test_other_bodies_are_refused(tmp_path: Path, joints: int, word: str) -> None:
    np.savez(tmp_path / "a.npz", **small_body(joints))
    with pytest.raises(InputError, match=word):
        read_smpl_file(tmp_path / "a.npz")


def broken(**changes: Any) -> dict[str, Any]:
    return {k: v for k, v in {**small_body(), **changes}.items() if v is not None}


GOOD = small_body()
BAD = {
    "no template": (broken(v_template=None), "lacks the array 'v_template'"),
    "no weights": (broken(weights=None), "lacks the array 'weights'"),
    "text": (broken(shapedirs=np.array(["a"])), "not an array of numbers"),
    "not finite": (broken(v_template=GOOD["v_template"] * np.nan), "not finite"),
    "fewer vertices": (broken(v_template=GOOD["v_template"][:-1]), "59 x 3, not 60 x 3"),
    "transposed regressor": (broken(J_regressor=GOOD["J_regressor"].T), "60 x 24, not 24 x 60"),
    "flat correctives": (broken(posedirs=np.zeros((VERTICES, 621))), "60 x 621"),
    "no shapes": (broken(shapedirs=np.zeros((VERTICES, 3, 0))), "60 x 3 x 0"),
    "faces beyond": (broken(f=GOOD["f"] + VERTICES), "faces name vertices"),
    "weights of 2": (broken(weights=GOOD["weights"] * 2), "do not add up"),
    "regressor of zeros": (broken(J_regressor=GOOD["J_regressor"] * 0), "rows do not add up"),
    "centimetres": (broken(v_template=GOOD["v_template"] * 100), "person in metres"),
    "another tree": (broken(kintree_table=np.zeros((2, 24), int)), "not connected"),
    "a short tree": (broken(kintree_table=np.zeros((2, 20), int)), "20 joints"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_say_what_is_wrong(tmp_path: Path, name: str) -> None:
    content, sentence = BAD[name]
    np.savez(tmp_path / "bad.npz", **content)
    with pytest.raises(InputError, match=sentence):
        read_smpl_file(tmp_path / "bad.npz")


def test_what_is_no_model_at_all(tmp_path: Path) -> None:
    (tmp_path / "list.pkl").write_bytes(pickle.dumps([1, 2]))
    (tmp_path / "text.pkl").write_text("not a pickle")
    for name in ("list.pkl", "text.pkl", "nowhere.npz"):
        with pytest.raises(InputError):
            read_smpl_file(tmp_path / name)
