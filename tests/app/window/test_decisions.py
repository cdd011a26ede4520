"""Every decision in the window goes through the table of actions, so that one rule guards its key and its button."""

from __future__ import annotations

import ast
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from markerscope.app.actions import ACTIONS, ACTIONS_WITH, ActionWith
from markerscope.app.window.main import MainWindow

ROOT = Path(__file__).parents[3]
WINDOW = sorted((ROOT / "app" / "window").glob("*.py"))
Spin = Callable[..., None]

NO_MODULES = ("app.models.edits", "app.models.group_edits", "app.models.clean_edits", "solver.pipeline.run")
"""What makes decisions and carries them out."""
NO_CALLS = {
    "bench": {"apply", "open"},
    "document": {"apply", "undo", "redo", "go_to", "new", "open", "save", "save_as", "take_from_disk", "close"},
    "runner": {"run", "cancel"},
    "board": {"go_back", "compare"},
    "display": {"set", "show", "toggle"},
    "clock": {"set_loop", "set_speed", "play", "toggle", "step", "home", "end", "slower", "faster"},
    "edits": None,
    "group_edits": None,
    "clean_edits": None,
}
"""By what stands before the last dot: what is not to be called, or even passed on; None for anything."""
NO_NAMES = {"run_stage", "run_until", "open_path"}


def bypasses(source: str) -> list[str]:
    """What in a module of the window decides something past the table, "line: what"."""
    found = []
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.ImportFrom):
            names = {f"{node.module}.{alias.name}" for alias in node.names}
            wrong = [name for name in names for no in NO_MODULES if f"{name}.".startswith(f"markerscope.{no}.")]
            wrong += [alias.name for alias in node.names if alias.name in NO_NAMES]
            found += [f"{node.lineno}: import of {name}" for name in wrong]
        elif isinstance(node, ast.Attribute):
            owner = node.value.attr if isinstance(node.value, ast.Attribute) else getattr(node.value, "id", "")
            if owner in NO_CALLS and ((names := NO_CALLS[owner]) is None or node.attr in names):
                found.append(f"{node.lineno}: {owner}.{node.attr}")
    return found


@pytest.mark.parametrize("path", WINDOW, ids=lambda path: path.stem)
def test_no_module_of_the_window_decides_past_the_table(path: Path) -> None:
    assert not bypasses(path.read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    "line",
    [
        "from markerscope.app.models import edits",
        "from markerscope.app.models.edits import set_value",
        "from markerscope.app.actions.run_actions import run_stage",
        "self.bench.document.apply(made)",
        "widget.stop.connect(bench.runner.cancel)",
        "self.bench.apply(made)",
        "widget.speed_chosen.connect(clock.set_speed)",
    ],
)
def test_a_bypass_is_found(line: str) -> None:
    assert bypasses(line)


def test_every_action_with_an_argument_is_declared_once() -> None:
    import importlib
    import pkgutil

    import markerscope.app.actions as package

    made = {
        id(value): value
        for info in pkgutil.iter_modules(package.__path__)
        for value in vars(importlib.import_module(f"{package.__name__}.{info.name}")).values()
        if isinstance(value, ActionWith)
    }
    assert {id(action) for action in ACTIONS_WITH} == made.keys()
    ids = [action.id for action in (*ACTIONS, *ACTIONS_WITH)]
    assert len(set(ids)) == len(ids)


def test_buttons_and_keys_are_refused_for_the_same_reason(solved_window: Any, spin: Spin) -> None:
    window: MainWindow = solved_window()
    table, bench, said = window.table, window.bench, window.said  # type: ignore[attr-defined]
    bench.selection.select(candidate=0)
    assert table.trigger("candidate.pin")
    spin()
    held = bench.document.session
    assert table.why_not("candidate.pin") == "it is pinned already"
    window.hypotheses.pin_requested.emit(0)
    assert bench.document.session is held and said[-1].what == "it is pinned already"
    cards = {card.card.candidate: card for card in window.hypotheses.cards()}
    assert not cards[0].pin.isEnabled()
    assert window.candidates.pin_button.text() == "Unpin" and window.candidates.pin_button.isEnabled()
    bench.clock.seek_marker_frame(10**6)
    spin()
    reason = table.why_not("play.forward")
    assert reason and not window.transport.forward.isEnabled() and reason in window.transport.forward.toolTip()
    assert window.transport.back.isEnabled()
    menu = window.scene_menu.menu_for([0])
    merge = next(action for action in menu.actions() if action.text() == "Merge their groups")
    bench.selection.select_markers([0])
    assert not merge.isEnabled() and table.why_not("groups.merge") in merge.toolTip()


def test_while_a_run_is_on_no_card_offers_another(solved_window: Any, spin: Spin) -> None:
    window: MainWindow = solved_window()
    bench, card = window.bench, window.stages.card("angles")
    bench.selection.select(stage="angles")
    card.run.emit("angles")
    assert bench.runner.running
    spin(lambda: not card.run_button.isEnabled() or not bench.runner.running, "the card")
    if bench.runner.running:
        assert window.table.why_not("run.stage") in card.run_button.toolTip()
        card.run.emit("angles")
        assert "stages are running" in window.said[-1].what  # type: ignore[attr-defined]
    spin(lambda: not bench.runner.running, "the run")
    spin(lambda: card.run_button.isEnabled(), "the card")
