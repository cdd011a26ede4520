"""Decisions on bony landmarks: which marker sits on which."""

from __future__ import annotations

import numpy as np

from markerscope.app.actions.action import Action, Asks, first, needs
from markerscope.app.models import landmark_edits
from markerscope.app.models.workbench import Workbench
from markerscope.solver.body.bony import bony_sites
from markerscope.solver.body.model import Body

_fitted = needs("fit", "there is no fit")
_read = needs("markers", "the markers have not been read")


def _can_pull(bench: Workbench) -> str:
    return "" if landmark_edits.can_pull(bench.document.session) else "this method draws no markers to landmarks"


def _one(bench: Workbench) -> str:
    return "" if len(bench.selection.markers) == 1 else "not exactly one marker is selected"


def _some(bench: Workbench) -> str:
    return "" if bench.selection.markers else "no marker is selected"


def _decided(bench: Workbench) -> str:
    pinned, refused = landmark_edits.pairs(bench.document.session)
    known = {m for m, _ in (*pinned, *refused)} & set(bench.selection.markers)
    return "" if known else "nothing was decided of the landmarks of the selected markers"


def _pin(bench: Workbench, asks: Asks) -> None:
    (marker,) = bench.selection.markers
    body = bench.document.session.inputs.get("body_file")
    sites = bony_sites(Body.load(None if body is None else body.path))
    labels, fitted = bench.labels, not _fitted(bench)
    # The landmarks of the marker's own bone first, where that is known: it is nearly always one of them.
    bone = bench.board.current["fit"].marker_joint[marker] if fitted else -1
    names = [sites.names[i] for i in np.argsort(sites.bone != bone, kind="stable")]
    place = asks.choice(f"{labels[marker]} sits on", [name.replace("_", " ") for name in names])
    if place is not None:
        bench.document.apply(landmark_edits.pin(bench.document.session, marker, names[place], labels))


def _refuse(bench: Workbench, asks: Asks) -> None:
    pull, labels = bench.board.current["fit"].pull, bench.labels
    drawn = [(m, "" if pull is None else pull.landmark[m]) for m in sorted(bench.selection.markers)]
    bench.document.apply(landmark_edits.refuse(bench.document.session, drawn, labels))


def _release(bench: Workbench, asks: Asks) -> None:
    labels = bench.labels
    bench.document.apply(landmark_edits.release(bench.document.session, bench.selection.markers, labels))


LANDMARK_ACTIONS = (
    Action(
        "landmark.pin",
        "Pin to landmark...",
        "Edit",
        "Say which bony landmark the selected marker sits on; the fit then draws it there.",
        _pin,
        why_not=first(_read, _can_pull, _one),
    ),
    Action(
        "landmark.refuse",
        "Not on that landmark",
        "Edit",
        "Keep the selected markers from the bony landmarks that they were drawn to, or from all where they were drawn "
        "to none.",
        _refuse,
        why_not=first(_fitted, _can_pull, _some),
    ),
    Action(
        "landmark.release",
        "Landmark as found",
        "Edit",
        "Take back what was decided of the landmarks of the selected markers.",
        _release,
        why_not=first(_read, _can_pull, _some, _decided),
    ),
)
