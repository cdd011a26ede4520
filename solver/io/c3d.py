"""C3D in: what its points, labels and parameters say about the markers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.solver.core.markers import UpAxis
from markerscope.solver.io.c3d_format import C3DContent, decode_c3d
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.text import read_bytes

_MODEL_OUTPUTS = ("ANGLES", "FORCES", "MOMENTS", "POWERS", "SCALARS", "MODELED_MARKERS")
_OWN_GROUPS = ("POINT", "ANALOG", "TRIAL", "FORCE_PLATFORM", "EVENT", "MANUFACTURER", "?")
_AXES: dict[str, UpAxis] = {"X": "x", "Y": "y", "Z": "z"}


def read_c3d(path: str | Path, data: bytes | None = None) -> RawMarkers:
    """Trajectories of a C3D file, model outputs marked as such."""
    content = decode_c3d(read_bytes(path) if data is None else data, path)
    count = content.xyz.shape[1]
    labels = content.text("POINT", "LABELS")[:count]
    labels += ("",) * (count - len(labels))
    positions = np.where(content.lost[..., None], np.nan, content.xyz)
    # Many programs write residual 0 throughout: only beside measured points does it say "filled".
    filled = content.computed if (~content.computed & ~content.lost).any() else None
    return RawMarkers(
        positions=positions,
        labels=labels,
        rate=content.rate,
        first_frame=content.first_frame - 1,
        units=next(iter(content.text("POINT", "UNITS")), None),
        up=_vertical(content),
        filled=filled,
        subjects=tuple(name for name in content.text("SUBJECTS", "NAMES") if name),
        virtual=_computed(content, labels),
        points=np.arange(count),
        notes=content.notes + besides(content),
    )


def besides(content: C3DContent) -> tuple[str, ...]:
    """What a file holds besides its points: only a C3D written from it carries that on."""
    section = content.section
    events = section.count("EVENT", "USED") or 0
    plates = section.count("FORCE_PLATFORM", "USED") or 0
    others = [key for key in section.values if key[0] not in _OWN_GROUPS]
    held = (
        (section.count("ANALOG", "USED") or 0, "analog channel"),
        (plates, "force plate"),
        (events, "event"),
        (len(others), "further parameter"),
    )
    said = [f"{number} {noun}{'' if number == 1 else 's'}" for number, noun in held if number]
    if not said:
        return ()
    listed = said[0] if len(said) == 1 else f"{', '.join(said[:-1])} and {said[-1]}"
    return (f"The C3D also holds {listed}: kept where a C3D is written from it, left out of every other format.",)


def _computed(content: C3DContent, labels: tuple[str, ...]) -> np.ndarray:
    """(M,) True for points that the file lists as results of a model, or describes as virtual markers."""
    groups = {*_MODEL_OUTPUTS, *content.text("POINT", "TYPE_GROUPS")} - {"LABELS", "DESCRIPTIONS", "UNITS"}
    listed = {name for group in groups for name in content.text("POINT", group)} - {""}
    described = content.text("POINT", "DESCRIPTIONS")[: len(labels)]
    described += ("",) * (len(labels) - len(described))
    return np.array([label in listed or text.startswith("V_") for label, text in zip(labels, described, strict=True)])


def _vertical(content: C3DContent) -> UpAxis | None:
    """Axis drawn along the height of the screen; its sign says nothing (Qualisys writes ``-Z`` where z is up)."""
    right, vertical, outward = (next(iter(content.text("POINT", f"{s}_SCREEN")), "").upper()[-1:] for s in "XYZ")
    if vertical in _AXES:
        return _AXES[vertical]
    rest = set(_AXES) - {right, outward}
    return _AXES[rest.pop()] if len(rest) == 1 else None
