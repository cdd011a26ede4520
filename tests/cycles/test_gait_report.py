"""The gait page of a solve: there where the body walked, and nowhere else."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.figures.svg import svg
from markerscope.solver.report.gait import gait_of
from markerscope.solver.report.report import render
from markerscope.solver.report.report_data import ReportData
from markerscope.solver.synth.acts import act


@pytest.mark.parametrize(("name", "walks"), [("walk", True), ("squat", False)])
def test_the_report_has_the_page_where_somebody_walked(name: str, walks: bool) -> None:
    body = Body.load()
    betas = np.zeros(body.shape_count)
    motion = act(name, body, betas, seconds=5, rate=50, rng=np.random.default_rng(3))
    _, joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)
    solved: Any = SimpleNamespace(time=motion.time, rotations=motion.rotations, joints=joints, betas=betas)
    found = gait_of(solved, body, 50.0, "trial")
    assert (found is not None) == walks
    page = "" if found is None else svg(found.page)
    html = render(ReportData("trial", gait=page, gait_notes=() if found is None else found.notes))
    assert ('id="gait"' in html) == walks
    assert ("Foot progression" in html) == walks and ("not filtered" in html) == walks
