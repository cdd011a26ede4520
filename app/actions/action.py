"""Actions as data: the menus, the keys, the search and the shortcut sheet are all made from one table."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar

from markerscope.app.models.signal import Signal
from markerscope.app.models.workbench import Said, Workbench


class Asks(Protocol):
    """What only a window can do: ask the user, and show things. Every question may be answered with None: not now."""

    def file_to_open(self, what: str) -> Path | None:
        """Which file: "session", "markers", "video", "prior", "camera" or "body"."""

    def folder_to_save(self, name: str) -> Path | None:
        """Which folder a session is to be saved in."""

    def file_to_save(self, name: str) -> Path | None:
        """Which file to write; ``name`` proposes one."""

    def how_to_import(self, path: Path) -> Mapping[str, Any] | None:
        """How to read a marker file, and what belongs to it: arguments of ``Document.new``."""

    def what_to_export(self) -> tuple[Path, Sequence[str]] | None:
        """Which folder to export into, and which formats."""

    def save_first(self) -> bool | None:
        """Whether to save what was not saved before it is closed; None for going on as before."""

    def stop_running(self) -> bool:
        """Whether to stop what runs."""

    def number(self, question: str, value: float, unit: str) -> float | None:
        """A number."""

    def choice(self, question: str, options: Sequence[str]) -> int | None:
        """Which of several, by its place."""

    def pictures(self) -> Sequence[Any]:
        """Views of the session, for the report."""

    def show(self, what: str) -> None:
        """Have the window show something of its own: a dialog, a panel, a view of the scene ("camera.front")."""

    def quit(self) -> None:
        """Close the window."""


MENUS = ("File", "Edit", "View", "Play", "Run", "Export", "Help")

Run = Callable[[Workbench, Asks], object]
Reason = Callable[[Workbench], str]


def always(bench: Workbench) -> str:
    """Nothing speaks against it."""
    return ""


@dataclass(frozen=True)
class Action:
    """Something that the user can do.

    Attributes
    ----------
    id : unique, "group.verb"
    title : as in the menu
    menu : the one of ``MENUS`` it stands in
    help : what it does, one sentence
    run : does it
    shortcut : keys as Qt writes them, the first is shown; several with blanks between
    why_not : why it cannot be done now, a clause; empty if it can
    checked : whether it is on, for what can be on or off; None for the others
    """

    id: str
    title: str
    menu: str
    help: str
    run: Run
    shortcut: str = ""
    why_not: Reason = always
    checked: Callable[[Workbench], bool] | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """Its shortcuts."""
        return tuple(self.shortcut.split())


Given = TypeVar("Given")


@dataclass(frozen=True)
class ActionWith(Generic[Given]):
    """Something that the user does to one thing: a row, a stage, a value that was dragged.

    No menu can hold it, since it needs to be told of what; the views do it, and ask beforehand whether it can be done.

    Attributes
    ----------
    id, title : as of ``Action``
    run : does it to what is given
    why_not : why it cannot be done to that now, a clause; empty if it can
    """

    id: str
    title: str
    run: Callable[[Workbench, Asks, Given], object]
    why_not: Callable[[Workbench, Given], str] = lambda bench, given: ""


class Actions:
    """All actions of a window.

    Parameters
    ----------
    table : of all actions
    bench : the models that they act on
    asks : the window

    Attributes
    ----------
    done : emitted with the id of an action that was done
    """

    def __init__(self, table: Sequence[Action], bench: Workbench, asks: Asks) -> None:
        self.table = {action.id: action for action in table}
        self.done: Signal[[str]] = Signal()
        self._bench, self._asks = bench, asks
        if len(self.table) < len(table):
            raise ValueError("two actions have the same id")

    def why_not(self, name: str) -> str:
        """Why an action cannot be done now; empty if it can."""
        return self.table[name].why_not(self._bench)

    def is_on(self, name: str) -> bool | None:
        """Whether an action that can be on or off is on; None for the others."""
        checked = self.table[name].checked
        return None if checked is None else checked(self._bench)

    def trigger(self, name: str) -> bool:
        """Do it; where it cannot be done, the user is told why. Returns whether it was done."""
        action = self.table[name]
        reason = action.why_not(self._bench)
        return self._do(name, action.title, reason, lambda: action.run(self._bench, self._asks))

    def why_not_with(self, action: ActionWith[Given], given: Given) -> str:
        """Why an action cannot be done to what is given; empty if it can."""
        return action.why_not(self._bench, given)

    def do(self, action: ActionWith[Given], given: Given) -> bool:
        """Do an action to what is given; where it cannot be done, the user is told why. Returns whether it was done."""
        reason = action.why_not(self._bench, given)
        return self._do(action.id, action.title, reason, lambda: action.run(self._bench, self._asks, given))

    def _do(self, name: str, title: str, reason: str, run: Callable[[], object]) -> bool:
        if reason:
            self._bench.say(Said("note", reason, title.rstrip(".")))
            return False
        done = self._bench.attempt(run)
        if done:
            self.done.emit(name)
        return done

    def menus(self) -> dict[str, list[Action]]:
        """The actions by menu, in the order of ``MENUS`` and of the table."""
        return {menu: [action for action in self.table.values() if action.menu == menu] for menu in MENUS}


def first(*reasons: Reason) -> Reason:
    """The first reason of several that holds."""

    def why_not(bench: Workbench) -> str:
        return next((reason for check in reasons if (reason := check(bench))), "")

    return why_not


def needs_session(bench: Workbench) -> str:
    """A session has to be open."""
    return "" if bench.document.is_open else "no session is open"


def or_without(*reasons: Reason) -> Callable[[Workbench, Any], str]:
    """The first reason of several that holds whatever is given."""
    return lambda bench, given: first(*reasons)(bench)


def needs_idle(bench: Workbench) -> str:
    """Nothing may run."""
    return "stages are running; wait for them, or stop them" if bench.runner.running else ""


def needs(stage: str, what: str) -> Reason:
    """A stage's result has to be in force."""

    def why_not(bench: Workbench) -> str:
        if reason := needs_session(bench):
            return reason
        return "" if stage in bench.board.current else f"{what}; run that stage first"

    return why_not
