"""What is cut into cycles: named curves over time, each of one side or of none, and their cycles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from markerscope.solver.cycles.cycle import POINTS, Cycle, cut


@dataclass(frozen=True, eq=False)
class Curve:
    """A quantity over time.

    Attributes
    ----------
    name : without its side: ``knee_angle``
    side : left, right, or "" where it belongs to both: it is cut into the cycles of either foot
    unit : "degrees", "degrees/s", "m"
    time : (T,) s
    values : (T,), NaN = not known
    column : what the column of the result is called
    positive : what a positive value means
    """

    name: str
    side: str
    unit: str
    time: np.ndarray
    values: np.ndarray
    column: str = ""
    positive: str = ""

    @property
    def velocity(self) -> Curve:
        """Its rate of change, by central differences."""
        change = np.gradient(self.values, self.time) if len(self.time) > 2 else np.full_like(self.values, np.nan)
        return Curve(f"{self.name}_velocity", self.side, f"{self.unit}/s", self.time, change, f"{self.column}_velocity")


@dataclass(frozen=True, eq=False)
class CutCurve:
    """One quantity of one side over all cycles used.

    Attributes
    ----------
    name, side, unit, positive : as the curve's; the side is the foot's whose cycles they are
    values : (N, 101)
    trials, cycles : N, where each comes from
    """

    name: str
    side: str
    unit: str
    values: np.ndarray
    trials: tuple[str, ...]
    cycles: tuple[Cycle, ...]
    positive: str = ""
    summary: Summary = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "summary", summary_of(self.values))


@dataclass(frozen=True, eq=False)
class Summary:
    """Of N curves at each percent, (101,) each; of fewer than two curves the SD is NaN.

    Attributes
    ----------
    count : how many curves are known there
    mean, sd : SD with N - 1
    median, p5, p25, p75, p95 : percentiles
    """

    count: np.ndarray
    mean: np.ndarray
    sd: np.ndarray
    median: np.ndarray
    p5: np.ndarray
    p25: np.ndarray
    p75: np.ndarray
    p95: np.ndarray


def summary_of(values: np.ndarray) -> Summary:
    """Of curves (N, 101), NaN = not known."""
    finite = np.isfinite(values)
    count = finite.sum(axis=0)
    columns = np.full((7, values.shape[1]), np.nan)
    for alike in np.unique(finite, axis=1).T:  # percents at which the same curves are known
        if not alike.any():
            continue
        at = (finite == alike[:, None]).all(axis=0)
        known = values[alike][:, at]
        columns[0, at] = known.mean(axis=0)
        columns[1, at] = known.std(axis=0, ddof=1) if len(known) > 1 else np.nan
        columns[2:, at] = np.percentile(known, [50, 5, 25, 75, 95], axis=0)
    return Summary(count, *columns)


def cut_all(trials: Sequence[tuple[str, Sequence[Curve], Sequence[Cycle]]]) -> tuple[CutCurve, ...]:
    """Every curve of several trials cut into the cycles used of its side; a curve of no side into either foot's.

    Parameters
    ----------
    trials : name, curves and cycles of each
    """
    gathered: dict[tuple[str, str], tuple[Curve, list[np.ndarray], list[str], list[Cycle]]] = {}
    for trial, curves, cycles in trials:
        for cycle in cycles:
            own = [c for c in curves if cycle.used and (not c.side or cycle.side in (c.side, "general"))]
            for curve, values in zip(own, _cut_together(own, cycle)):
                side = curve.side or cycle.side
                _, rows, names, numbered = gathered.setdefault((curve.name, side), (curve, [], [], []))
                rows.append(values)
                names.append(trial)
                numbered.append(cycle)
    return tuple(
        CutCurve(name, side, curve.unit, np.array(values).reshape(-1, POINTS), tuple(names), tuple(own), curve.positive)
        for (name, side), (curve, values, names, own) in gathered.items()
    )


def _cut_together(curves: Sequence[Curve], cycle: Cycle) -> list[np.ndarray]:
    """(101,) of each curve, those on one clock in one go."""
    clocks: dict[int, list[int]] = {}
    for i, curve in enumerate(curves):
        clocks.setdefault(id(curve.time), []).append(i)
    out: list[np.ndarray] = [np.zeros(0)] * len(curves)
    for own in clocks.values():
        values = cut(curves[own[0]].time, np.stack([curves[i].values for i in own], axis=1), cycle)
        for k, i in enumerate(own):
            out[i] = values[:, k]
    return out


@dataclass(frozen=True)
class Scalar:
    """One figure of one cycle.

    Attributes
    ----------
    quantity, unit : "knee_angle range", "degrees"
    value : NaN where it is not known
    """

    trial: str
    cycle: str
    side: str
    quantity: str
    unit: str
    value: float


def peaks_of(curve: CutCurve) -> tuple[Scalar, ...]:
    """Range of motion, least and greatest value and when these are, in percent, of every cycle."""
    rows = []
    for values, trial, cycle in zip(curve.values, curve.trials, curve.cycles):
        whole = np.isfinite(values).mean() > 0.9
        low = int(np.nanargmin(values)) if whole else 0
        high = int(np.nanargmax(values)) if whole else 0
        figures = (
            ("range", curve.unit, values[high] - values[low]),
            ("minimum", curve.unit, values[low]),
            ("time of minimum", "%", float(low)),
            ("maximum", curve.unit, values[high]),
            ("time of maximum", "%", float(high)),
        )
        rows += [
            Scalar(trial, cycle.name, curve.side, f"{curve.name} {what}", unit, float(value) if whole else float("nan"))
            for what, unit, value in figures
        ]
    return tuple(rows)


def symmetry(left: float, right: float) -> float:
    """Symmetry index, %: (right - left) over their mean (Robinson et al. 1987); NaN where the mean is near zero."""
    mean = (left + right) / 2
    return 100 * (right - left) / mean if abs(mean) > 1e-9 * max(abs(left), abs(right), 1e-300) else float("nan")
