"""What an earlier result was computed with: its settings and those of all that it stands on, read from the store."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from markerscope.app.models.edits import Edit, differences, restore
from markerscope.app.models.fields import setting_of, settings_of, title
from markerscope.app.models.results import Results
from markerscope.solver.core.errors import InputError
from markerscope.solver.pipeline.methods import GRAPHS
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.settings import UNSET, from_table
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import Stage, stage_keys

_MOST_SAID = 3


@dataclass(frozen=True)
class Lineage:
    """How a result came about.

    Attributes
    ----------
    tables : settings as they were stored, by stage, of the result's stage and all before it
    keys : of these stages
    files : digest of each source that was read
    whole : whether all of it is still known
    """

    tables: Mapping[str, Mapping[str, Any]]
    keys: Mapping[str, str]
    files: Mapping[str, str]
    whole: bool


def lineage_of(results: Results, stage: str, key: str) -> Lineage:
    """How a result came about, as far as the store knows."""
    tables: dict[str, Mapping[str, Any]] = {}
    keys: dict[str, str] = {}
    files: dict[str, str] = {}
    whole = True
    frontier = [(stage, key)]
    while frontier:
        name, own = frontier.pop()
        if name in keys:
            continue
        keys[name] = own
        entry = results.entry(name, own)
        if entry is None:
            whole = False
            continue
        tables[name] = entry.about.get("settings", {})
        for source, digest in entry.about.get("inputs", {}).items():
            if source.endswith("_file"):
                files[source] = digest
            else:
                frontier.append((source, digest))
    return Lineage(tables, keys, files, whole)


def go_back(session: Session, sources: Mapping[str, Source], results: Results, stage: str, key: str) -> Edit:
    """The edit that makes an earlier result of a stage the one in force.

    Raises
    ------
    InputError : it was computed from other files, or by settings that this version does not have
    """
    past = lineage_of(results, stage, key)
    where = f"the earlier result of {title(stage)}"
    if not past.whole:
        raise InputError("what it was computed from is not there any more", where, "set its settings by hand")
    for method, graph in GRAPHS.items():
        settings = _settings(graph, past)
        if settings is not None and stage_keys(graph, sources, settings).get(stage) == key:
            sentence = f"{title(stage)}: back to an earlier result"
            wanted = {name: settings[name] for name in past.tables}
            return restore(session, wanted, method, sentence)
    raise InputError("it was computed from other files than the session has now", where, "open those files again")


def _settings(graph: Sequence[Stage], past: Lineage) -> dict[str, Any] | None:
    """The settings dataclasses of a method's graph that a result was computed with; None if it has no such stages."""
    own = {stage.name: stage for stage in graph}
    try:
        return {name: from_table(own[name].settings, _unset(table)) for name, table in past.tables.items()}
    except (KeyError, InputError):
        return None


def _unset(table: Mapping[str, Any]) -> dict[str, Any]:
    """Stored settings as a session file has them: what is None stands in a list."""
    return {**{k: v for k, v in table.items() if v is not None}, UNSET: [k for k, v in table.items() if v is None]}


def said_difference(
    past: Lineage, graph: Sequence[Stage], stage: str, settings: Mapping[str, Any], sources: Mapping[str, Source]
) -> str:
    """What an earlier result was computed with that is not in force now, in words."""
    if any(name in sources and sources[name].digest != digest for name, digest in past.files.items()):
        return "other files"
    if any(name not in {own.name for own in graph} for name in past.tables):
        return "another method"
    parts: list[str] = []
    for name in sorted(past.tables, key=lambda name: name != stage):
        cls = next(own.settings for own in graph if own.name == name)
        try:
            before = from_table(cls, _unset(past.tables[name]))
        except InputError:
            return "another method"
        for field in differences(settings[name], before):
            parts.append(
                _said(name, before, field) if name == stage else f"{title(name)}: {_said(name, before, field)}"
            )
    more = len(parts) - _MOST_SAID
    return ", ".join([*parts[:_MOST_SAID], *([f"and {more} more"] if more > 0 else [])])


def _said(stage: str, settings: Any, name: str) -> str:
    if name in {setting.name for setting in settings_of(stage, settings)}:
        setting = setting_of(stage, settings, name)
        return f"{setting.label} {setting.said(setting.value)}"
    value = getattr(settings, name)
    return f"{len(value)} {name.replace('_', ' ')}" if isinstance(value, tuple) else f"{name.replace('_', ' ')} {value}"
