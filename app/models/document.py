"""The open session: what was decided, undone and redone, whether it is saved, and how it comes back after a crash."""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from markerscope.app.models.edits import Edit, existing
from markerscope.app.models.history import History, Step
from markerscope.app.models.home import Home
from markerscope.app.models.journal import JOURNAL, VIEW, Writer, journal_of, read_journal, read_view
from markerscope.app.models.keep import kept_decisions
from markerscope.app.models.signal import Signal
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import cannot_write, make_folder
from markerscope.solver.pipeline.in_force import IN_FORCE, read_answers
from markerscope.solver.pipeline.look import look_at
from markerscope.solver.pipeline.methods import graph_of, spelt_out
from markerscope.solver.pipeline.session import (
    FILE_NAME,
    SUFFIX,
    InputFile,
    Session,
    load_session,
    save_session,
    session_folder,
)
from markerscope.solver.pipeline.session_file import require_state, state_of


class Document:
    """At most one open session.

    Parameters
    ----------
    home : the user's folders

    Attributes
    ----------
    changed : emitted when the session is another or has changed (a decision, undo, redo), with whether it is another
    leaving : emitted before the session changes, while it still is what it was
    saved : emitted when ``dirty``, ``folder`` or the list of recent sessions may have changed
    view : how the window looked when the session was last open, by part of the window
    recovered : whether decisions came back that a crash had kept from being saved
    """

    def __init__(self, home: Home) -> None:
        self.home = home
        self.changed: Signal[[bool]] = Signal()
        self.leaving: Signal[[]] = Signal()
        self.saved: Signal[[]] = Signal()
        self.view: dict[str, Any] = {}
        self.recovered = False
        self._history: History | None = None
        self._on_disk: Session | None = None
        self._state = ""
        self._writer = Writer()

    @property
    def is_open(self) -> bool:
        """Whether there is a session."""
        return self._history is not None

    @property
    def history(self) -> History:
        """What was decided; only while a session is open."""
        if self._history is None:
            raise InputError("no session is open", remedy="open one first")
        return self._history

    @property
    def session(self) -> Session:
        """The open session as it is now."""
        return self.history.session

    @property
    def folder(self) -> Path:
        """The open session's folder."""
        return self.session.folder

    @property
    def untitled(self) -> bool:
        """Whether the session has not been saved anywhere yet."""
        return self.is_open and self.folder.parent == self.home.unsaved

    @property
    def dirty(self) -> bool:
        """Whether there is something that has not been saved."""
        return self.is_open and (self.untitled or self.session != self._on_disk)

    @property
    def name(self) -> str:
        """What to call the session."""
        if not self.is_open:
            return ""
        if self.untitled and "marker_file" in self.session.inputs:
            return self.session.inputs["marker_file"].path.stem
        return self.folder.name.removesuffix(SUFFIX)

    @property
    def problem(self) -> str | None:
        """Why decisions cannot be kept for the case of a crash, if they cannot."""
        return self._writer.problem

    def new(
        self,
        inputs: Mapping[str, Path],
        settings: Mapping[str, Mapping[str, Any]] | None = None,
        edits: Mapping[str, Mapping[str, Any]] | None = None,
        name: str = "",
    ) -> None:
        """Begin a session from files.

        Parameters
        ----------
        inputs : files by the name of the graph's source; ``marker_file`` among them
        settings : how they are read, tables by stage
        edits : what was decided while they were chosen (points that are no markers of the person), tables by stage
        name : what to call its folder, the marker file's name by default

        Raises
        ------
        InputError : a file is not there, or a setting cannot be used
        """
        files = {name: InputFile(existing(Path(path), name.replace("_", " "))) for name, path in inputs.items()}
        if "marker_file" not in files:
            raise InputError("a session begins with one", "the marker file", "choose a C3D, TRC, CSV or TSV file")
        session = Session(Path(), files, dict(settings or {}), dict(edits or {}))
        session.stage_settings(graph_of(session))
        look_at({name: file.path for name, file in files.items()})
        self.close()
        folder = self.home.new_folder(name or files["marker_file"].path.stem)
        self._begin(replace(session, folder=folder), f"Session begun from {files['marker_file'].path.name}")

    def open(self, path: Path, although_open: bool = False) -> None:
        """Open a session from its folder or file, as it was left, be it by a crash.

        Parameters
        ----------
        although_open : even if another window seems to have it open

        Raises
        ------
        InputError : it cannot be read, or another window has it open
        """
        folder = session_folder(path)
        if folder is None and Path(path).is_dir() and read_journal(Path(path).absolute()) is not None:
            folder = Path(path).absolute()  # never saved, and left by a crash
        left = None if folder is None else read_journal(folder)
        state = "" if folder is None else state_of(folder)
        if left is not None and left.alive and not although_open:
            raise InputError("is open in another window", path, "close it there first")
        on_disk = load_session(path) if left is None or session_folder(path) is not None else None
        for session in (on_disk, None if left is None else left.history.session):
            if session is not None:  # settings that cannot be used are refused here, not later
                session.stage_settings(graph_of(session))
        self.close()
        if left is None:
            assert on_disk is not None
            self._begin(on_disk, "Session opened", on_disk, state=state)
        else:
            ours = left.state is None or any(step.session == on_disk for step in left.history.steps)
            self._begin(left.history.session, "", on_disk, left.history, state if ours else left.state or "")
        if not self.untitled:
            self.home.add_recent(self.folder)
            self.saved.emit()

    def left_by_crash(self) -> tuple[Path, ...]:
        """Sessions that were never saved, and whose window did not close as it should."""
        folders = sorted(self.home.unsaved.glob(f"*{SUFFIX}")) if self.home.unsaved.is_dir() else []
        return tuple(f for f in folders if (left := read_journal(f)) is not None and not left.alive)

    def apply(self, edit: Edit) -> None:
        """Carry a decision out.

        Raises
        ------
        InputError : the settings or a file that it brings cannot be used; nothing has changed
        """
        before = self.session
        if edit.session == before:
            return
        edit.session.stage_settings(graph_of(edit.session))
        look_at({name: file.path for name, file in edit.session.inputs.items() if before.inputs.get(name) != file})
        edit = kept_decisions(before, edit)
        self.leaving.emit()
        self.history.add(Step(edit.sentence, time.time(), edit.session, edit.merge))
        self._after_change()

    def undo(self) -> None:
        """Take the last decision back."""
        self.go_to(self.history.position - 1)

    def redo(self) -> None:
        """Decide again what was taken back last."""
        self.go_to(self.history.position + 1)

    def go_to(self, position: int) -> None:
        """Have the session as it was after a step of the history."""
        self.leaving.emit()
        if self.history.go_to(position):
            self._after_change()

    def note(self, answers: Mapping[str, str]) -> None:
        """Remember which results, key by stage, are in force now."""
        if self.history.note(answers):
            self._keep()

    def note_for(self, session: Session, answers: Mapping[str, str]) -> None:
        """Remember results, key by stage, that arrive when the session they were computed for may be left already."""
        if self.is_open and self.history.note_for(session, answers):
            self._keep()

    def save(self) -> None:
        """Write the session file, with every setting and what the inputs hold.

        Raises
        ------
        InputError : the file system refuses, or the session needs ``save_as`` first
        EditedOutside : somebody else has changed the file since it was read; it stays as it is
        """
        if self.untitled:
            raise InputError("it has no place yet", "the session", "choose a folder for it")
        self._require_state()
        session = spelt_out(self.session, digests_of(self.session))
        save_session(session)
        self.history.restate(session)
        self._on_disk, self._state = session, state_of(self.folder)
        self._keep()
        self.home.add_recent(self.folder)
        self.saved.emit()

    def take_from_disk(self) -> None:
        """Have the session as its file says now, as a decision that can be undone; the file then counts as read.

        Raises
        ------
        InputError : the file cannot be read, or its settings cannot be used; nothing has changed
        """
        state, on_disk = state_of(self.folder), load_session(self.folder)
        self.apply(Edit(f"As {FILE_NAME} says, edited outside", on_disk, complete=True))
        self._on_disk, self._state = on_disk, state
        self._keep()
        self.saved.emit()

    def save_as(self, folder: Path) -> None:
        """Give the session another folder, results and all. No worker may be writing into the old one.

        Raises
        ------
        InputError : the place is taken by something else, or the file system refuses; the session stays where it was
        """
        folder = Path(os.path.abspath(folder))
        if folder.suffix != SUFFIX and session_folder(folder) is None:
            folder = folder.with_name(folder.name + SUFFIX)
        old, untitled = self.folder, self.untitled
        if folder != old:
            if folder.is_dir() and session_folder(folder) is None and any(folder.iterdir()):
                raise InputError("is a folder of other things", folder, "choose another name")
            _copy_results(old, folder)
        else:
            self._require_state()
        moved = [replace(step, session=replace(step.session, folder=folder)) for step in self.history.steps]
        save_session(moved[self.history.position].session)
        self._state = state_of(folder)
        self._writer.write(old / JOURNAL, None)
        self._writer.flush()
        self._history = History(moved, self.history.position)
        if untitled and folder != old:
            shutil.rmtree(old, ignore_errors=True)
        self.set_view(**self.view)
        self.save()
        self.changed.emit(True)

    def set_view(self, **parts: Any) -> None:
        """Remember how parts of the window look, plain JSON values by name; written soon."""
        if self.is_open:
            self.view = {**self.view, **parts}
            self._writer.write(self.folder / VIEW, self.view)

    def close(self, keep_untitled: bool = False) -> None:
        """Close the session; what was not saved is given up.

        Parameters
        ----------
        keep_untitled : leave a session that was never saved where it is, to be found again
        """
        if self._history is None:
            return
        self.leaving.emit()
        folder, untitled = self.folder, self.untitled
        if not (untitled and keep_untitled):
            self._writer.write(folder / JOURNAL, None)
        self._writer.close()
        if untitled and not keep_untitled:
            shutil.rmtree(folder, ignore_errors=True)
        self._history, self._on_disk, self.view, self.recovered = None, None, {}, False
        self._state = ""
        self.changed.emit(True)
        self.saved.emit()

    def _begin(
        self,
        session: Session,
        sentence: str,
        on_disk: Session | None = None,
        history: History | None = None,
        state: str = "",
    ) -> None:
        answers = read_answers(session.folder)
        self._history = history or History([Step(sentence, time.time(), session, answers=answers)])
        self._on_disk, self._state = on_disk, state
        self.recovered = history is not None and session != on_disk
        self.view = read_view(session.folder)
        self._keep()
        self.changed.emit(True)
        self.saved.emit()

    def _after_change(self) -> None:
        self._keep()
        self.changed.emit(False)
        self.saved.emit()

    def _keep(self) -> None:
        self._writer.write(self.folder / JOURNAL, journal_of(self.history, self._state))
        if not self.dirty:
            self._writer.write(self.folder / IN_FORCE, self.history.answers_at(self.history.position))

    def _require_state(self) -> None:
        require_state(self.folder, self._state, "save yours in another folder, or take the one on disk")


def digests_of(session: Session) -> dict[str, str]:
    """What each input holds (SHA-256); one that is not there is left out."""
    cache, found = session.digests, {}
    for name, file in session.inputs.items():
        with suppress(InputError):
            found[name] = cache.digest(file.path)
    cache.save()
    return found


def _copy_results(old: Path, new: Path) -> None:
    """Have the results in the new folder too."""
    make_folder(new)
    try:
        if (old / "results").is_dir():
            ignored = shutil.ignore_patterns(".tmp-*", "outputs.json")
            shutil.copytree(old / "results", new / "results", dirs_exist_ok=True, ignore=ignored)
    except (OSError, shutil.Error) as error:
        if not (new / FILE_NAME).exists():
            shutil.rmtree(new, ignore_errors=True)
        if isinstance(error, shutil.Error):
            raise InputError("cannot be written whole", new, "choose another place") from error
        raise cannot_write(new, error) from error
