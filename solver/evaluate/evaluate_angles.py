"""Joint angles against those of an OpenSim table, by the names that both have. A table needs no body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.core import metrics
from markerscope.solver.core.errors import InputError
from markerscope.solver.evaluate.evaluate import angle_lines, angles_in_degrees
from markerscope.solver.evaluate.posed import angles_of, imported_result
from markerscope.solver.io.mot import read_mot
from markerscope.solver.io.motion_in import read_motion

_TABLES = (".mot", ".sto")
_KNEES = ("knee_angle_r", "knee_angle_l")
_SURE_DEG = 5.0
"""A knee bends one way: a mean beyond this tells which way a table counts."""


@dataclass(frozen=True, eq=False)
class AngleTable:
    """Angles over time.

    Attributes
    ----------
    time : (T,) s
    radians : (T,) by name, in the sense of OpenSim's Rajagopal model
    source : path of the file or folder
    has_clock : whether its times are of a clock that others share
    notes : what was assumed, one sentence each
    """

    time: np.ndarray
    radians: Mapping[str, np.ndarray]
    source: str
    has_clock: bool = True
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class AngleEvaluation:
    """Angles of a result against a reference's.

    Attributes
    ----------
    time : (T,) s, the result's frames that were compared
    angles : by name, rad
    notes : what was assumed, one sentence each
    """

    time: np.ndarray
    angles: Mapping[str, metrics.AngleDifference]
    notes: tuple[str, ...] = ()

    def summary(self) -> dict[str, object]:
        """Plain values for machines, degrees."""
        return {"frames": len(self.time), "angles_deg": angles_in_degrees(self.angles)}

    def lines(self) -> tuple[str, ...]:
        """The same for a person."""
        span = f"{self.time[0]:.2f} to {self.time[-1]:.2f} s"
        first = f"{len(self.time)} frames and {len(self.angles)} angles compared, {span}."
        return (first, *angle_lines(self.angles))


def is_angle_table(path: str | Path) -> bool:
    """Whether a path names an OpenSim table (MOT, STO)."""
    return Path(path).suffix.lower() in _TABLES and not Path(path).is_dir()


def evaluate_angles(result: str | Path, reference: str | Path, *, body: str | Path | None = None) -> AngleEvaluation:
    """Compare the angles of a result with a reference's, either of which may be an OpenSim table.

    Parameters
    ----------
    body : the SMPL model file that the one that is no table was made with, where it is not a result

    Raises
    ------
    InputError
        Where either cannot be read, they do not overlap in time, or have no angle in common.
    """
    ours, theirs = angle_table(result, body), angle_table(reference, body)
    notes = (*ours.notes, *theirs.notes)
    for table, beside in ((ours, theirs), (theirs, ours)):
        if not table.has_clock and beside.has_clock:
            start = float(beside.time[0])
            name, other = Path(table.source).name, Path(beside.source).name
            notes = (*notes, f"{name} has no times of its own and is taken to start with {other}, at {start:.2f} s.")
            moved = replace(table, time=start + table.time - table.time[0])
            ours, theirs = (moved, theirs) if table is ours else (ours, moved)
            break
    names = [name for name in ours.radians if name in theirs.radians]
    if not names:
        some = ", ".join(list(theirs.radians)[:4]) or "none"
        raise InputError(
            f"its angles ({some}) have no name in common with the result's",
            reference,
            "use the names of OpenSim's Rajagopal model, such as knee_angle_r",
        )
    inside = (ours.time >= theirs.time[0] - 1e-9) & (ours.time <= theirs.time[-1] + 1e-9)
    if inside.sum() < 2:
        a, b, c, d = (f"{t:.2f}" for t in (ours.time[0], ours.time[-1], theirs.time[0], theirs.time[-1]))
        raise InputError(
            f"it covers {c} to {d} s and the result {a} to {b} s, so they do not overlap",
            reference,
            "compare recordings of the same trial on one clock",
        )
    time = ours.time[inside]
    differences = {
        name: metrics.angle_difference(ours.radians[name][inside], _at(theirs, name, time)) for name in names
    }
    return AngleEvaluation(time, differences, notes)


def angle_table(path: str | Path, body: str | Path | None = None) -> AngleTable:
    """The angles of an OpenSim table, or those of a motion on its body."""
    if not is_angle_table(path):
        motion, assumed = imported_result(path, body=body)
        has_clock = read_motion(path).time is not None
        return AngleTable(motion.time, angles_of(motion), str(path), has_clock, assumed)
    stored = read_mot(path)
    if not (np.diff(stored.time) > 0).all():
        raise InputError("its times do not ascend", path, "export it again")
    angles = {
        name: np.radians(values)
        for name, values in stored.in_degrees().items()
        if not name.endswith(("_tx", "_ty", "_tz"))
    }
    notes: tuple[str, ...] = ()
    if stored.degrees is None:
        notes = (f"{Path(path).name} does not say its unit; degrees are assumed.",)
    bent = [float(np.degrees(np.nanmean(angles[name]))) for name in _KNEES if np.isfinite(angles.get(name, [])).any()]
    if bent and min(bent, key=lambda mean: -abs(mean)) < -_SURE_DEG:
        angles |= {name: -angles[name] for name in _KNEES if name in angles}
        notes = (*notes, f"{Path(path).name} counts knee flexion as negative (gait2392); its sign was turned.")
    return AngleTable(stored.time, angles, str(path), notes=notes)


def _at(table: AngleTable, name: str, time: np.ndarray) -> np.ndarray:
    """(W,) rad at other times, linear between frames; a step of more than half a turn is a wrap.

    A step of more than a quarter that remains is a change of the reading: there the nearest frame counts.
    """
    values = table.radians[name]
    known = np.isfinite(values)
    unwrapped = values.copy()
    unwrapped[known] = np.unwrap(values[known])
    between = metrics.points_at(table.time, unwrapped, time)
    after = np.clip(np.searchsorted(table.time, time), 1, len(table.time) - 1)
    first, last = unwrapped[after - 1], unwrapped[after]
    nearest = np.where(time - table.time[after - 1] < table.time[after] - time, first, last)
    return np.where(np.isfinite(between) & (np.abs(last - first) > np.pi / 2), nearest, between)
