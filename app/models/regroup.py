"""Groups of markers under another cut or other hand edits, at once: the tree they are cut from is known already."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from markerscope.app.models.results import Results
from markerscope.solver.clustering.segment import regroup
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.digest import canonical
from markerscope.solver.pipeline.names import SEGMENT
from markerscope.solver.pipeline.stage import Stage
from markerscope.solver.pipeline.store import Absent

_OF_THE_CUT = frozenset({"threshold", "groups", "merges", "splits", "moves", "left_out"})


def regrouped(graph: Sequence[Stage], keys: Mapping[str, str], settings: Mapping[str, Any], results: Results) -> bool:
    """Put the grouping that the settings ask for into the store if it takes no more than to cut a known tree anew.

    The result is what the stage itself would find. Returns whether it was put there.
    """
    stage = next((stage for stage in graph if stage.name == "segment"), None)
    if stage is None or results.has("segment", keys["segment"]):
        return False
    inputs = {name: keys[name] for name in stage.inputs if name in keys}
    wanted = settings["segment"]
    rest = _uncut(canonical(wanted))
    for entry in results.entries("segment"):
        about = entry.about
        if about.get("version") != stage.version or about.get("inputs") != inputs or _uncut(about["settings"]) != rest:
            continue
        try:
            found = regroup(results.get(SEGMENT, entry.key), wanted)
            new = {**about, "settings": canonical(wanted), "headline": stage.headline(found)}
            results.store.put("segment", keys["segment"], found, new)
        except (Absent, InputError):
            return False
        return True
    return False


def _uncut(table: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in table.items() if name not in _OF_THE_CUT}
