"""How a window's models stand, as plain values for a file, and the way back."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markerscope.app.models.workbench import Workbench


def view_of(bench: Workbench) -> dict[str, Any]:
    """What :func:`restore_view` takes."""
    return {
        "time": bench.clock.time,
        "speed": bench.clock.speed,
        "loop": bench.clock.loop,
        "selection": bench.selection.state(),
        "display": bench.display.state(),
        "compared": sorted([ref.stage, ref.key] for ref in bench.board.compared),
    }


def restore_view(bench: Workbench, view: Mapping[str, Any]) -> None:
    """Have the models as they were left; what is no such value is left out. The recording's length must be known."""
    loop, speed, at = view.get("loop"), view.get("speed"), view.get("time")
    if isinstance(speed, int | float):
        bench.clock.set_speed(speed)
    if isinstance(loop, list | tuple) and len(loop) == 2 and all(isinstance(end, int | float) for end in loop):
        bench.clock.set_loop((float(loop[0]), float(loop[1])))
    if isinstance(at, int | float):
        bench.clock.seek(float(at))
    for name, model in (("selection", bench.selection), ("display", bench.display)):
        state = view.get(name)
        if isinstance(state, Mapping):
            model.restore(state)
    compared = view.get("compared")
    for row in compared if isinstance(compared, list) else ():
        if isinstance(row, list) and len(row) == 2 and all(isinstance(part, str) for part in row):
            bench.board.compare(row[0], row[1], True)
