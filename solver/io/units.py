"""Units of length: what files call them, and which one a cloud of markers is in when nobody says."""

from __future__ import annotations

import re

import numpy as np

from solver.errors import InputError

_METRES = {
    "m": 1.0, "meter": 1.0, "metre": 1.0,
    "dm": 0.1, "decimeter": 0.1, "decimetre": 0.1,
    "cm": 0.01, "centimeter": 0.01, "centimetre": 0.01,
    "mm": 0.001, "millimeter": 0.001, "millimetre": 0.001,
    "um": 1e-6, "µm": 1e-6, "micrometer": 1e-6, "micron": 1e-6,
    "in": 0.0254, "inch": 0.0254, "inche": 0.0254, "ft": 0.3048, "foot": 0.3048, "feet": 0.3048,
}  # fmt: skip


def metres_per_unit(name: str | None) -> float | None:
    """Metres in one unit of that name, None where the name is not a unit of length."""
    key = re.sub(r"[^a-zµ]", "", (name or "").strip().lower())
    return _METRES.get(key, _METRES.get(key.removesuffix("s")))


def settle_units(
    positions: np.ndarray, declared: str | None, wanted: str | None, source: str
) -> tuple[float, tuple[str, ...]]:
    """Metres per file unit, and what to tell the user about it.

    Parameters
    ----------
    positions : (T, M, 3) file units, NaN = lost
    declared : unit the file names, if any
    wanted : unit the user names, if any; wins
    source : path of the file, for messages
    """
    if wanted is not None:
        factor = metres_per_unit(wanted)
        if factor is None:
            raise InputError(f"{wanted!r} is not a unit of length", "units", "say m, cm or mm")
        declared_factor = metres_per_unit(declared)
        if declared_factor is None or declared_factor == factor:
            return factor, ()
        return factor, (f"The file says its unit is {declared}; {wanted} was taken as asked.",)
    size = cloud_size(positions)
    factor = metres_per_unit(declared)
    if factor is not None:
        if size is not None and not 0.01 <= size * factor <= 30:
            return factor, (
                f"In the declared unit ({declared}) the markers span {size * factor:.3g} m; check the unit.",
            )
        return factor, ()
    unit = _likely_unit(size)
    silent = "names no unit" if not (declared or "").strip() else f"names an unknown unit ({declared})"
    span = "" if size is None else f" since the markers span {size:.3g}"
    return _METRES[unit], (f"The file {silent}; {unit} was taken{span} (give the unit to override).",)


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
