"""Units of length: what files call them, and which one a cloud of markers is in when nobody says."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import numpy as np

from markerscope.solver.core.errors import InputError

_METRES = {
    "m": 1.0, "meter": 1.0, "metre": 1.0,
    "dm": 0.1, "decimeter": 0.1, "decimetre": 0.1,
    "cm": 0.01, "centimeter": 0.01, "centimetre": 0.01,
    "mm": 0.001, "millimeter": 0.001, "millimetre": 0.001,
    "um": 1e-6, "µm": 1e-6, "micrometer": 1e-6, "micron": 1e-6,
    "in": 0.0254, "inch": 0.0254, "inche": 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip

_COMMON = ("m", "cm", "mm", "in", "ft")
_LEAST_M, _LEAST_BODY_M, _MOST_M = 0.05, 0.4, 6.0
"""A hand's few markers span more than the first, a whole body's more than the second, people together less than the
third."""
_PERSON_M = 1.3
_PARTS = tuple(
    re.compile(pattern, re.IGNORECASE)
    for pattern in (
        r"head|(^|[^a-z])[lr]?[fb]hd|hea?d([^a-z]|$)",
        r"(^|[^a-z])(c7|t10|clav|strn)|shoulder|[lr]_?sho|sternum|acrom",
        r"[lr]_?[ap]si|asis|psis|pelvis|sacr",
        r"[lr]_?kne|knee",
        r"[lr]_?(ank|toe|hee)|ankle|heel|calc|(^|[^a-z])toe",
    )
)


def metres_per_unit(name: str | None) -> float | None:
    """Metres in one unit of that name, None where the name is not a unit of length."""
    key = re.sub(r"[^a-zµ]", "", (name or "").strip().lower())
    return _METRES.get(key, _METRES.get(key.removesuffix("s")))


def settle_units(
    positions: np.ndarray, declared: str | None, wanted: str | None, source: str, labels: Sequence[str] = ()
) -> tuple[float, tuple[str, ...]]:
    """Metres per file unit, and what to tell the user about it.

    Parameters
    ----------
    positions : (T, M, 3) file units, NaN = lost
    declared : unit the file names, if any
    wanted : unit the user names, if any; wins
    source : path of the file, for messages
    labels : M names, which may tell a whole person from a hand
    """
    size = cloud_size(positions)
    if wanted is not None:
        factor = metres_per_unit(wanted)
        if factor is None:
            raise InputError(f"{wanted!r} is not a unit of length", "units", "say m, cm or mm")
        doubt = size_doubt(size, factor, f"the unit asked for ({wanted})", labels)
        declared_factor = metres_per_unit(declared)
        if declared_factor is None or declared_factor == factor:
            return factor, doubt
        return factor, (f"The file says its unit is {declared}; {wanted} was taken as asked.", *doubt)
    factor = metres_per_unit(declared)
    if factor is not None:
        return factor, size_doubt(size, factor, f"the declared unit ({declared})", labels)
    unit = _likely_unit(size)
    silent = "names no unit" if not (declared or "").strip() else f"names an unknown unit ({declared})"
    span = "" if size is None else f" since the markers span {size:.3g}"
    alone = "; a hand or a foot in mm would span as much" if unit == "cm" and size is not None and size > 50 else ""
    return _METRES[unit], (f"The file {silent}; {unit} was taken{span}{alone} (give the unit to override).",)


def size_doubt(size: float | None, factor: float, named: str, labels: Sequence[str]) -> tuple[str, ...]:
    """A sentence where markers so large are no person and no part of one, with the unit that would make them one.

    Parameters
    ----------
    size : of the cloud, file units
    factor : metres in one
    named : which unit that is, for the sentence
    labels : names; those of head, trunk and legs together are a whole body's, which is larger than a hand
    """
    if size is None or size <= 0:
        return ()
    least = _LEAST_BODY_M if _names_a_body(labels) else _LEAST_M
    if least <= size * factor <= _MOST_M:
        return ()
    likely = min(_COMMON, key=lambda unit: abs(math.log(size * _METRES[unit] / _PERSON_M)))
    strange = "which is no person" if not _LEAST_M <= size * factor <= _MOST_M else "little for a body with these names"
    what = f"In {named} the markers span {_length(size * factor)}, {strange}"
    if not least <= size * _METRES[likely] <= _MOST_M:
        return (f"{what}; check the unit.",)
    return (f"{what}; check the unit: in {likely} they would span {_length(size * _METRES[likely])}.",)


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if metres >= 1 else f"{1000 * metres:.3g} mm"


def _names_a_body(labels: Sequence[str]) -> bool:
    """Whether names of at least three of head, trunk, pelvis, knee and foot are there."""
    return sum(any(pattern.search(label) for label in labels) for pattern in _PARTS) >= 3


def cloud_size(positions: np.ndarray) -> float | None:
    """Diagonal of the box around one frame's markers, file units, median over frames; None without data."""
    frames = positions[:: max(1, len(positions) // 200)]
    frames = frames[np.isfinite(frames).all(axis=2).sum(axis=1) >= 2]
    if not len(frames):
        return None
    # A ghost far away must not say how large the person is.
    low, high = np.nanpercentile(frames, [5, 95], axis=1)
    return float(np.median(np.linalg.norm(high - low, axis=1)))


def _likely_unit(size: float | None) -> str:
    """Bodies and limbs are 0.1 to 3 m across: 10 to 300 cm, 100 to 3000 mm, of which mm is the common one."""
    if size is None:
        return "mm"
    if size < 5:
        return "m"
    return "cm" if size < 250 else "mm"
