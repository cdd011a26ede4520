"""Ground reaction forces: of the force plates of a C3D file (types 1 to 4), or of an OpenSim storage file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers, lab_rotation
from markerscope.solver.io.c3d_analog import Analog, analog_of
from markerscope.solver.io.c3d_format import C3DContent, decode_c3d
from markerscope.solver.io.mot import read_mot
from markerscope.solver.io.text import read_bytes
from markerscope.solver.io.units import metres_per_unit

_CHANNELS = {1: 6, 2: 6, 3: 8, 4: 6}
_LOADED_N = 20.0


@dataclass(frozen=True, eq=False)
class ForcePlate:
    """One force plate over time, in the internal lab frame (m, N, z up).

    Attributes
    ----------
    name : as people call it
    time : (S,) s, the marker file's clock
    force : (S, 3) N, of the ground on the person
    centre : (S, 3) m, centre of pressure; NaN where less than 20 N press
    corners : (4, 3) m, None where they are not known
    """

    name: str
    time: np.ndarray
    force: np.ndarray
    centre: np.ndarray
    corners: np.ndarray | None


@np.errstate(all="ignore")
def plates_of_c3d(path: str | Path, markers: Markers) -> tuple[tuple[ForcePlate, ...], tuple[str, ...]]:
    """Force plates of a C3D file, and what of them could not be read, one sentence each.

    Parameters
    ----------
    markers : read from that file: its axes and clock

    Raises
    ------
    InputError : the file cannot be read
    """
    data = read_bytes(path)
    content = decode_c3d(data, path)
    analog, used = analog_of(data, content), content.section.count("FORCE_PLATFORM", "USED") or 0
    if analog is None or not used:
        return (), ()
    found, notes = [], []
    for k in range(used):
        made = _plate(content, analog, k, markers)
        if isinstance(made, str):
            notes.append(f"Force plate {k + 1} was left aside: {made}.")
        else:
            found.append(made)
    return tuple(found), tuple(notes)


def _plate(content: C3DContent, analog: Analog, k: int, markers: Markers) -> ForcePlate | str:
    section = content.section
    used = section.count("FORCE_PLATFORM", "USED") or 0
    kind = int(_nth(section.numbers("FORCE_PLATFORM", "TYPE"), k, 0))
    if kind not in _CHANNELS:
        return f"its type is {kind}, and only types 1 to 4 are read"
    channels = section.numbers("FORCE_PLATFORM", "CHANNEL").reshape(used, -1)[k][: _CHANNELS[kind]].astype(int) - 1
    if len(channels) < _CHANNELS[kind] or channels.min() < 0 or channels.max() >= analog.values.shape[1]:
        return "it names analog channels that are not there"
    corners = section.numbers("FORCE_PLATFORM", "CORNERS")
    if corners.size != 12 * used:
        return "it has no corners"
    unit = metres_per_unit(next(iter(content.text("POINT", "UNITS")), "mm")) or 0.001
    corners = corners.reshape(used, 4, 3)[k] * unit
    raw = _zeroed(analog.values[:, channels], section.numbers("FORCE_PLATFORM", "ZERO"), content, analog)
    if kind == 4:
        matrix = section.numbers("FORCE_PLATFORM", "CAL_MATRIX")
        if matrix.size != 36 * used:
            return "it is of type 4 and has no CAL_MATRIX for each plate"
        raw = raw @ matrix.reshape(used, 6, 6)[k]  # stored column by column
    moment_unit = _moment_unit(content, channels, kind)
    origin = section.numbers("FORCE_PLATFORM", "ORIGIN")
    origin = origin.reshape(used, 3)[k] * unit if origin.size == 3 * used else np.zeros(3)
    force, pressed = _pressed(kind, raw, origin, unit, moment_unit)
    axes = _axes(corners)
    loaded = np.abs(force[:, 2]) > _LOADED_N
    # The file gives what the person does to the plate, whose z points down.
    reaction = -force @ axes.T
    place = corners.mean(axis=0) + pressed @ axes.T
    R = markers.R_lab_internal
    centre = np.where(loaded[:, None], place @ R, np.nan)
    first = (content.first_frame - 1) / (content.rate or markers.rate)
    time = first + np.arange(len(raw)) / analog.rate
    reaction = reaction @ R
    if np.median(reaction[loaded, 2]) < 0 if loaded.any() else False:
        reaction = -reaction
    return ForcePlate(f"plate {k + 1}", time, reaction, centre, corners @ R)


def _pressed(
    kind: int, raw: np.ndarray, origin: np.ndarray, length: float, moment: float
) -> tuple[np.ndarray, np.ndarray]:
    """Force (S, 3) N on the plate and where it presses (S, 3) m, in the plate's axes from the middle of its surface."""
    depth = -abs(origin[2])
    if kind == 1:
        return raw[:, :3], np.column_stack([raw[:, 3] * length, raw[:, 4] * length, np.zeros(len(raw))])
    if kind == 3:  # Kistler: four corners, whose distances from the middle stand in ORIGIN
        a, b = abs(origin[0]), abs(origin[1])
        fx12, fx34, fy14, fy23, z1, z2, z3, z4 = raw.T
        force = np.column_stack([fx12 + fx34, fy14 + fy23, z1 + z2 + z3 + z4])
        mx = b * (z1 + z2 - z3 - z4)
        my = a * (-z1 + z2 + z3 - z4)
        shift = np.zeros(2)
    else:
        force, mx, my = raw[:, :3], raw[:, 3] * moment, raw[:, 4] * moment
        shift = origin[:2]
    x = (depth * force[:, 0] - my) / force[:, 2] - shift[0]
    y = (mx + depth * force[:, 1]) / force[:, 2] - shift[1]
    return force, np.column_stack([x, y, np.zeros(len(raw))])


def _axes(corners: np.ndarray) -> np.ndarray:
    """(3, 3) the plate's axes in the file's lab: x from corners 2, 3 to 1, 4; y from 3, 4 to 1, 2."""
    x = corners[0] + corners[3] - corners[1] - corners[2]
    y = corners[0] + corners[1] - corners[2] - corners[3]
    x, y = x / np.linalg.norm(x), y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)], axis=1)


def _zeroed(values: np.ndarray, zero: np.ndarray, content: C3DContent, analog: Analog) -> np.ndarray:
    """Less the mean over the frames that FORCE_PLATFORM:ZERO names; 1 to 0, or 0, names none."""
    if zero.size < 2 or not 0 < zero[0] < zero[1]:
        return values
    samples = round(analog.rate / (content.rate or analog.rate))
    first = int(zero[0]) - content.first_frame
    last = int(zero[1]) - content.first_frame + 1
    if first < 0 or last * samples > len(values):
        first, last = int(zero[0]) - 1, int(zero[1])  # some count from the file's own start
    piece = values[max(0, first) * samples : last * samples]
    return values - piece.mean(axis=0) if len(piece) else values


def _moment_unit(content: C3DContent, channels: np.ndarray, kind: int) -> float:
    """N m in one unit of the moments: as the channels say, else as the points' unit of length does."""
    units = content.text("ANALOG", "UNITS")
    said = units[channels[3]] if kind in (2, 4) and len(units) > channels[3] else ""
    length = re.sub(r"[^a-z]", "", said.lower()).removeprefix("n")
    given = metres_per_unit(length) if length else None
    return given or metres_per_unit(next(iter(content.text("POINT", "UNITS")), "mm")) or 0.001


def _nth(values: np.ndarray, k: int, usual: float) -> float:
    return float(values[k]) if k < len(values) else usual


def plates_of_mot(path: str | Path) -> tuple[ForcePlate, ...]:
    """Ground reaction forces of an OpenSim storage file: columns ``..._vx`` to ``_vz`` and ``_px`` to ``_pz``, y up.

    Raises
    ------
    InputError : the file cannot be read, or holds no such columns
    """
    table = read_mot(path)
    names = [name.removesuffix("vx") for name in table.columns if name.endswith("vx")]
    whole = [name for name in names if all(f"{name}{part}{axis}" in table.columns for part in "vp" for axis in "xyz")]
    if not whole:
        what = "holds no ground reaction forces (columns ending in vx, vy, vz and px, py, pz)"
        raise InputError(what, path, "give the file that OpenSim's external loads are read from")
    found = []
    for name in whole:
        force, place = (
            np.stack([table.columns[f"{name}{part}{axis}"] for axis in "xyz"], axis=1) @ lab_rotation("y")
            for part in "vp"
        )
        loaded = force[:, 2] > _LOADED_N
        if not loaded.any():
            continue
        found.append(ForcePlate(name.strip("_"), table.time, force, np.where(loaded[:, None], place, np.nan), None))
    return tuple(found)
