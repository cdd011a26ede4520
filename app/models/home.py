"""Where the program keeps what belongs to the user and to no session: recent files, preferences, unsaved sessions."""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.pipeline.session import SUFFIX

_MOST_RECENT = 12


@dataclass(frozen=True)
class Recent:
    """A session or file that was opened.

    Attributes
    ----------
    path : absolute
    when : s since the epoch
    """

    path: Path
    when: float

    @property
    def exists(self) -> bool:
        """Whether it is still there."""
        return self.path.exists()


@dataclass(frozen=True)
class Home:
    """The user's folders.

    Attributes
    ----------
    config : preferences and recent files
    data : sessions that have not been saved anywhere yet
    """

    config: Path
    data: Path

    @staticmethod
    def of_user(environment: Mapping[str, str] = os.environ) -> Home:
        """Where this system keeps such things; ``MARKERSCOPE_HOME`` names another folder."""
        if own := environment.get("MARKERSCOPE_HOME"):
            return Home(Path(own), Path(own))
        user = Path.home()
        if sys.platform == "win32":
            roaming = Path(environment.get("APPDATA", user / "AppData" / "Roaming"))
            local = Path(environment.get("LOCALAPPDATA", user / "AppData" / "Local"))
            return Home(roaming / "Markerscope", local / "Markerscope")
        if sys.platform == "darwin":
            folder = user / "Library" / "Application Support" / "Markerscope"
            return Home(folder, folder)
        config = Path(environment.get("XDG_CONFIG_HOME") or user / ".config")
        data = Path(environment.get("XDG_DATA_HOME") or user / ".local" / "share")
        return Home(config / "markerscope", data / "markerscope")

    @property
    def unsaved(self) -> Path:
        """The folder of sessions that have not been saved."""
        return self.data / "unsaved"

    def new_folder(self, name: str) -> Path:
        """A folder for a new session, named after the day and what it is of."""
        clean = "".join(c if c.isalnum() or c in "-_" else "_" for c in name)[:60] or "session"
        stamp = time.strftime("%Y%m%d-%H%M%S")
        for number in range(1000):
            folder = self.unsaved / f"{clean}-{stamp}{f'-{number}' if number else ''}{SUFFIX}"
            if not folder.exists():
                return make_folder(folder)
        raise InputError("is full of sessions", self.unsaved, "delete those you do not need")

    def recent(self) -> tuple[Recent, ...]:
        """What was opened, the latest first."""
        rows = self._read("recent.json").get("recent", [])
        found = []
        for row in rows if isinstance(rows, list) else []:
            with suppress(KeyError, TypeError, ValueError):
                found.append(Recent(Path(str(row["path"])), float(row["when"])))
        return tuple(found[:_MOST_RECENT])

    def add_recent(self, path: Path) -> None:
        """Put a session first among the recent ones."""
        path = path.absolute()
        kept = [Recent(path, time.time()), *(row for row in self.recent() if row.path != path)]
        self._write_recent(kept)

    def remove_recent(self, path: Path) -> None:
        """Show it no more."""
        self._write_recent([row for row in self.recent() if row.path != path.absolute()])

    def preferences(self) -> dict[str, Any]:
        """What the user prefers everywhere: theme, size of text."""
        return self._read("preferences.json")

    def prefer(self, **values: Any) -> None:
        """Remember preferences; a disk that refuses is no reason to stop."""
        self._write("preferences.json", {**self.preferences(), **values})

    def _write_recent(self, rows: list[Recent]) -> None:
        listed = [{"path": str(row.path), "when": row.when} for row in rows[:_MOST_RECENT]]
        self._write("recent.json", {"recent": listed})

    def _read(self, name: str) -> dict[str, Any]:
        try:
            content = json.loads((self.config / name).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return {}
        return content if isinstance(content, dict) else {}

    def _write(self, name: str, content: Any) -> None:
        with suppress(InputError):
            make_folder(self.config)
            write_text_atomic(self.config / name, json.dumps(content, indent=1) + "\n")
