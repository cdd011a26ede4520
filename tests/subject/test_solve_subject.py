"""A subject from its file to its folder: one body over all trials, and no fault of one trial that stops the others."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveOutcome, SolveRequest
from markerscope.solver.fit.kinematics import forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.report.outputs import FILES
from markerscope.solver.subject import solve_subject
from markerscope.solver.subject.standing import write_standing
from tests.fit.conftest import Scene, drawn_vertices, simulate
from tests.synthetic import Recording, record

TWELVE = [1, 2, 4, 5, 7, 8, 16, 17, 18, 19, 20, 21]
FRAMES = 48


def moved(body: Body, of: Scene, seed: int, betas: np.ndarray, path: Path) -> np.ndarray:
    """A movement of the same markers on a body, as a file without names; its true joints (T, 24, 3) m."""
    pose = replace(simulate(body, seed, frames=FRAMES).pose, betas=betas)
    vertices = drawn_vertices(body, of.bones, 4)
    placement, _ = Skin(body, betas).on_vertices(vertices, 0.0095)
    rng = np.random.default_rng(seed)
    order = rng.permutation(len(vertices))
    seen = place_points(placement, forward(body, pose), betas)[:, order]
    labels = tuple(f"U{i}" for i in range(len(order)))
    write_c3d(path, Markers(seen + rng.normal(0, 0.001, seen.shape), 12.0, labels))
    return np.asarray(forward(body, pose).place)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[SolveRequest, SolveOutcome, Recording, np.ndarray]:
    folder = tmp_path_factory.mktemp("subject")
    body = with_bone_lengths(Body.load())
    first = record(folder, simulate(body, 4, markers=36))
    betas = first.scene.pose.betas
    joints = moved(body, first.scene, 7, betas, folder / "jump.c3d")
    other = betas + np.random.default_rng(3).normal(0, 1.5, betas.shape)
    moved(body, first.scene, 8, other, folder / "other.c3d")
    (folder / "subject.toml").write_text(f"""
        subject.name = "P07"
        [[trial]]
        name = "jump"
        markers = "jump.c3d"
        [[trial]]
        name = "first"
        markers = "{first.markers.name}"
        prior = "{first.prior.name}"
        offset = {first.offset}
        [[trial]]
        name = "stranger"
        markers = "other.c3d"
        [[trial]]
        name = "gone"
        markers = "gone.c3d"
    """)
    request = SolveRequest(folder / "subject.toml", out=folder / "out")
    return request, solve_subject(request, silent), first, joints


Solved = tuple[SolveRequest, SolveOutcome, Recording, np.ndarray]


def rows(outcome: SolveOutcome) -> dict[str, dict]:
    return {row["name"]: row for row in outcome.summary["trials"]}


def test_a_trial_without_a_video_is_solved_by_the_body_of_another(solved: Solved) -> None:
    request, outcome, _, joints = solved
    out = request.out
    assert out is not None and outcome.summary["determined_by"] == "first"
    assert all((out / "jump" / name).is_file() for name in FILES)
    with np.load(out / "jump" / "motion.npz") as jump, np.load(out / "first" / "motion.npz") as first:
        assert (jump["betas"] == first["betas"]).all() and (jump["bone_lengths"] == first["bone_lengths"]).all()
        error = 1000 * np.linalg.norm(jump["joints"] - joints, axis=2)[:, TWELVE].mean()
    assert error < 25, f"{error:.1f} mm (synthetic)"
    assert not rows(outcome)["jump"]["doubts"] and rows(outcome)["jump"]["summary"]["confidence"] > 0.9


def test_another_person_is_doubted_and_a_missing_file_refused(solved: Solved) -> None:
    _, outcome, _, _ = solved
    found = rows(outcome)
    assert any("another person" in doubt for doubt in found["stranger"]["doubts"])
    assert found["stranger"]["summary"]["confidence"] <= 0.6
    assert found["gone"]["state"] == "refused" and "there is no such markers file" in found["gone"]["doubts"][0]


def test_the_report_lists_every_trial(solved: Solved) -> None:
    request, _, _, _ = solved
    assert request.out is not None
    page = (request.out / "report.html").read_text(encoding="utf-8")
    for word in ("jump", "first", "stranger", "gone", "another person", "determines the body", "jump/report.html"):
        assert word in page
    about = json.loads((request.out / "subject.json").read_text(encoding="utf-8"))
    assert [row["name"] for row in about["trials"]] == [row["name"] for row in solved[1].summary["trials"]]


def test_a_second_solve_computes_nothing(solved: Solved) -> None:
    again = rows(solve_subject(solved[0], silent))
    assert [row["summary"]["computed"] for row in again.values() if row["summary"]] == [[], [], []]


def test_an_option_of_one_trial_is_refused(solved: Solved) -> None:
    with pytest.raises(InputError, match="--offset: belongs to one trial"):
        solve_subject(replace(solved[0], offset=1.0), silent)


def test_a_standing_pose_is_the_same_file_for_the_same_time(tmp_path: Path) -> None:
    one, other = (write_standing(tmp_path / name, 3.0).read_bytes() for name in ("a.npz", "b.npz"))
    assert one == other
