"""Filters over time: none, Butterworth without lag, or a smoothing spline by generalised cross-validation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from markerscope.solver.core.errors import InputError

FilterKind = Literal["none", "butterworth", "spline"]
_PASSES = 2


@dataclass(frozen=True)
class Filter:
    """How a signal is smoothed.

    Attributes
    ----------
    kind : ``none``; ``butterworth``: run forwards and backwards, so that nothing lags; ``spline``: cubic smoothing
        spline whose smoothness generalised cross-validation chooses (Woltring 1986)
    order : of the Butterworth filter after both passes; even
    cutoff : Hz, frequency that both passes together halve in power (-3 dB)
    """

    kind: FilterKind = "none"
    order: int = 4
    cutoff: float = 6.0

    def __post_init__(self) -> None:
        if self.kind == "butterworth" and (self.order < 2 or self.order % 2 or self.order > 12):
            raise InputError(f"an order of {self.order} cannot be filtered both ways", "filter", "say 2, 4, 6, 8 or 10")
        if self.kind == "butterworth" and not (np.isfinite(self.cutoff) and self.cutoff > 0):
            raise InputError(f"{self.cutoff:g} Hz is no cut-off frequency", "filter", "give it in Hz, for instance 6")

    @property
    def words(self) -> str:
        """As a methods paragraph says it."""
        if self.kind == "none":
            return "not filtered"
        if self.kind == "spline":
            return "cubic smoothing spline, generalised cross-validation (Woltring 1986)"
        return f"Butterworth low-pass filter, order {self.order} in all, {self.cutoff:g} Hz, zero lag"


def smooth(values: np.ndarray, rate: float, how: Filter) -> np.ndarray:
    """Smooth every column over time; what is lost stays lost, and each stretch between gaps is smoothed by itself.

    Parameters
    ----------
    values : (T, ...), NaN = lost
    rate : Hz

    Raises
    ------
    InputError : the cut-off is not below half the frame rate
    """
    if how.kind == "none":
        return values.copy()
    if how.kind == "butterworth" and not how.cutoff < 0.5 * rate:
        what = f"a cut-off of {how.cutoff:g} Hz cannot be had at {rate:g} frames a second"
        raise InputError(what, "filter", f"choose one below {0.5 * rate:g} Hz")
    flat = values.reshape(len(values), -1)
    out = flat.copy()
    for k in range(flat.shape[1]):
        for run in stretches(np.isfinite(flat[:, k])):
            piece = flat[run, k]
            out[run, k] = _butterworth(piece, rate, how) if how.kind == "butterworth" else _spline(piece)
    return out.reshape(values.shape)


def stretches(known: np.ndarray) -> list[slice]:
    """The stretches of True in (T,) flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _butterworth(piece: np.ndarray, rate: float, how: Filter) -> np.ndarray:
    """Both ways, the cut-off widened so that the two passes together have it (Winter 2009, equation 3.9)."""
    from scipy.signal import butter, sosfiltfilt

    single = how.order // _PASSES
    widened = np.tan(np.pi * how.cutoff / rate) / (2 ** (1 / _PASSES) - 1) ** (1 / (2 * single))
    sections = butter(single, min(2 * np.arctan(widened) / np.pi, 0.999), output="sos")
    pad = min(len(piece) - 1, int(np.ceil(rate / how.cutoff)))
    return np.asarray(sosfiltfilt(sections, piece, padlen=pad)) if len(piece) > 1 else piece.copy()


def _spline(piece: np.ndarray) -> np.ndarray:
    """A piece shorter than five samples has too few to judge the noise by, and stays."""
    from scipy.interpolate import make_smoothing_spline

    if len(piece) < 5 or np.ptp(piece) < 1e-12:
        return piece.copy()
    frames = np.arange(len(piece), dtype=float)
    return np.asarray(make_smoothing_spline(frames, piece)(frames))


@dataclass(frozen=True, eq=False)
class ResidualAnalysis:
    """Which cut-off frequency a signal asks for (Winter 2009, section 3.4.4.3).

    Attributes
    ----------
    cutoffs : (F,) Hz
    residuals : (F,) RMS difference of the signal, filtered by each, from the signal as it is
    noise : RMS of the noise: where the straight end of the curve meets zero frequency
    cutoff : Hz, the one at which the residual equals the noise
    """

    cutoffs: np.ndarray
    residuals: np.ndarray
    noise: float
    cutoff: float


def residual_analysis(values: np.ndarray, rate: float, order: int = 4) -> ResidualAnalysis:
    """Choose a cut-off by residual analysis, over all columns together.

    The straight end of the curve is fitted over the upper half of the frequencies. A signal without noise, or shorter
    than a second, has no such answer.

    Parameters
    ----------
    values : (T, ...), NaN = lost
    rate : Hz

    Raises
    ------
    InputError : too short, or sampled too slowly, to tell
    """
    highest = 0.4 * rate
    if len(values) < rate or highest < 4:
        raise InputError("less than a second, or too few frames a second, cannot tell noise", "residual analysis")
    cutoffs = np.linspace(1.0, highest, 60)
    residuals = np.zeros(len(cutoffs))
    for i, cutoff in enumerate(cutoffs):
        off = smooth(values, rate, Filter("butterworth", order, float(cutoff))) - values
        residuals[i] = np.sqrt(np.nanmean(off**2))
    end = cutoffs >= 0.5 * highest
    _, noise = np.polyfit(cutoffs[end], residuals[end], 1)
    noise = max(float(noise), 0.0)
    below = np.flatnonzero(residuals <= noise)
    cutoff = float(cutoffs[below[0]]) if len(below) else float(highest)
    if len(below) and below[0]:
        i = below[0]
        share = (residuals[i - 1] - noise) / max(residuals[i - 1] - residuals[i], 1e-300)
        cutoff = float(cutoffs[i - 1] + share * (cutoffs[i] - cutoffs[i - 1]))
    return ResidualAnalysis(cutoffs, residuals, noise, cutoff)
