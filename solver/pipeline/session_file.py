"""Whether a session file was edited by somebody else: what was decided there must not be overwritten unseen."""

from __future__ import annotations

import hashlib
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.digest import digest_of

FILE_NAME = "session.toml"
_SEAL = "# As Markerscope wrote it, but for the edits: "


class EditedOutside(InputError):
    """The session file has changed since it was read."""


def sealed(text: str) -> str:
    """A session file's text with a last line that tells whether its inputs and settings are changed by hand later."""
    return f"{text}\n{_SEAL}{_digest(tomllib.loads(text))}\n"


def edited_by_hand(folder: Path) -> bool:
    """Whether inputs or settings in a folder's session file are others than the program wrote; edits are meant to be.

    A file without the last line (of an older version, or damaged) tells nothing.
    """
    try:
        text = (folder / FILE_NAME).read_text(encoding="utf-8")
        seal = re.search(f"^{re.escape(_SEAL)}([0-9a-f]+)$", text, re.MULTILINE)
        return seal is not None and seal[1] != _digest(tomllib.loads(text))
    except (OSError, ValueError):
        return False


def state_of(folder: Path) -> str:
    """SHA-256 of a folder's session file, empty where there is none."""
    try:
        return hashlib.sha256((folder / FILE_NAME).read_bytes()).hexdigest()
    except OSError:
        return ""


def require_state(folder: Path, state: str, remedy: str) -> None:
    """Make sure that writing the session file overwrites nothing but what was read.

    Parameters
    ----------
    state : of the file when it was read or written last; one that has gone since can be written again

    Raises
    ------
    EditedOutside : the file is another now
    """
    if state_of(folder) not in ("", state):
        raise EditedOutside("was edited since it was read, and is not overwritten", folder / FILE_NAME, remedy)


def _digest(content: Mapping[str, Any]) -> str:
    return digest_of({name: content.get(name, {}) for name in ("run", "inputs", "settings")})
