"""Marker colours, each with the legend that explains it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.app.views.tracks import FILLED, LOST, MEASURED, OUTLIER, STATE_NAMES
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.widgets import palette
from markerscope.widgets.colour_bar import ColourBar

ColourBy = Literal["cluster", "bone", "residual", "gaps", "selection", "skin"]
RGB = tuple[int, int, int]

_STATE_COLOURS = np.array([palette.GOOD, palette.DOUBTFUL, palette.OUTLIER, palette.GAP], dtype=np.uint8)
RESIDUAL_LIMIT_M = 0.03
"""Residuals from here on have the last colour: what is further off is not explained."""


@dataclass(frozen=True)
class Legend:
    """What colours mean: a title with either entries (text, colour) or a colour bar."""

    title: str
    entries: tuple[tuple[str, RGB], ...] | ColourBar


@dataclass(frozen=True, eq=False)
class Coloured:
    """A colour (M, 3) uint8 for each marker, and its legend."""

    colours: np.ndarray
    legend: Legend


def by_cluster(clusters: np.ndarray) -> Coloured:
    """By the group of markers that move together; -1 is none.

    Groups are counted from 1 on screen.
    """
    count = int(clusters.max(initial=-1)) + 1
    names = tuple(f"Group {i + 1}" for i in range(count))
    return _by_kind(clusters, palette.categorical(count), names, "Group of markers", "no group")


def by_bone(marker_joint: np.ndarray) -> Coloured:
    """By the bone that each marker was given to, -1 for none; a bone has the same colour in every answer."""
    names = tuple(bone_name(j) for j in range(len(JOINTS)))
    return _by_kind(marker_joint, palette.categorical(len(JOINTS)), names, "Bone", "no bone")


def by_residual(residual: np.ndarray, limit: float = RESIDUAL_LIMIT_M) -> Coloured:
    """By the distance (M,) m of each marker from where the body puts it; grey where there is none."""
    colours = palette.sequential(1000 * residual, 0.0, 1000 * limit)
    return Coloured(colours, Legend("Residual", ColourBar(0.0, 1000 * limit, "mm")))


def by_state(state: np.ndarray) -> Coloured:
    """By what there is of each marker (M,) in this frame: see ``tracks``."""
    entries = tuple(
        (f"{STATE_NAMES[kind]} ({number})", rgb(_STATE_COLOURS[kind]))
        for kind in (MEASURED, FILLED, OUTLIER, LOST)
        if (number := int((state == kind).sum())) or kind == MEASURED
    )
    return Coloured(_STATE_COLOURS[state], Legend("Gap state", entries))


def by_selection(count: int, selected: Collection[int]) -> Coloured:
    """The selected markers stand out from all others."""
    colours = np.tile(np.array(palette.LOST, dtype=np.uint8), (count, 1))
    inside = [m for m in selected if 0 <= m < count]
    colours[inside] = palette.SELECTED
    entries = ((f"selected ({len(inside)})", palette.SELECTED), (f"others ({count - len(inside)})", palette.LOST))
    return Coloured(colours, Legend("Selection", entries))


def bone_name(joint: int) -> str:
    """What people call the bone that turns about a joint: "left thigh"; "" for none."""
    return "" if joint < 0 else BONES[JOINTS[joint]].replace("_", " ")


def _by_kind(kind: np.ndarray, colours: np.ndarray, names: tuple[str, ...], title: str, none: str) -> Coloured:
    """Colours of kinds (M,), -1 for none, with those that occur in the legend."""
    table = np.concatenate([colours, np.array([palette.LOST], dtype=np.uint8)])
    number = np.bincount(np.where(kind < 0, len(names), kind), minlength=len(names) + 1)
    entries = tuple((f"{name} ({number[i]})", rgb(table[i])) for i, name in enumerate((*names, none)) if number[i])
    return Coloured(table[kind], Legend(title, entries))


def rgb(colour: np.ndarray) -> RGB:
    """A colour (3,) as plain numbers."""
    return (int(colour[0]), int(colour[1]), int(colour[2]))
