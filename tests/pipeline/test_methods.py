"""One session by both methods: the same files come out, and what belongs to one method does not trouble the other."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.commands import solve_session
from markerscope.solver.commands.solve import session_of
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.pipeline.methods import GRAPHS, graph_of, with_method
from markerscope.solver.pipeline.session import RunSettings, Session, load_session, save_session
from markerscope.solver.pipeline.stage import stage_keys
from markerscope.solver.pipeline.stages import SOURCES
from markerscope.solver.report.outputs import FILES
from tests.fit.conftest import simulate
from tests.synthetic import Recording, record

TINY = {"localize": {"yaws": 6, "few": 4, "many": 6, "keep": 3}, "orient": {"refine": 2}}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    scene = simulate(with_bone_lengths(Body.load()), 5, frames=60, markers=24)
    return record(tmp_path_factory.mktemp("recording"), scene)


@pytest.fixture(scope="module")
def out(made: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Solved by the published method, its optimisations cut short."""
    folder = tmp_path_factory.mktemp("solved") / "out"
    solve_session(by_paper(made, folder), silent)
    return folder


def by_paper(made: Recording, out: Path) -> SolveRequest:
    return SolveRequest(
        made.markers, out=out, prior=made.prior, offset=made.offset, method="paper", iterations=3
    )  # fmt: skip


def test_the_published_method_leaves_the_same_files(made: Recording, out: Path) -> None:
    assert all((out / name).is_file() for name in FILES)
    with np.load(out / "motion.npz") as motion:
        frames, markers = len(made.joints), made.scene.seen.markers.shape[1]
        assert motion["joints"].shape == (frames, 24, 3)
        assert motion["marker_joint"].shape == (markers,)
        assert np.isfinite(motion["joints"]).all()
        assert not motion["bone_lengths"].any(), "the paper's body has no bone lengths of its own"
    report = (out / "report.html").read_text(encoding="utf-8")
    assert "stopped at 3 iterations" in report
    session = load_session(out)
    assert session.run == RunSettings("paper", 0)
    assert session.settings["segment"]["threshold"] == 0.005
    assert session.settings["segment"]["far"] == 0.0
    assert session.settings["solve"]["iterations"] == session.settings["localize"]["iterations"] == 3


def test_what_was_computed_is_there_to_be_inspected(out: Path) -> None:
    session = load_session(out)
    stages = {stage.name: stage for stage in graph_of(session)}
    sources, settings = session.sources(SOURCES), session.stage_settings(graph_of(session))
    keys = stage_keys(graph_of(session), sources, settings)
    solved = session.store.get("solve", keys["solve"], stages["solve"].result)
    assert [yaw.pose.descent.iterations for yaw in solved.yaws] == [3] * 4
    assert solved.refined.descent.trace.iteration.tolist() == [0, 1, 2, 3]
    assert session.store.get("localize", keys["localize"], stages["localize"].result).chains > 0
    again = solve_session(SolveRequest(out), silent)
    assert again.summary["computed"] == []
    assert again.summary["method"] == "paper"
    assert len(again.summary["alternatives"]) == 4


def test_a_session_can_be_solved_by_the_other_method(made: Recording, out: Path, tmp_path: Path) -> None:
    moved = replace(
        load_session(out), folder=tmp_path / "out", edits={"segment": {"left_out": [3]}, "fit": {"candidate": 1}}
    )
    save_session(moved)
    session = session_of(SolveRequest(tmp_path / "out", method="bundle"))
    assert session.run.method == "bundle"
    assert session.edits == {"segment": {"left_out": [3]}}, "what was left out stays so; a pinned yaw is no candidate"
    assert "solve" not in session.settings
    save_session(replace(session, settings={**session.settings, **TINY}))
    done = solve_session(SolveRequest(tmp_path / "out"), silent)
    assert done.summary["method"] == "bundle"
    assert load_session(tmp_path / "out").settings["segment"]["threshold"] == 0.008
    back = session_of(SolveRequest(tmp_path / "out", method="paper"))
    assert back.stage_settings(graph_of(back))["segment"].threshold == 0.005
    assert back.stage_settings(graph_of(back))["segment"].left_out == (3,)


def test_files_said_anew_keep_the_edits_of_the_same_method(made: Recording, out: Path) -> None:
    save_session(replace(load_session(out), edits={"fit": {"candidate": 1}}))
    try:
        assert session_of(by_paper(made, out)).edits == {"fit": {"candidate": 1}}
        assert not session_of(replace(by_paper(made, out), method=None, iterations=None)).edits
    finally:
        save_session(replace(load_session(out), edits={}))


@pytest.mark.parametrize(("old", "new"), [(a, b) for a in GRAPHS for b in GRAPHS])
def test_a_session_of_any_method_can_become_one_of_any_other(old: str, new: str, tmp_path: Path) -> None:
    every = Session(tmp_path, run=RunSettings(old))  # type: ignore[arg-type]
    every = every.with_settings(every.stage_settings(graph_of(every)))
    changed = with_method(every, new)  # type: ignore[arg-type]
    assert {s.name for s in graph_of(changed)} >= set(changed.settings)
    changed.stage_settings(graph_of(changed))
    assert (changed == every) == (old == new)


def test_a_cap_is_refused_where_there_is_nothing_to_cap(made: Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--iterations: method bundle has no such cap"):
        session_of(replace(by_paper(made, tmp_path), method="bundle"))
    with pytest.raises(InputError, match="--iterations: 0 is not possible"):
        replace(by_paper(made, tmp_path), iterations=0)
