"""A session through its life: solved, asked again, changed, edited by hand, opened in another process."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import EMBEDDED, Body
from markerscope.solver.commands import solve_session
from markerscope.solver.commands.solve import session_of
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.evaluate.posed import body_of
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.pipeline import stage as stage_module
from markerscope.solver.pipeline.digest import file_digest
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import InputFile, load_session, save_session
from markerscope.solver.pipeline.session_file import EditedOutside, edited_by_hand
from markerscope.solver.pipeline.settings import from_table
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import Event, stage_keys
from markerscope.solver.pipeline.stages import GRAPH, SOURCES
from markerscope.solver.pipeline.stages_neural import GRAPH_NEURAL
from markerscope.solver.pipeline.stages_paper import GRAPH_PAPER
from markerscope.solver.pipeline.worker import Job
from markerscope.solver.report.outputs import write_formats
from tests.fit.conftest import simulate
from tests.synthetic import Recording, record, session

TINY = {"localize": {"yaws": 6, "few": 4, "many": 6, "keep": 3}, "orient": {"refine": 2}}
FITTED = {"localize", "orient", "fit", "neutral", "angles", "errors", "surface", "check"}


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return record(
        tmp_path_factory.mktemp("recording"), simulate(with_bone_lengths(Body.load()), 7, frames=80, markers=24)
    )


@pytest.fixture(scope="module")
def solved(made: Recording, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A solved session, not to be changed; ``mine`` is a copy that may be."""
    out = tmp_path_factory.mktemp("solved") / "out"
    solve_session(session(out, made, TINY, prior=made.prior, offset=made.offset), silent)
    return out


@pytest.fixture
def mine(solved: Path, made: Recording, tmp_path: Path) -> Path:
    shutil.copytree(solved, tmp_path / "out")
    save_session(replace(load_session(solved), folder=tmp_path / "out"))
    return tmp_path / "out"


def computed(request: SolveRequest) -> set[str]:
    return set(solve_session(request, silent).summary["computed"])


def content(folder: Path) -> dict[str, tuple[int, bytes]]:
    """Time of change and bytes of every file, but for the note of the inputs' digests."""
    return {
        str(path.relative_to(folder)): (path.stat().st_mtime_ns, path.read_bytes())
        for path in folder.rglob("*")
        if path.is_file() and path.name != "digests.json"
    }


def edited(folder: Path, edits: Mapping[str, Mapping[str, Any]]) -> SolveRequest:
    save_session(replace(load_session(folder), edits=edits))
    return SolveRequest(folder)


@pytest.mark.parametrize(
    ("stage", "name", "value", "changed"),
    [
        ("markers", "start", 0.5, {"markers", "clean", "segment", "sync"} | FITTED),
        ("clean", "ratio", 12.0, {"clean", "segment", "sync"} | FITTED),
        ("landmarks", "rate", 15.0, {"landmarks", "prior", "sync"} | FITTED),
        ("prior", "rate", 25.0, {"prior", "sync"} | FITTED),
        ("sync", "offset", 0.2, {"sync"} | FITTED),
        ("segment", "threshold", 0.01, {"segment"} | FITTED),
        ("localize", "keep", 5, FITTED),
        ("orient", "offset_mm", 12.0, FITTED - {"localize"}),
        ("fit", "candidate", 1, {"fit", "neutral", "angles", "errors", "surface", "check"}),
        ("angles", "convention", "isb", {"angles", "errors"}),
    ],
)
def test_a_setting_changes_what_depends_on_it(stage: str, name: str, value: Any, changed: set[str]) -> None:
    sources = {source: Source.file(None) for source in SOURCES}
    (cls,) = (s.settings for s in GRAPH if s.name == stage)
    before = stage_keys(GRAPH, sources, {})
    after = stage_keys(GRAPH, sources, {stage: from_table(cls, {name: value})})
    assert {key for key in before if before[key] != after[key]} == changed


@pytest.mark.parametrize(
    ("source", "changed"),
    [
        ("marker_file", {"markers", "clean", "segment", "sync"} | FITTED),
        ("video_file", {"landmarks", "prior", "sync"} | FITTED),
        ("prior_file", {"prior", "sync"} | FITTED),
        ("camera_file", FITTED),
        ("body_file", FITTED),
        ("weights_file", set()),
    ],
)
def test_an_input_changes_what_depends_on_it(source: str, changed: set[str]) -> None:
    sources = {name: Source.file(None) for name in SOURCES}
    before = stage_keys(GRAPH, sources, {})
    after = stage_keys(GRAPH, {**sources, source: Source(None, "another")}, {})
    assert {key for key in before if before[key] != after[key]} == changed


def test_another_embedded_body_makes_everything_that_sees_it_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fit on the old body means nothing on the new one: not its betas, nor its vertices, nor its angles."""
    sources = {name: Source.file(None) for name in SOURCES}
    for graph, more in (
        (GRAPH, set()),
        (GRAPH_PAPER, {"solve"}),
        (GRAPH_NEURAL, {"network"}),
    ):
        before = stage_keys(graph, sources, {})
        with monkeypatch.context() as patch:
            patch.setattr(stage_module, "_shipped_digest", lambda path: f"another {path.name}")
            after = stage_keys(graph, sources, {})
        changed = {key for key in before if before[key] != after[key]}
        assert changed == {"prior", "sync"} | FITTED | more


def test_the_second_time_nothing_is_computed_nor_written(mine: Path) -> None:
    before = content(mine)
    assert computed(SolveRequest(mine)) == set()
    assert content(mine) == before


def test_another_convention_computes_the_angles_alone_and_going_back_nothing(mine: Path) -> None:
    first = (mine / "angles.csv").read_bytes()
    assert computed(SolveRequest(mine, convention="isb")) == {"angles", "errors"}
    assert b"knee_flexion_r" in (mine / "angles.csv").read_bytes()
    assert json.loads((mine / "angles.json").read_text())["convention"] == "isb"
    assert computed(SolveRequest(mine)) == set(), "what was asked for stays in the session"
    assert computed(SolveRequest(mine, convention="opensim")) == set()
    assert (mine / "angles.csv").read_bytes() == first


@pytest.mark.parametrize("name", ["motion.npz", "markers_labelled.trc", "report.html"])
def test_a_file_that_is_gone_or_damaged_is_written_again(mine: Path, name: str) -> None:
    first = (mine / name).read_bytes()
    (mine / name).unlink()
    assert computed(SolveRequest(mine)) == set()
    assert (mine / name).is_file()
    (mine / name).write_bytes(b"half")
    assert computed(SolveRequest(mine)) == set()
    assert len((mine / name).read_bytes()) == pytest.approx(len(first), rel=0.05)


def test_a_result_that_is_gone_or_damaged_is_computed_again(mine: Path) -> None:
    shutil.rmtree(mine / "results" / "angles")
    assert computed(SolveRequest(mine)) == {"angles"}
    (arrays,) = (mine / "results" / "surface").glob("*/arrays.npz")
    arrays.write_bytes(arrays.read_bytes()[:-1])
    assert computed(SolveRequest(mine)) == {"surface"}, "what was made of it is there"


def test_the_pull_to_landmarks_is_told_of_turned_off_and_decided_by_hand(mine: Path) -> None:
    told = solve_session(SolveRequest(mine), silent).summary["landmark_pull"]
    assert told["state"] in ("earned", "not earned", "given up") and np.isfinite(told["log_ratio"])
    off = solve_session(SolveRequest(mine, landmark_pull="off"), silent).summary
    assert off["landmark_pull"]["state"] == "off" and off["landmark_pull"]["markers"] == []
    assert "fit" in off["computed"] and "orient" not in off["computed"]
    assert computed(SolveRequest(mine, landmark_pull="earned")) == set()
    pinned = solve_session(edited(mine, {"fit": {"pinned": [[2, "left_asis"]]}}), silent).summary["landmark_pull"]
    assert {"marker": 2, "landmark": "left_asis", "probability": 1.0}.items() <= {
        key: value for row in pinned["markers"] if row["marker"] == 2 for key, value in row.items()
    }.items()
    with pytest.raises(InputError, match="there is no landmark"):
        solve_session(edited(mine, {"fit": {"pinned": [[2, "funny_bone"]]}}), silent)


def test_a_method_that_draws_no_markers_says_so(mine: Path) -> None:
    with pytest.raises(InputError, match="method paper draws no markers to landmarks"):
        solve_session(SolveRequest(mine, method="paper", landmark_pull="off"), silent)


def test_a_pinned_candidate_is_used_and_can_be_let_go(mine: Path) -> None:
    first = content(mine)
    outcome = solve_session(edited(mine, {"fit": {"candidate": 1}}), silent)
    assert set(outcome.summary["computed"]) == {"fit", "neutral", "angles", "errors", "surface", "check"}
    assert any("pinned by hand" in warning for warning in outcome.warnings)
    assert outcome.summary["confidence"] < 1, "a decision by hand is no evidence"
    assert json.loads((mine / "angles.json").read_text())["edits"] == {"fit": {"candidate": 1}}
    assert computed(SolveRequest(mine)) == set(), "the pin stays"
    assert computed(edited(mine, {})) == set(), "without it, the first answer is back"
    assert content(mine)["motion.npz"][1] == first["motion.npz"][1]


def test_what_the_rules_find_is_in_every_output(made: Recording, tmp_path: Path) -> None:
    """Two markers on a chair: left out, listed, said, and nobody's in the labelled file; the confidence is capped."""
    markers = load_markers(made.markers)
    chair = np.random.default_rng(0).normal([0.4, 0.3, 0.5], 0.0003, (len(markers.positions), 2, 3))
    more = replace(
        markers,
        positions=np.concatenate([markers.positions, chair], axis=1),
        labels=(*markers.labels, "seat", "back"),
        filled=None,
    )
    write_c3d(tmp_path / "chair.c3d", more, up="z")
    out = tmp_path / "out"
    with_chair = replace(made, markers=tmp_path / "chair.c3d")
    outcome = solve_session(session(out, with_chair, TINY, prior=made.prior, offset=made.offset), silent)
    assert outcome.summary["nobodys_markers"] == ["seat", "back"]
    (doubt,) = [one for one in outcome.summary["doubts"] if one["kind"] == "still markers"]
    assert doubt["markers"] == ["seat", "back"] and doubt["value"] == 2
    assert doubt["sentence"] in outcome.warnings and doubt["sentence"] in outcome.summary["warnings"]
    assert outcome.summary["confidence"] <= 0.6
    assert "seat, back" in (out / "report.html").read_text(encoding="utf-8")
    named = load_markers(out / "markers_labelled.c3d").labels
    assert {"unassigned_seat", "unassigned_back"} <= set(named)
    json.dumps(outcome.summary)


def test_a_marker_left_out_is_not_used(mine: Path) -> None:
    outcome = solve_session(edited(mine, {"segment": {"left_out": [3]}}), silent)
    assert set(outcome.summary["computed"]) == {"segment"} | FITTED
    with np.load(mine / "motion.npz") as motion:
        assert motion["marker_joint"][3] == motion["marker_vertex"][3] == -1
        assert (np.delete(motion["marker_joint"], 3) >= 0).all()
    assert "unassigned_M03" in (mine / "markers_labelled.trc").read_text()


def test_solving_the_same_markers_into_the_same_folder_keeps_what_was_decided_by_hand(
    mine: Path, made: Recording, tmp_path: Path
) -> None:
    edited(mine, {"segment": {"left_out": [3]}, "sync": {"offset": 0.5}})
    again = SolveRequest(made.markers, out=mine, prior=made.prior)
    assert session_of(again).edits == {"segment": {"left_out": [3]}, "sync": {"offset": 0.5}}
    assert session_of(again).settings == {}, "the command line says everything anew"
    said = session_of(replace(again, offset=0.1))
    assert said.edits == {"segment": {"left_out": [3]}}, "what is said last counts"
    assert said.stage_settings(GRAPH)["sync"].offset == 0.1
    shutil.copy(made.markers, tmp_path / "other.c3d")
    assert session_of(replace(again, markers=tmp_path / "other.c3d")).edits == {}


def test_a_range_says_both_ends(mine: Path) -> None:
    first = replace(load_session(mine), settings={"markers": {"start": 1.0, "stop": 2.0}})
    save_session(first)
    settings = session_of(SolveRequest(mine, range=(0.5, None))).stage_settings(GRAPH)["markers"]
    assert (settings.start, settings.stop) == (0.5, None)
    settings = session_of(SolveRequest(mine)).stage_settings(GRAPH)["markers"]
    assert (settings.start, settings.stop) == (1.0, 2.0)


def test_method_and_seed_are_kept_and_change_nothing_that_does_not_draw_lots(mine: Path) -> None:
    assert computed(SolveRequest(mine, method="bundle", seed=7)) == set()
    assert load_session(mine).run.seed == 7
    assert json.loads((mine / "angles.json").read_text())["seed"] == 7
    assert session_of(SolveRequest(mine)).run.seed == 7


def test_every_stage_is_told(mine: Path) -> None:
    told: list[Event] = []
    shutil.rmtree(mine / "results" / "angles")
    solve_session(SolveRequest(mine), silent, told.append)
    assert [(e.state, e.computed) for e in told if e.stage == "angles"] == [("running", False), ("cached", True)]
    assert {e.stage for e in told} == {stage.name for stage in GRAPH}
    assert all(e.text for e in told if e.stage == "fit")


def test_another_process_can_do_it(mine: Path) -> None:
    job = Job(solve_session, SolveRequest(mine), store=load_session(mine).store)
    messages = list(job.messages())
    assert messages[-1].value.summary["computed"] == []
    assert sum(isinstance(message, Event) for message in messages) == len(GRAPH)


def test_a_session_solved_into_another_folder_leaves_its_own_as_it_was(mine: Path, tmp_path: Path) -> None:
    before = content(mine)
    shutil.copytree(mine / "results", tmp_path / "new" / "results")
    outcome = solve_session(SolveRequest(mine, out=tmp_path / "new"), silent)
    assert outcome.summary["computed"] == [] and outcome.out == tmp_path / "new"
    assert (tmp_path / "new" / "angles.csv").read_bytes() == (mine / "angles.csv").read_bytes()
    assert content(mine) == before


def test_outputs_change_all_together_or_not_at_all(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = content(mine)

    def full(*_: Any) -> None:
        raise InputError("cannot be written: the disk is full", "report.html", "free some space")

    monkeypatch.setattr("markerscope.solver.report.report_of.report_of", full)
    with pytest.raises(InputError, match="disk is full"):
        solve_session(SolveRequest(mine, convention="isb"), silent)
    after = content(mine)
    assert {name: after[name] for name in before} == before
    assert {name.split("/")[1] for name in after.keys() - before.keys()} == {"angles", "errors"}, "only finished stages"


@pytest.mark.parametrize("worth", [0.0, 1e9])
def test_a_refusal_leaves_nothing_but_what_took_long(
    made: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, worth: float
) -> None:
    monkeypatch.setattr("markerscope.solver.commands.solve._WORTH_KEEPING_S", worth)
    request = SolveRequest(made.markers, out=tmp_path / "out", prior=made.prior, offset=100.0)
    with pytest.raises(InputError, match="at no time of the markers"):
        solve_session(request, silent)
    assert (tmp_path / "out" / "results" / "markers").exists() == (worth == 0)
    assert (tmp_path / "out").exists() == (worth == 0)


def test_a_refusal_leaves_an_earlier_result_alone(mine: Path) -> None:
    before = content(mine)
    with pytest.raises(InputError, match="at no time of the markers"):
        solve_session(SolveRequest(mine, offset=100.0), silent)
    after = content(mine)
    assert after == before


def test_camera_of_an_earlier_solve_with_a_video_goes_with_it(mine: Path) -> None:
    (mine / "camera.json").write_text("{}")
    (mine / "angles.csv").unlink()
    solve_session(SolveRequest(mine), silent)
    assert not (mine / "camera.json").exists()


def by_hand(folder: Path) -> str:
    file = folder / "session.toml"
    file.write_text(file.read_text().replace("offset_mm = 9.5", "offset_mm = 12.5"))
    assert "offset_mm = 12.5" in file.read_text()
    return file.read_text()


def test_a_session_file_that_is_edited_while_it_is_solved_stays(mine: Path) -> None:
    text = ""

    def edit(event: Event) -> None:
        nonlocal text
        text = text or by_hand(mine)

    before = (mine / "angles.csv").read_bytes()
    with pytest.raises(EditedOutside, match="was edited since it was read, and is not overwritten; nothing that was"):
        solve_session(SolveRequest(mine, convention="isb"), silent, edit)
    assert (mine / "session.toml").read_text() == text
    assert (mine / "angles.csv").read_bytes() == before, "no files that its settings do not stand for"
    assert "orient" in computed(SolveRequest(mine)), "what it says now is solved"


def test_settings_written_by_hand_are_not_overwritten_by_a_solve_that_says_everything_anew(
    mine: Path, made: Recording
) -> None:
    again = SolveRequest(made.markers, out=mine, prior=made.prior, offset=made.offset)
    save_session(replace(load_session(mine), edits={"segment": {"left_out": [3]}}))
    by_hand(mine)
    before = content(mine)
    with pytest.raises(InputError, match="was edited by hand and would be overwritten; solve that session itself"):
        solve_session(again, silent)
    assert content(mine) == before
    text = (mine / "session.toml").read_text()
    (mine / "session.toml").write_text(text.replace("12.5", "9.5").replace("left_out = [\n    3,\n]", "left_out = [4]"))
    assert session_of(again).edits == {"segment": {"left_out": [4]}}, "edits are made by hand, and kept"
    assert not edited_by_hand(mine)


def test_a_body_that_changed_after_the_fit_is_not_written_with(mine: Path, tmp_path: Path) -> None:
    session = load_session(mine)
    graph = run_stages(session)
    for digest, fits in ((file_digest(EMBEDDED), True), ("0" * 64, False)):
        other = replace(session, inputs={**session.inputs, "body_file": InputFile(EMBEDDED, digest)})
        if fits:
            assert write_formats(tmp_path / "new", other, graph, ["motion"])
            continue
        with pytest.raises(InputError, match="changed while it was read"):
            write_formats(tmp_path / "other", other, graph, ["motion"])
        assert not (tmp_path / "other").exists()


def test_a_result_is_not_compared_on_another_body_than_it_was_solved_with(mine: Path) -> None:
    session = load_session(mine)
    save_session(replace(session, inputs={**session.inputs, "body_file": InputFile(EMBEDDED, file_digest(EMBEDDED))}))
    assert body_of(mine) == EMBEDDED
    save_session(replace(session, inputs={**session.inputs, "body_file": InputFile(EMBEDDED, "0" * 64)}))
    with pytest.raises(InputError, match="is not the body any more that the result was solved with; solve again"):
        body_of(mine)
