"""Analog channels of a C3D file, in the units it gives them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.io.c3d_format import C3DContent
from markerscope.solver.io.c3d_parameters import DEC, floats


@dataclass(frozen=True, eq=False)
class Analog:
    """Analog channels.

    Attributes
    ----------
    values : (S, C) in the file's units
    rate : Hz
    labels : C names
    """

    values: np.ndarray
    rate: float
    labels: tuple[str, ...]


def analog_of(data: bytes, content: C3DContent) -> Analog | None:
    """The channels of a decoded file; None where it has none.

    A value is (count - OFFSET) times SCALE times GEN_SCALE; counts are signed unless ANALOG:FORMAT says otherwise.
    """
    layout, section = content.layout, content.section
    channels = section.count("ANALOG", "USED") or 0
    if not channels or not layout.analog or layout.analog % channels or content.rate is None:
        return None
    samples = layout.analog // channels
    size = 4 if layout.floating else 2
    rows = np.frombuffer(data, np.uint8, layout.frames * layout.stride, layout.begin).reshape(layout.frames, -1)
    raw = np.ascontiguousarray(rows[:, 4 * layout.count * size :]).tobytes()
    if layout.floating:
        counts = floats(raw, section.order, section.processor == DEC)
    else:
        unsigned = any(text.upper() == "UNSIGNED" for text in section.text("ANALOG", "FORMAT"))
        counts = np.frombuffer(raw, section.order + ("u2" if unsigned else "i2")).astype(float)
    counts = counts.reshape(layout.frames * samples, channels)
    general = section.number("ANALOG", "GEN_SCALE")
    scale = _of_all(section.numbers("ANALOG", "SCALE"), channels, 1.0)
    offset = _of_all(section.numbers("ANALOG", "OFFSET"), channels, 0.0)
    values = (counts - offset) * scale * (1.0 if general is None else general)
    labels = section.text("ANALOG", "LABELS")[:channels]
    return Analog(values, content.rate * samples, labels + ("",) * (channels - len(labels)))


def _of_all(given: np.ndarray, count: int, usual: float) -> np.ndarray:
    out = np.full(count, usual)
    out[: min(count, len(given))] = given[:count]
    return out
