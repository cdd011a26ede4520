"""What is drawn: the result of the settings in force, or of the last ones in force, and never another.

A random walk over edits, undo, redo, runs, cancels, files that change, other programs, saving, closing and crashes.
What there is to draw is compared with a plain record of what was the answer of the settings, state by state.
"""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from markerscope.app.models import edits
from markerscope.app.models.document import Document
from markerscope.app.models.history import History, Step
from markerscope.app.models.home import Home
from markerscope.app.models.results import Ref
from markerscope.app.models.stages import StageBoard
from markerscope.solver.commands.solve import solve_session
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.pipeline.run import keys_of
from markerscope.solver.pipeline.session import InputFile, Session, load_session, save_session


@dataclass
class State:
    """One state of the session's history: by stage, the results that were its answers, the newest last."""

    session: Session
    answers: dict[str, list[str]] = field(default_factory=dict)
    before: list[Session] = field(default_factory=list)
    """What it was in other words, before it was saved."""


class Walk(RuleBasedStateMachine):
    """The models, and a record of what they should draw."""

    @initialize()
    def begin(self) -> None:
        self.folder = Path(tempfile.mkdtemp())
        self.markers = self.folder / "markers.c3d"
        self.markers.write_bytes(b"0")
        self.video = self.folder / "video.mp4"
        self.video.write_bytes(b"1")
        inputs = {"marker_file": InputFile(self.markers), "video_file": InputFile(self.video)}
        session = Session(self.folder / "mine.markerscope", inputs)
        save_session(session)
        self.pending: list[tuple[Session, dict[str, str]]] = []
        self.foreign = 0
        self._open()
        self.line, self.at = [State(self.document.session)], 0
        self.on_disk: dict[str, list[str]] = {}
        self._record()

    def _open(self) -> None:
        self.document = Document(Home(self.folder / "config", self.folder / "data"))
        self.document.open(self.folder / "mine.markerscope")
        self.board = StageBoard(self.document)

    def teardown(self) -> None:
        if hasattr(self, "folder"):
            self.document.close()
            shutil.rmtree(self.folder)

    # The record

    def _record(self) -> None:
        """Write down which results are the answers of the settings now."""
        here = self.line[self.at]
        for stage, key in keys_of(self.document.session).items():
            if self._there(stage, key):
                known = here.answers.setdefault(stage, [])
                if not known or known[-1] != key:
                    known.append(key)
        if not self.document.dirty:
            self.on_disk = self._flat()

    def _flat(self) -> dict[str, list[str]]:
        found: dict[str, list[str]] = {}
        for state in self.line[: self.at + 1]:
            for stage, keys in state.answers.items():
                found[stage] = [*found.get(stage, []), *keys]
        return found

    def _there(self, stage: str, key: str) -> bool:
        return (self.document.folder / "results" / stage / key / "manifest.json").exists()

    def _expected(self, stage: str, key: str) -> tuple[str, bool] | None:
        if self._there(stage, key):
            return key, True
        known = self._flat().get(stage)
        return (known[-1], False) if known else None

    # What the user does

    def _apply(self, edit: edits.Edit) -> None:
        before = self.document.history.position
        self.document.apply(edit)
        after = self.document.history.position
        if after > before:
            self.line = [*self.line[: before + 1], State(self.document.session)]
        self.line, self.at = self.line[: len(self.document.history.steps)], after
        self.line[after].session = self.document.session
        self._record()

    @rule(what=st.integers(0, 7))
    def edit(self, what: int) -> None:
        """A setting that is dialled, a candidate, the offset, the range, the convention: each of two values."""
        session, other = self.document.session, what % 2
        kinds = (
            lambda: edits.set_value(session, "orient", "offset_mm", (8.0, 12.0)[other]),
            lambda: edits.pin_candidate(session, other),
            lambda: edits.set_offset(session, (0.1, 0.2)[other]),
            lambda: edits.set_value(session, "angles", "convention", ("opensim", "isb")[other]),
        )
        self._apply(kinds[what // 2]())

    @rule(to=st.integers(-2, 2))
    def undo_or_redo(self, to: int) -> None:
        self.document.go_to(self.document.history.position + to)
        self.at = self.document.history.position
        self._record()

    def _land(self, session: Session, keys: dict[str, str], stages: Sequence[str]) -> None:
        """Results arrive as from a worker that was started for a session."""
        for stage in stages:
            self.board.begin(stage, keys[stage])
            if not self._there(stage, keys[stage]):
                self.board.results.store.put(stage, keys[stage], 0, {"version": -1, "headline": keys[stage]})
                self.board.land(Ref(stage, keys[stage]), session)
                for state in self.line:
                    if session in (state.session, *state.before):
                        state.answers.setdefault(stage, []).append(keys[stage])
            else:
                self.board.end()
            self._record()

    @rule(upto=st.sampled_from([13, 13, 11, 4]))
    def run_and_perhaps_cancel(self, upto: int) -> None:
        keys = dict(keys_of(self.document.session))
        self._land(self.document.session, keys, list(keys)[:upto])

    @rule()
    def another_program_runs_the_session(self) -> None:
        """Nobody tells the window; it finds the result when it looks, and before anything else is decided."""
        for stage, key in keys_of(self.document.session).items():
            if not self._there(stage, key):
                self.board.results.store.put(stage, key, 0, {"version": -1, "headline": key})
        self._record()

    @rule()
    def start_a_run(self) -> None:
        self.pending = [(self.document.session, dict(keys_of(self.document.session)))]

    @precondition(lambda self: bool(self.pending))
    @rule(upto=st.integers(1, 13))
    def a_run_ends_that_was_started_before(self, upto: int) -> None:
        session, keys = self.pending.pop()
        self._land(session, keys, list(keys)[:upto])

    @rule(stage=st.sampled_from(["fit", "angles", "sync", "segment"]))
    def another_program_writes_a_result(self, stage: str) -> None:
        self.foreign += 1
        self.board.results.store.put(stage, f"f{self.foreign}", 0, {"version": -1})
        self.board.refresh()

    @rule()
    def the_file_changes(self) -> None:
        self.markers.write_bytes(self.markers.read_bytes() + b"0" if len(self.markers.read_bytes()) < 3 else b"0")
        self.board.refresh()
        self._record()

    @rule()
    def save(self) -> None:
        self.document.save()
        self.line[self.at].before.append(self.line[self.at].session)
        self.line[self.at].session = self.document.session
        self._record()

    @rule()
    def close_and_open(self) -> None:
        """What was not saved is given up."""
        self.document.close()
        self._open()
        self.line, self.at, self.pending = [State(self.document.session, self.on_disk)], 0, []
        self._record()

    @rule()
    def crash_and_open(self) -> None:
        self.document._writer.flush()
        self.document._writer.close()
        self._open()
        assert self.document.history.position == self.at
        for state, step in zip(self.line, self.document.history.steps):
            state.session = step.session
        self.pending = []
        self._record()

    # The property

    @invariant()
    def what_there_is_to_draw_was_the_answer(self) -> None:
        if not hasattr(self, "board"):
            return
        for stage, key in keys_of(self.document.session).items():
            expected = self._expected(stage, key)
            assert self.board.latest(stage) == expected, stage
            state, card = self.board.state(stage), self.board.card(stage)
            assert state == ("not run" if expected is None else "cached" if expected[1] else "stale"), stage
            if expected is not None and not expected[0].startswith("f"):
                assert card.headline == expected[0], stage
            assert (card.seconds is not None) == (expected is not None)


TestWalk = Walk.TestCase
TestWalk.settings = settings(
    max_examples=10, stateful_step_count=14, deadline=None, suppress_health_check=list(HealthCheck), derandomize=True
)


def _walk() -> Iterator[Walk]:
    """A walk to take step by step."""
    made = Walk()
    made.begin()
    yield made
    made.teardown()


walk = pytest.fixture(_walk)


def test_a_fit_that_was_undone_does_not_come_back_with_the_next_edit(walk: Walk) -> None:
    walk.run_and_perhaps_cancel(13)
    kept = walk.board.latest("fit")
    walk.edit(3)
    walk.run_and_perhaps_cancel(13)
    assert walk.board.latest("fit") != kept
    walk.undo_or_redo(-1)
    assert walk.board.latest("fit") == kept
    walk.edit(5)
    assert kept is not None
    assert walk.board.latest("fit") == (kept[0], False)
    walk.what_there_is_to_draw_was_the_answer()


def test_nothing_is_drawn_of_an_answer_that_was_undone(walk: Walk) -> None:
    walk.edit(3)
    walk.run_and_perhaps_cancel(13)
    wanted = walk.board.latest("fit")
    walk.undo_or_redo(-1)
    assert (walk.board.latest("fit"), walk.board.state("fit")) == (None, "not run")
    walk.undo_or_redo(1)
    assert walk.board.latest("fit") == wanted


def test_a_result_that_arrives_after_the_next_edit_is_the_last_one_in_force(walk: Walk) -> None:
    walk.run_and_perhaps_cancel(13)
    walk.edit(5)
    walk.start_a_run()
    wanted = walk.board.keys["fit"]
    walk.edit(1)
    walk.a_run_ends_that_was_started_before(13)
    assert walk.board.latest("fit") == (wanted, False)
    walk.what_there_is_to_draw_was_the_answer()


def test_a_result_that_arrives_after_saving_and_the_next_edit_is_the_last_one_in_force(walk: Walk) -> None:
    walk.start_a_run()
    wanted = walk.board.keys["fit"]
    walk.save()
    walk.edit(1)
    walk.a_run_ends_that_was_started_before(13)
    assert walk.board.latest("fit") == (wanted, False)
    walk.what_there_is_to_draw_was_the_answer()


def test_a_result_of_another_program_is_found_before_its_settings_are_left(walk: Walk) -> None:
    walk.another_program_runs_the_session()
    wanted = walk.board.keys["fit"]
    walk.edit(1)
    assert walk.board.latest("fit") == (wanted, False)


def test_what_was_in_force_is_drawn_after_closing_and_opening(walk: Walk) -> None:
    walk.run_and_perhaps_cancel(13)
    kept = walk.board.keys["fit"]
    walk.edit(3)
    walk.run_and_perhaps_cancel(13)
    walk.undo_or_redo(-1)
    walk.edit(5)
    walk.save()
    walk.close_and_open()
    assert walk.board.latest("fit") == (kept, False)
    walk.edit(1)
    walk.crash_and_open()
    assert walk.board.latest("fit") == (kept, False)


def test_what_the_command_line_solved_is_drawn_after_its_file_was_edited_by_hand(
    session: Session, tmp_path: Path
) -> None:
    wanted = keys_of(session)["fit"]
    solve_session(SolveRequest(session.folder))
    solved = load_session(session.folder)
    save_session(edits.set_offset(solved, 0.2).session)
    document = Document(Home(tmp_path / "config", tmp_path / "data"))
    document.open(session.folder)
    board = StageBoard(document)
    assert board.latest("fit") == (wanted, False)
    assert board.state("fit") == "stale"
    document.close()


def _step(session: Session, merge: str = "", **answers: str) -> Step:
    return Step("x", time.time(), session, merge, answers)


def test_a_value_that_is_dialled_keeps_what_was_in_force_on_the_way(tmp_path: Path) -> None:
    first, second, third = (Session(tmp_path, edits={"sync": {"offset": k}}) for k in (0.0, 1.0, 2.0))
    history = History([_step(Session(tmp_path), fit="a")])
    history.add(_step(first, "offset"))
    history.note({"fit": "b"})
    history.add(_step(second, "offset"))
    assert history.position == 1
    assert list(history.in_force_before("fit")) == ["b", "a"]
    history.go_to(0)
    assert list(history.in_force_before("fit")) == ["a"], "what was undone is no answer"
    history.add(_step(third))
    assert list(history.in_force_before("fit")) == ["a"]


def test_a_history_that_forgets_its_first_steps_forgets_no_answer(tmp_path: Path) -> None:
    history = History([_step(Session(tmp_path), fit="first")])
    for k in range(600):
        history.add(_step(Session(tmp_path, edits={"sync": {"offset": float(k)}})))
        if k == 3:
            history.note({"fit": "early"})
    assert len(history.steps) == 500
    assert next(history.in_force_before("fit")) == "early"
    history.go_to(0)
    assert next(history.in_force_before("fit")) == "first"
