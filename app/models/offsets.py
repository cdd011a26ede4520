"""The offset of the video that was found, apart from the one that was given."""

from __future__ import annotations

from markerscope.app.models.stages import StageBoard
from markerscope.solver.sync.offset import Sync


def found_sync(board: StageBoard) -> Sync | None:
    """The result that looked for the offset by itself and was in force last, None where there is none."""
    for key in dict.fromkeys((board.keys.get("sync", ""), *board.document.history.in_force_before("sync"))):
        if board.results.has("sync", key):
            value: Sync = board.results.get("sync", key)
            if value.method != "given":
                return value
    return None
