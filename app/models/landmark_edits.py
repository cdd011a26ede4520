"""Decisions on bony landmarks: a marker pinned to one, kept from one, or left to the program again."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

from markerscope.app.models.edits import Edit, decide
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.pull.by_hand import Pair
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.settings import without


def pin(session: Session, marker: int, landmark: str, labels: Sequence[str]) -> Edit:
    """Say that a marker sits on a landmark; whichever marker was pinned there before is no more."""
    pinned, refused = pairs(session)
    pinned = [(m, name) for m, name in pinned if m != marker and name != landmark]
    refused = [(m, name) for m, name in refused if m != marker or name not in ("", landmark)]
    return _edit(session, [*pinned, (marker, landmark)], refused, f"{labels[marker]} pinned to {_said(landmark)}")


def refuse(session: Session, drawn: Collection[Pair], labels: Sequence[str]) -> Edit:
    """Say that markers do not sit on the landmarks that they were drawn to; "" is every landmark."""
    pinned, refused = pairs(session)
    new = [pair for pair in drawn if pair not in refused]
    if not new:
        raise InputError("the markers are kept from landmarks already", "refuse", "select others")
    pinned = [pair for pair in pinned if pair not in new and (pair[0], "") not in new]
    first, landmark = new[0]
    others = f" and {len(new) - 1} more" if len(new) > 1 else ""
    return _edit(session, pinned, [*refused, *new], f"{labels[first]} kept from {_said(landmark)}{others}")


def release(session: Session, markers: Collection[int], labels: Sequence[str]) -> Edit:
    """Take back what was decided of these markers and landmarks."""
    pinned, refused = pairs(session)
    touched = sorted({m for m, _ in (*pinned, *refused)} & set(markers))
    if not touched:
        raise InputError("nothing was decided of the markers' landmarks", "release", "select markers that are pinned")
    pinned, refused = ([pair for pair in values if pair[0] not in touched] for values in (pinned, refused))
    others = f" and {len(touched) - 1} more" if len(touched) > 1 else ""
    return _edit(session, pinned, refused, f"Landmark of {labels[touched[0]]}{others} left to the program")


def pairs(session: Session) -> tuple[list[Pair], list[Pair]]:
    """The pairs that are pinned, and those that are refused."""
    settings = session.stage_settings(graph_of(session))["fit"]
    return list(settings.pinned), list(settings.refused)


def can_pull(session: Session) -> bool:
    """Whether the session's method draws markers to landmarks."""
    return hasattr(session.stage_settings(graph_of(session))["fit"], "pinned")


def _edit(session: Session, pinned: Sequence[Pair], refused: Sequence[Pair], sentence: str) -> Edit:
    table = {"pinned": [[int(m), name] for m, name in pinned], "refused": [[int(m), name] for m, name in refused]}
    written = session.settings.get("fit", {})
    needless = {name for name, values in table.items() if not values and not written.get(name)}
    rest = without(session.edits.get("fit", {}), needless)
    edits = {stage: own for stage, own in {**session.edits, "fit": rest}.items() if own}
    said = {name: values for name, values in table.items() if name not in needless}
    after = replace(session, edits=edits)
    return Edit(sentence, decide(after, "fit", said) if said else after)


def _said(landmark: str) -> str:
    return landmark.replace("_", " ") if landmark else "every landmark"
