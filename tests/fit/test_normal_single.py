"""A step where single precision cannot tell that the equations of a frame are positive definite."""

from __future__ import annotations

import numpy as np

from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.state import POSE_SIZE


def test_a_joint_that_nearly_nothing_holds_is_solved_in_double_precision() -> None:
    random = np.random.default_rng(0)
    sums = NormalEquations(2, 3)
    rows = random.normal(size=(2, 30, POSE_SIZE)) * 1e3
    sums.h_ff[:] = np.swapaxes(rows, 1, 2) @ rows + np.eye(POSE_SIZE) * 1e-2
    sums.h_ss[:] = np.eye(3)
    sums.g_f[:] = random.normal(size=sums.g_f.shape)
    sums.h_fs[:] = random.normal(size=sums.h_fs.shape) * 1e-3
    known = sums.h_ff.copy()
    try:
        np.linalg.cholesky(known.astype(np.float32))
        raise AssertionError("single precision would do here, so nothing is tried")
    except np.linalg.LinAlgError:
        pass
    by_frame, shared = sums.solve(np.arange(3), 1e-9)
    assert np.isfinite(by_frame).all() and np.isfinite(shared).all()
    left = np.einsum("nab,nb->na", sums.h_ff, by_frame) + sums.h_fs @ shared + sums.g_f
    assert np.abs(left).max() < 1e-3 * np.abs(sums.g_f).max(), f"{np.abs(left).max()} is left of the equations"
