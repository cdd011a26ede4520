"""What keeps a session through a crash: every decision since it was opened, and how the window looked.

``journal.json`` lies in the session's folder while the session is open; one that is found when a session is opened was
left by a crash (or belongs to another window that has it open). ``in_force.json`` says which results the saved session
had: after a setting was changed they, and no others in the store, are drawn as out of date. Files are written by a
thread, the latest state only, so that no decision waits for the disk.
"""

from __future__ import annotations

import json
import os
import socket
import threading
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from markerscope.app.models.history import History, Step
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.pipeline.in_force import answers_from
from markerscope.solver.pipeline.session import session_document, session_from

JOURNAL = "journal.json"
VIEW = "view.json"
_PAUSE_S = 0.3
"""Between two writes, so that a camera that is turned does not keep the disk busy."""
_KEPT = 60
"""Steps that are written down; older ones could not be undone after a crash."""


@dataclass(frozen=True)
class Left:
    """What a journal says.

    Attributes
    ----------
    history : as it was
    state : of the session file when it was read or written last, None where an older version kept the journal
    alive : whether the program that wrote it still runs
    """

    history: History
    alive: bool
    state: str | None = None


def read_journal(folder: Path) -> Left | None:
    """The journal in a session's folder; None where there is none, or it cannot be understood."""
    file = folder / JOURNAL
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        steps = [
            Step(
                str(row["sentence"]),
                float(row["when"]),
                session_from(row["session"], folder, file),
                answers=answers_from(row.get("answers")),
            )
            for row in content["steps"]
        ]
        position = int(content["position"])
        if not 0 <= position < len(steps):
            return None
        state = content.get("state")
        return Left(History(steps, position), _alive(content), state if isinstance(state, str) else None)
    except (OSError, ValueError, KeyError, TypeError, AttributeError, InputError):
        return None


def journal_of(history: History, state: str) -> dict[str, Any]:
    """What is written down of a history, and of the session file's ``state`` that it stands on."""
    first = max(0, min(history.position, len(history.steps) - _KEPT))
    steps = history.steps[first : first + _KEPT]
    steps[0] = replace(steps[0], answers=history.answers_at(first))
    return {
        "process": os.getpid(),
        "computer": socket.gethostname(),
        "state": state,
        "position": history.position - first,
        "steps": [
            {
                "sentence": step.sentence,
                "when": step.when,
                "session": session_document(step.session),
                "answers": dict(step.answers),
            }
            for step in steps
        ],
    }


def read_view(folder: Path) -> dict[str, Any]:
    """How the window looked when the session was last open; empty where that is not known."""
    try:
        content = json.loads((folder / VIEW).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


class Writer:
    """Writes files in a thread, each as it was said last.

    Attributes
    ----------
    problem : why the last file could not be written, in one sentence; None if it could
    """

    def __init__(self) -> None:
        self.problem: str | None = None
        self._waiting: dict[Path, Mapping[str, Any] | None] = {}
        self._changed = threading.Condition()
        self._busy = False
        self._hurried = False
        self._closed = False
        self._thread: threading.Thread | None = None

    def write(self, path: Path, content: Mapping[str, Any] | None) -> None:
        """Have a file hold this, soon; None takes it away. The content must not be changed any more."""
        with self._changed:
            self._waiting[path] = content
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
                self._thread.start()
            self._changed.notify_all()

    def flush(self) -> None:
        """Wait until everything is written."""
        with self._changed:
            self._hurried = True
            self._changed.notify_all()
            self._changed.wait_for(lambda: not self._waiting and not self._busy)
            self._hurried = False

    def close(self) -> None:
        """Write what is left, and end the thread."""
        self.flush()
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread is not None:
            self._thread.join()
        self._thread, self._closed = None, False

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if not self._waiting:
                    return
                waiting, self._waiting, self._busy = self._waiting, {}, True
            for path, content in waiting.items():
                self._put(path, content)
            with self._changed:
                self._busy = False
                self._changed.notify_all()
                self._changed.wait_for(lambda: self._hurried or self._closed, _PAUSE_S)

    def _put(self, path: Path, content: Mapping[str, Any] | None) -> None:
        try:
            if content is None:
                path.unlink(missing_ok=True)
            else:
                write_text_atomic(path, json.dumps(content, indent=1) + "\n")
            self.problem = None
        except (InputError, OSError) as error:
            self.problem = str(error)


def _alive(content: Mapping[str, Any]) -> bool:
    """Whether another process that runs on this computer wrote the journal."""
    process = content.get("process")
    ours = content.get("computer") == socket.gethostname()
    if not ours or not isinstance(process, int) or process == os.getpid() or os.name == "nt":
        return False  # Windows has no harmless way to ask
    with suppress(PermissionError):  # somebody else's: alive
        try:
            os.kill(process, 0)
        except (ProcessLookupError, OverflowError):
            return False
    return True
