"""Which results a saved session had, so that they can be drawn as out of date once its settings have changed.

A store holds the results of many settings; after a setting has changed none of them says by itself whether it was the
answer that was looked at. ``in_force.json`` in the session's folder says it: the key of a result by stage.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markerscope.solver.io.atomic import write_text_atomic

IN_FORCE = "in_force.json"
_KEY = re.compile(r"[0-9a-z]+")


def read_answers(folder: Path) -> dict[str, str]:
    """The results, key by stage, that were last in force when the session was saved; empty where that is not known."""
    try:
        return answers_from(json.loads((folder / IN_FORCE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


def write_answers(folder: Path, answers: Mapping[str, str]) -> None:
    """Say which results, key by stage, are in force now; of stages that are not among them it says what it said.

    Raises
    ------
    InputError : the file system refuses
    """
    known = read_answers(folder)
    said = {**known, **answers}
    if said != known:
        write_text_atomic(folder / IN_FORCE, json.dumps(said, indent=1) + "\n")


def answers_from(content: Any) -> dict[str, str]:
    """Keys by stage, as far as they can be understood."""
    rows = content.items() if isinstance(content, dict) else ()
    return {stage: key for stage, key in rows if isinstance(key, str) and _KEY.fullmatch(key)}
