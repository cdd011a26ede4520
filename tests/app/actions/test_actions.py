"""Actions: one table for menus, keys and search; each says why it cannot be done, and does what it says."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from markerscope.app.actions import ACTIONS, Actions
from markerscope.app.actions.session_actions import may_close, open_path
from markerscope.app.models import edits
from markerscope.app.models.demo import DEMO_MARKERS, DEMO_VIDEO
from markerscope.app.models.home import Home
from markerscope.app.models.results import Ref
from markerscope.app.models.stages import states_of
from markerscope.app.models.workbench import Said, Workbench
from markerscope.solver.io import load_markers
from markerscope.solver.pipeline.session import Session, session_folder


class Answers:
    """A window whose user has made up his mind."""

    def __init__(self) -> None:
        self.answers: dict[str, Any] = {}
        self.asked: list[str] = []

    def _answer(self, question: str, default: Any = None) -> Any:
        self.asked.append(question)
        return self.answers.get(question, default)

    def file_to_open(self, what: str) -> Path | None:
        return self._answer(f"open {what}")

    def folder_to_save(self, name: str) -> Path | None:
        return self._answer("folder")

    def file_to_save(self, name: str) -> Path | None:
        return self._answer("save")

    def how_to_import(self, path: Path) -> Mapping[str, Any] | None:
        return self._answer("import")

    def what_to_export(self) -> tuple[Path, Sequence[str]] | None:
        return self._answer("export")

    def save_first(self) -> bool | None:
        return self._answer("save first")

    def stop_running(self) -> bool:
        return self._answer("stop", False)

    def number(self, question: str, value: float, unit: str) -> float | None:
        return self._answer(question)

    def choice(self, question: str, options: Sequence[str]) -> int | None:
        return self._answer(question)

    def pictures(self) -> Sequence[Any]:
        return self._answer("pictures", ())

    def show(self, what: str) -> None:
        self._answer(what)

    def quit(self) -> None:
        self._answer("quit")


@pytest.fixture
def asks() -> Answers:
    return Answers()


@pytest.fixture
def bench(tmp_path: Path) -> Iterator[Workbench]:
    bench = Workbench(Home(tmp_path / "config", tmp_path / "data"))
    yield bench
    bench.close()


@pytest.fixture
def actions(bench: Workbench, asks: Answers) -> Actions:
    return Actions(ACTIONS, bench, asks)


@pytest.fixture
def solved(bench: Workbench, session: Session) -> Workbench:
    bench.open(session.folder)
    for _ in range(50_000):
        bench.tick()
        if bench.clock.timing.frames:
            return bench
        time.sleep(0.005)
    raise AssertionError("it never opened")


@pytest.fixture
def said(bench: Workbench) -> list[Said]:
    heard: list[Said] = []
    bench.said.connect(heard.append)
    return heard


def test_every_action_can_be_found_and_understood() -> None:
    assert len({action.id for action in ACTIONS}) == len(ACTIONS)
    assert len({(action.menu, action.title) for action in ACTIONS}) == len(ACTIONS)
    assert all(action.title and action.menu and action.help.endswith(".") for action in ACTIONS)


def test_no_key_does_two_things() -> None:
    keys = [key for action in ACTIONS for key in action.keys]
    assert sorted(set(keys)) == sorted(keys)
    wanted = {"Space", "Left", "Right", "Shift+Left", "Shift+Right", "Home", "End", ",", ".", "Ctrl+K", "Ctrl+Z"}
    assert wanted <= set(keys)


def test_without_a_session_only_what_can_be_done_can(actions: Actions) -> None:
    possible = {action.id for action in ACTIONS if not actions.why_not(action.id)}
    assert {"session.markers", "session.open", "session.example", "window.quit", "help.search"} <= possible
    assert not possible & {"run.all", "edit.undo", "groups.merge", "play.toggle", "export.files", "session.save"}
    assert actions.why_not("run.all") == "no session is open"


def test_what_cannot_be_done_is_said_and_not_done(actions: Actions, said: list[Said]) -> None:
    done: list[str] = []
    actions.done.connect(done.append)
    assert not actions.trigger("run.all")
    assert said == [Said("note", "no session is open", "Run all")]
    assert done == []


def test_menus_keep_the_order_of_the_table(actions: Actions) -> None:
    menus = actions.menus()
    assert list(menus) == ["File", "Edit", "View", "Play", "Run", "Export", "Help"]
    assert sum(map(len, menus.values())) == len(ACTIONS)
    assert menus["Edit"][0].id == "edit.undo"


def test_the_example_opens_at_once(actions: Actions, bench: Workbench) -> None:
    assert actions.trigger("session.example")
    assert bench.document.session.inputs["video_file"].path == DEMO_VIDEO
    assert bench.document.untitled


def test_groups_are_merged_and_the_merge_undone(actions: Actions, solved: Workbench) -> None:
    before = solved.board.current["segment"]
    assert actions.why_not("groups.merge") == "fewer than two markers are selected"
    solved.selection.select_markers(np.flatnonzero(before.clusters <= 1))
    assert actions.trigger("groups.merge")
    assert solved.board.current["segment"].count == before.count - 1
    assert actions.trigger("edit.undo")
    assert solved.board.current["segment"].count == before.count
    assert actions.trigger("edit.redo")
    assert actions.trigger("groups.as_cut")
    assert solved.board.current["segment"].count == before.count


def test_merging_one_group_with_itself_is_said(actions: Actions, solved: Workbench, said: list[Said]) -> None:
    solved.selection.select_cluster(0)
    if len(solved.selection.markers) < 2:
        solved.selection.select_cluster(1)
    assert not actions.trigger("groups.merge")
    assert said[-1].what == "the markers are of one group already"


def test_leaving_out_and_taking_in(actions: Actions, solved: Workbench) -> None:
    solved.selection.select_markers([3])
    assert actions.trigger("groups.leave_out")
    assert solved.board.current["segment"].clusters[3] == -1
    assert actions.trigger("groups.take_in")
    assert solved.board.current["segment"].clusters[3] >= 0


def test_a_candidate_is_pinned_and_let_go(actions: Actions, solved: Workbench) -> None:
    assert actions.why_not("candidate.pin") == "no candidate is selected"
    solved.selection.select(candidate=1)
    assert actions.trigger("candidate.pin")
    assert solved.board.settings["fit"].candidate == 1
    assert solved.board.state("fit") == "stale"
    assert actions.trigger("candidate.unpin")
    assert solved.board.state("fit") == "cached"
    assert actions.why_not("candidate.unpin") == "no candidate is pinned"


def test_another_cloud_of_markers_is_chosen_and_undone(actions: Actions, asks: Answers, solved: Workbench) -> None:
    assert actions.why_not("cloud.choose") == "the markers form one cloud"
    found = solved.board.current["localize"]
    found.cloud[:3] = 1
    asks.answers["Solve the markers of"] = 1
    assert actions.trigger("cloud.choose")
    assert solved.board.settings["localize"].part_of_cloud == 2
    assert solved.board.state("localize") == "stale"
    assert actions.trigger("edit.undo")
    assert solved.board.settings["localize"].part_of_cloud is None
    assert solved.board.state("localize") == "cached"


def test_a_marker_is_pinned_to_a_landmark_and_let_go(actions: Actions, asks: Answers, solved: Workbench) -> None:
    assert actions.why_not("landmark.pin") == "not exactly one marker is selected"
    solved.selection.select_markers([3])
    label = solved.board.current["markers"].labels[3]
    asks.answers[f"{label} sits on"] = 0
    assert actions.why_not("landmark.release") == "nothing was decided of the landmarks of the selected markers"
    assert actions.trigger("landmark.pin")
    ((marker, name),) = solved.board.settings["fit"].pinned
    assert marker == 3 and name and solved.board.state("fit") == "stale"
    assert actions.trigger("landmark.release")
    assert solved.board.settings["fit"].pinned == () and solved.board.state("fit") == "cached"
    drawn = solved.board.current["fit"].pull.landmark[3]
    assert actions.trigger("landmark.refuse")
    assert solved.board.settings["fit"].refused == ((3, drawn),)
    assert actions.trigger("edit.undo")
    assert solved.board.settings["fit"].refused == ()


def test_range_and_offset(actions: Actions, solved: Workbench) -> None:
    assert actions.trigger("offset.found")
    assert solved.board.settings["sync"].offset is None
    solved.clock.set_loop((2.2, 2.8))
    assert actions.trigger("range.selected")
    assert (solved.board.settings["markers"].start, solved.board.settings["markers"].stop) == (2.2, 2.8)
    assert actions.trigger("range.whole")
    assert actions.why_not("range.whole")


def test_playing_by_keys(actions: Actions, solved: Workbench) -> None:
    for name, frame in [
        ("end", 100),
        ("back", 99),
        ("back_10", 89),
        ("forward", 90),
        ("forward_10", 100),
        ("home", 0),
    ]:
        assert actions.trigger(f"play.{name}")
        assert solved.clock.marker_frame == frame
    assert actions.trigger("play.toggle")
    assert actions.is_on("play.toggle")
    assert actions.trigger("play.toggle")
    solved.clock.seek_marker_frame(30)
    actions.trigger("range.from")
    solved.clock.seek_marker_frame(60)
    actions.trigger("range.to")
    assert solved.clock.loop == pytest.approx((2.3, 2.6))
    actions.trigger("play.no_range")
    assert solved.clock.loop is None


def test_jumps_go_where_they_say(actions: Actions, solved: Workbench) -> None:
    residual = solved.board.current["fit"].residual
    assert actions.trigger("go.worst")
    assert solved.clock.marker_frame == np.nanargmax(residual) // residual.shape[1]
    marker = int(np.argmax((~solved.board.current["markers"].present).sum(axis=0)))
    solved.selection.select_markers([marker])
    assert actions.trigger("go.gap")
    assert not solved.board.current["markers"].present[solved.clock.marker_frame, marker]


def _with_gaps(bench: Workbench, present: np.ndarray) -> None:
    """Have the markers of a recording seen as given, (T, M)."""
    known = bench.board.current["markers"]
    positions = np.where(present[..., None], np.zeros(3), np.nan)
    labels = tuple(f"M{k}" for k in range(present.shape[1]))
    ref = Ref("markers", bench.board.keys["markers"])
    bench.board.results._held[ref] = replace(known, positions=positions, labels=labels, filled=None), 0
    bench.clock.set_timing(replace(bench.clock.timing, frames=len(present)))


def test_the_next_gap_is_that_of_any_marker_though_no_frame_shows_them_all(
    actions: Actions, solved: Workbench, said: list[Said]
) -> None:
    present = np.ones((100, 3), bool)
    present[:50, 0] = False  # in no frame are all three seen
    present[50:, 1] = False
    present[20:24, 2] = present[70:71, 2] = False
    _with_gaps(solved, present)
    solved.clock.seek_marker_frame(0)
    visited = []
    for _ in range(4):
        assert actions.trigger("go.gap")
        visited.append(solved.clock.marker_frame)
    assert visited == [20, 50, 70, 0]
    solved.selection.select_markers([2])
    assert actions.trigger("go.gap")
    assert solved.clock.marker_frame == 20
    solved.selection.select_markers([1])
    assert actions.trigger("go.gap")
    assert solved.clock.marker_frame == 50
    assert actions.trigger("go.gap")
    assert "only gap" in said[-1].what
    _with_gaps(solved, np.ones((100, 3), bool))
    assert not actions.trigger("go.gap")
    assert "seen in every frame" in said[-1].what


@pytest.mark.parametrize("name", ["nick_freeform_001.c3d", "mcgill_HC040A14_raw_unlabeled.c3d"])
def test_in_a_real_recording_the_next_gap_is_further_on(
    actions: Actions, solved: Workbench, shared_data: Path, name: str
) -> None:
    present = load_markers(shared_data / "fullbody" / name).present[:2000]
    assert not present.all(axis=1).any(), "no frame shows every marker"
    _with_gaps(solved, present)
    solved.clock.seek_marker_frame(0)
    frames = [0]
    for _ in range(5):
        assert actions.trigger("go.gap")
        frames.append(solved.clock.marker_frame or 0)
        assert (present[frames[-1] - 1] & ~present[frames[-1]]).any(), "a marker is lost from here"
    assert frames == sorted(set(frames))


def test_colours_and_layers(actions: Actions, bench: Workbench) -> None:
    assert actions.trigger("colour.residual")
    assert [name for name in actions.table if name.startswith("colour.") and actions.is_on(name)] == ["colour.residual"]
    before = actions.is_on("layer.body")
    assert actions.trigger("layer.body")
    assert actions.is_on("layer.body") is not before
    assert actions.is_on("window.quit") is None


def test_what_only_a_window_can_do_is_asked_of_it(actions: Actions, asks: Answers) -> None:
    for name in ("help.shortcuts", "help.search", "theme.dark"):
        assert actions.trigger(name)
    assert asks.asked == ["help.shortcuts", "help.search", "theme.dark"]
    assert not actions.trigger("camera.front"), "there is nothing to look at"


def test_running_what_is_there_says_so(actions: Actions, solved: Workbench, said: list[Said]) -> None:
    assert actions.trigger("run.all")
    assert not solved.runner.running
    assert "there for these settings already" in said[-1].what
    solved.selection.select(stage="fit")
    assert actions.trigger("run.to")
    assert said[-1].what.startswith("Everything up to Fit is there")
    assert actions.why_not("run.stop") == "nothing runs"


def test_a_stage_is_run_alone_or_with_all_before_it(actions: Actions, solved: Workbench) -> None:
    board, ran = solved.board, list[str]()
    solved.runner.landed.connect(lambda ref: ran.append(ref.stage))

    def run(action: str, stage: str) -> list[str]:
        ran.clear()
        solved.selection.select(stage=stage)
        assert actions.trigger(action)
        while solved.runner.running:
            solved.tick()
            time.sleep(0.005)
        return sorted(ran, key=board.names.index)

    before = np.asarray(board.current["angles"].degrees)
    assert run("run.stage", "angles") == ["angles"], "it is computed once more, and nothing else"
    assert np.array_equal(board.current["angles"].degrees, before, equal_nan=True)
    assert set(states_of(board).values()) == {"cached"}
    solved.apply(edits.set_value(solved.document.session, "prior", "rate", 25.0))
    solved.apply(edits.set_value(solved.document.session, "segment", "min_overlap", 25))
    assert run("run.stage", "segment") == ["segment"], "the prior is missing, but the groups do not need it"
    solved.document.undo()
    solved.apply(edits.set_value(solved.document.session, "segment", "min_overlap", 26))
    assert run("run.to", "segment") == ["prior", "sync", "segment"], "what is missing above it in the list, too"


def test_markers_are_moved_to_a_group_and_put_back(
    actions: Actions, asks: Answers, solved: Workbench, said: list[Said]
) -> None:
    groups = solved.board.current["segment"].clusters
    one = int(np.flatnonzero(groups == 0)[0])
    assert "no marker is selected" in actions.why_not("groups.move")
    solved.selection.select_markers([one])
    assert actions.trigger("groups.move")
    assert np.array_equal(solved.board.current["segment"].clusters, groups), "nobody said where to"
    asks.answers["Move the selected markers to"] = 1
    assert actions.trigger("groups.move")
    moved = solved.board.current["segment"].clusters
    host = int(np.flatnonzero(groups == 2)[0])  # the second of those it is not in
    assert moved[one] == moved[host], (moved, groups)
    assert actions.trigger("groups.leave_out")
    assert solved.board.current["segment"].clusters[one] == -1
    assert actions.trigger("groups.take_in")
    assert solved.board.current["segment"].clusters[one] >= 0
    for _ in range(3):
        assert actions.trigger("edit.undo")
    assert np.array_equal(solved.board.current["segment"].clusters, groups)


def test_the_scene_is_set_by_keys(actions: Actions, solved: Workbench) -> None:
    display = solved.display
    display.show("body", False)
    actions.trigger("body.less")
    assert (display.opacity, display.layers["body"]) == (0.5, True)
    for _ in range(9):
        actions.trigger("body.more")
    assert display.opacity == 1.0
    actions.trigger("trails.longer")
    assert (display.trail_s, display.layers["trails"]) == (0.6, True)
    for _ in range(9):
        actions.trigger("trails.shorter")
    assert (display.trail_s, display.layers["trails"]) == (0.0, False)
    actions.trigger("tool.select")
    assert display.boxing and actions.is_on("tool.select")
    solved.remember()
    assert solved.document.view["display"]["boxing"] is True
    keys = [key for action in ACTIONS for key in action.keys]
    assert len(keys) == len(set(keys)), "a key that means two things does neither"
    assert {f"Ctrl+{k}" for k in range(7)} <= {*keys}


def test_saving_asks_where_the_first_time(actions: Actions, asks: Answers, bench: Workbench, tmp_path: Path) -> None:
    actions.trigger("session.example")
    assert actions.trigger("session.save")
    assert bench.document.untitled, "no folder was chosen"
    asks.answers["folder"] = tmp_path / "mine"
    assert actions.trigger("session.save")
    assert session_folder(tmp_path / "mine.markerscope") is not None
    actions.trigger("session.save")
    assert asks.asked.count("folder") == 2


def test_nothing_is_lost_by_closing(actions: Actions, asks: Answers, bench: Workbench, tmp_path: Path) -> None:
    actions.trigger("session.example")
    actions.trigger("session.close")
    assert bench.document.is_open, "the user did not say what to do"
    asks.answers |= {"save first": True}
    actions.trigger("session.close")
    assert bench.document.is_open, "no folder was chosen"
    asks.answers["folder"] = tmp_path / "mine"
    actions.trigger("session.close")
    assert not bench.document.is_open
    assert session_folder(tmp_path / "mine.markerscope") is not None
    asks.answers["save first"] = False
    actions.trigger("session.example")
    actions.trigger("window.quit")
    assert asks.asked[-1] == "quit"


def test_closing_during_a_run_asks(asks: Answers, bench: Workbench, monkeypatch: pytest.MonkeyPatch) -> None:
    stopped: list[int] = []
    bench.document.new({"marker_file": DEMO_MARKERS})
    with monkeypatch.context() as patched:
        patched.setattr(type(bench.runner), "running", property(lambda self: not stopped))
        patched.setattr(type(bench.runner), "cancel", lambda self: stopped.append(1))
        assert not may_close(bench, asks)
        asks.answers |= {"stop": True, "save first": False}
        assert may_close(bench, asks)
    assert asks.asked == ["stop", "stop", "save first"]


def test_a_dropped_file_is_opened_for_what_it_is(
    asks: Answers, bench: Workbench, session: Session, tmp_path: Path
) -> None:
    assert open_path(bench, asks, session.folder)
    assert bench.document.folder == session.folder
    assert not open_path(bench, asks, DEMO_MARKERS), "the import was cancelled"
    assert bench.document.folder == session.folder
    left_out = {"segment": {"left_out": [40, 41]}}
    asks.answers["import"] = {"inputs": {"marker_file": DEMO_MARKERS}, "edits": left_out}
    assert open_path(bench, asks, DEMO_MARKERS)
    assert bench.document.session.edits == left_out


def test_exporting_angles(actions: Actions, asks: Answers, solved: Workbench, said: list[Said], tmp_path: Path) -> None:
    asks.answers |= {"save": tmp_path / "out" / "angles.csv", "export": (tmp_path / "all", ["mot", "report"])}
    assert actions.trigger("export.angles")
    assert (tmp_path / "out" / "angles.csv").is_file()
    assert (tmp_path / "out" / "angles.json").is_file()
    assert actions.trigger("export.files")
    assert {path.name for path in (tmp_path / "all").iterdir()} == {"angles.mot", "report.html"}
    assert said[-1].what == "2 files written"
    solved.selection.select(candidate=1)
    actions.trigger("candidate.pin")
    assert "run all stages first" in actions.why_not("export.files")
