"""Tables and curves that fill while a stage runs end as what it leaves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from markerscope.app.views import bodies
from markerscope.app.views.convergence import of_orientation
from markerscope.app.views.running import candidates_so_far, curves_so_far
from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Found
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.fit.results import Orientation
from markerscope.solver.fit.settings import OrientSettings
from markerscope.solver.pipeline.stages import GRAPH, SOURCES


class Listener:
    """A progress that keeps the notes."""

    def __init__(self) -> None:
        self.notes: list[Found] = []

    def __call__(self, fraction: float, text: str) -> None:
        pass

    def found(self, found: Found) -> None:
        self.notes.append(found)


@pytest.fixture(scope="module")
def ranked(results: Mapping[str, Any]) -> tuple[Orientation, list[Found]]:
    """The ranking run once more, with somebody listening."""
    listener = Listener()
    stage = next(stage for stage in GRAPH if stage.name == "orient")
    given = {name: None if name in SOURCES else results[name] for name in stage.inputs}
    return stage.run(OrientSettings(refine=2), listener, **given), listener.notes


def test_the_last_word_on_every_candidate_is_its_result(
    ranked: tuple[Orientation, list[Found]], results: Mapping[str, Any]
) -> None:
    made, notes = ranked
    table = candidates_so_far(notes, results["localize"])
    assert table is not None
    by_pool = {row.pool: row for row in table.rows}
    assert len(by_pool) == len(results["localize"].start)
    for own in made.candidates:
        assert np.isclose(by_pool[own.hypothesis].score, own.energy)
        assert (by_pool[own.hypothesis].fate == "refined") == own.refined
    assert table.rows[0].pool == made.candidates[0].hypothesis and table.rows[0].margin == 1.0
    assert not any(row.can_pin for row in table.rows)


def test_half_way_some_wait(ranked: tuple[Orientation, list[Found]], results: Mapping[str, Any]) -> None:
    table = candidates_so_far(ranked[1][:3], results["localize"])
    assert table is not None
    assert [np.isfinite(row.score) for row in table.rows] == [True] * 3 + [False] * (len(table.rows) - 3)
    assert [len(step.rows) for step in table.steps] == [len(table.rows), 3, 0]
    assert candidates_so_far([], results["localize"]) is None
    assert candidates_so_far(ranked[1]) is None


def test_the_bodies_of_all_steps_are_kept(
    ranked: tuple[Orientation, list[Found]], results: Mapping[str, Any], body: Body
) -> None:
    made, _ = ranked
    found, markers = results["localize"], results["markers"]
    for curve, own in zip(of_orientation(made), made.candidates):
        assert curve.trace is not None and len(curve.trace.iteration) == len(own.trace)
        last = bodies.of_iteration(body, curve.trace, len(own.trace) - 1, found, markers, np.zeros(0, int))
        ended = bodies.of_candidate(body, own, found, markers)
        for time in last.times[[0, -1]]:
            error = np.abs(last.joints(float(time)) - ended.joints(float(time))).max()
            assert error < 1e-4, f"{error} m"
        first = exp_so3(curve.trace.rotation_vectors[0, :, 1:].astype(float))
        assert np.abs(first - exp_so3(curve.trace.rotation_vectors[-1, :, 1:].astype(float))).max() > 0.01
    silent = replace(made, candidates=(replace(made.candidates[0], steps=None),))
    assert of_orientation(silent)[0].trace is None


def test_chains_come_best_first() -> None:
    notes = [
        Found("chain", i, {"bones": np.array([1, 4, 7]), "of": 9, "yaw_deg": 10.0, "one_way": 4e-4, "chamfer": c})
        for i, c in enumerate((3e-3, 1e-3, 2e-3))
    ]
    table = candidates_so_far(notes)
    assert table is not None
    assert [row.pool for row in table.rows] == [1, 2, 0]
    assert np.allclose([row.margin for row in table.rows], [1, 2, 3])
    assert np.isclose(table.rows[0].distance, 20.0) and np.isclose(table.rows[0].score, 1000.0)
    assert table.rows[0].bones == ("left thigh", "left shank", "left foot")
    assert "3 of 9" in table.steps[0].help


def test_descents_grow_one_curve_each() -> None:
    notes = [
        Found("iteration", 1, {"text": "yaw 0", "energy": 3.0}),
        Found("iteration", 2, {"text": "yaw 0", "energy": 2.0}),
        Found("candidate", 0, {"energy": 1.0, "refined": False}),
        Found("iteration", 1, {"text": "yaw 90", "energy": 5.0}),
    ]
    one, other = curves_so_far(notes)
    assert (one.label, one.iteration.tolist(), one.energy.tolist()) == ("yaw 0", [1, 2], [3.0, 2.0])
    assert (other.label, other.energy.tolist()) == ("yaw 90", [5.0])
