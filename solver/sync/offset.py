"""The clock of the video against the clock of the markers, found from the motion that both saw.

A fixed camera turns a marker's velocity into a landmark's picture velocity almost linearly, whatever it looks at. So at
the right time shift some linear combinations of the one are predicted by the other: the mutual information of two
Gaussian signals, from their canonical correlations, peaks there. Nothing needs to know which marker is where, and a
single limb suffices.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers

SMOOTHING = 0.04  # s, standard deviation of the Gaussian under which velocities are fitted
COMPONENTS = 16  # principal components of velocity kept on either side
RIDGE = 1e-2  # of the mean variance, added to every component's
FASTEST = 10.0  # m/s; a marker is not faster, a wrong sample is
MIN_OVERLAP = 1.0  # s that the recordings must share for an offset to be judged
_SLACK = 2.0  # s that the recordings may start or end apart, beyond what their lengths say
_COARSE = 0.05  # s, step of the first search; a peak is some 0.2 s wide
_FINE = 0.01  # s, of the second
_PEAK_WIDTH = 0.25  # s to either side
_FRAME_RATES = 30 / 29.97  # the usual lie of a clock
_DECISIVE = 12.0  # nats that another clock ratio must bring
# The odds that an offset is right to 0.05 s, against its margin over the best rival: a logistic fit to 400 pairs of
# recordings of 3 to 14 s (benchmarks/sync_confidence.py draws others like them and shows how well it holds).
_EVEN_ODDS = 7.4  # nats
_STEEPNESS = 1.8
_UNCOMPARED = 0.2  # confidence at most, where the recordings are too short for another offset to be compared


@dataclass(frozen=True)
class Sync:
    """How to go from the video's clock to the markers': ``marker_time = rate_ratio * video_time + offset``.

    Attributes
    ----------
    offset : s
    rate_ratio : 1 unless the motion proves that a clock runs at 29.97/30
    confidence : 0..1, how likely the offset is right to 0.05 s
    lags : (L,) s, the offsets that were tried
    score : (L,) nats, the evidence for each; NaN where the recordings hardly overlap
    margin : nats by which the offset is ahead of every other and of what chance reaches
    method : what found it
    notes : what the user should know, one sentence each
    """

    offset: float
    rate_ratio: float
    confidence: float
    lags: np.ndarray
    score: np.ndarray
    margin: float = 0.0
    method: str = "canonical correlation of velocities"
    notes: tuple[str, ...] = ()

    def marker_time(self, video_time: np.ndarray) -> np.ndarray:
        """Times of the markers' clock, s, for times of the video's."""
        return self.rate_ratio * np.asarray(video_time) + self.offset


@dataclass(frozen=True)
class _Motion:
    """Velocities on an even clock, reduced to a few components: (T, K), with where they are known (T,)."""

    time: np.ndarray
    components: np.ndarray
    known: np.ndarray


def find_offset(landmarks: Landmarks, markers: Markers, *, search: tuple[float, float] | None = None) -> Sync:
    """Find the offset between two clocks from the motion that both recorded.

    Parameters
    ----------
    landmarks : of the video; rows without a person are left out
    markers : all of a body or a part of it, gaps allowed
    search : s, the offsets to try; by default every one at which the shorter recording lies within the longer, and 2 s
        on either side

    Raises
    ------
    InputError : one of the two holds too little to compare
    """
    if landmarks.tracked.sum() < 3 or len(markers.positions) < 3:
        raise InputError(
            "too few frames show the person or the markers to find the offset between them",
            landmarks.source or None,
            "give the offset",
        )
    video, moved = _of_video(landmarks), _of_markers(markers)
    _require_length(video.time, moved.time, landmarks.source)
    low, high = search or _likely(video.time, moved.time)
    lags = np.arange(low, high + 0.5 * _COARSE, _COARSE)
    score = _evidence(video, moved, lags)
    if not np.isfinite(score).any():
        raise InputError(
            f"the video and the markers share less than {MIN_OVERLAP:g} s in which both are seen, at offsets of "
            f"{low:.1f} to {high:.1f} s",
            landmarks.source or None,
            "give the offset (--offset)"
            if search is None
            else "give the offset (--offset), or a wider range to search",
        )
    offset, peak = _refined(video, moved, float(lags[np.nanargmax(score)]), 1.0)
    rival, rival_score = _rival(lags, score, offset)
    alone = not np.isfinite(rival_score)
    margin = max(0.0, peak - max(rival_score, _chance(video, moved, lags)))
    confidence = margin**_STEEPNESS / (margin**_STEEPNESS + _EVEN_ODDS**_STEEPNESS)
    confidence = min(confidence, _UNCOMPARED) if alone else confidence
    ratio, offset = _clock_ratio(video, moved, offset, peak)
    notes = []
    if ratio != 1.0:
        notes.append(f"The clocks run at a ratio of {ratio:.4f} (29.97 against 30 frames a second).")
    if alone:
        shared = min(video.time[-1] - video.time[0], moved.time[-1] - moved.time[0])
        notes.append(
            f"The recordings are too short ({shared:.2f} s) to compare the offset between video and markers with "
            f"others: {offset:.2f} s is a guess; give the offset if you know it."
        )
    elif confidence < 0.5:
        notes.append(
            f"The motion does not settle the offset between video and markers: {offset:.2f} s is hardly better than "
            f"{rival:.2f} s; give the offset if you know it."
        )
    return Sync(offset, ratio, confidence, lags, score, margin, notes=tuple(notes))


def lead(sync: Sync) -> float:
    """Nats by which the offset is ahead of every other; infinite where no other was judged."""
    if not np.isfinite(sync.score).any():
        return float("inf")
    return float(np.nanmax(sync.score)) - _rival(sync.lags, sync.score, sync.offset)[1]


def rival(sync: Sync) -> float:
    """The best offset beside the one that was found, s; NaN where no other was judged."""
    lag, score = _rival(sync.lags, sync.score, sync.offset)
    return lag if np.isfinite(score) else float("nan")


def _likely(video: np.ndarray, markers: np.ndarray) -> tuple[float, float]:
    """Offsets, s, at which the shorter recording lies within the longer, and somewhat beyond.

    Not so far that they share too little to be judged.
    """
    ends = (markers[0] - video[0], markers[-1] - video[-1])
    least, most = markers[0] - video[-1] + MIN_OVERLAP, markers[-1] - video[0] - MIN_OVERLAP
    return max(min(ends) - _SLACK, least), min(max(ends) + _SLACK, most)


def _require_length(video: np.ndarray, markers: np.ndarray, source: str) -> None:
    """Refuse recordings (times, s) that cannot share as much as an offset needs to be judged."""
    for what, time in (("video", video), ("markers", markers)):
        seconds, lasts = time[-1] - time[0], "lasts" if what == "video" else "last"
        if seconds < MIN_OVERLAP:
            raise InputError(
                f"the {what} {lasts} {seconds:.2f} s, and {MIN_OVERLAP:g} s of movement are "
                "needed to find the offset between video and markers",
                source or None,
                "give the offset (--offset)",
            )


def _refined(video: _Motion, markers: _Motion, lag: float, ratio: float) -> tuple[float, float]:
    """Offset and evidence at the top of the peak about ``lag``."""
    near = lag + np.arange(-1.5 * _COARSE, 1.5 * _COARSE + 1e-9, _FINE)
    score = _evidence(video, markers, near, ratio)
    if not np.isfinite(score).any():
        return lag, -np.inf
    top = int(np.nanargmax(score))
    if 0 < top < len(near) - 1 and np.isfinite(score[top - 1 : top + 2]).all():
        before, peak, after = score[top - 1 : top + 2]
        curvature = before - 2 * peak + after
        shift = 0.5 * (before - after) / curvature if curvature < 0 else 0.0
        return float(near[top] + shift * _FINE), float(peak)
    return float(near[top]), float(score[top])


def _rival(lags: np.ndarray, score: np.ndarray, offset: float) -> tuple[float, float]:
    """The best offset outside of the peak, s, and its evidence, nats; minus infinity where none could be judged."""
    elsewhere = np.where((np.abs(lags - offset) > _PEAK_WIDTH) & np.isfinite(score), score, -np.inf)
    rival = int(elsewhere.argmax())
    return float(lags[rival]), float(elsewhere[rival])


def _chance(video: _Motion, markers: _Motion, lags: np.ndarray) -> float:
    """Nats that chance and rhythm alone can reach: the best offset of the video played backwards."""
    backwards = _Motion(video.time, video.components[::-1], video.known[::-1])
    return float(np.nanmax(_evidence(backwards, markers, lags), initial=-np.inf))


def _clock_ratio(video: _Motion, markers: _Motion, offset: float, peak: float) -> tuple[float, float]:
    """Another clock ratio and its offset, where the evidence for it is decisive; else 1."""
    best = (peak + _DECISIVE, 1.0, offset)
    middle = 0.5 * (video.time[0] + video.time[-1])
    for ratio in (_FRAME_RATES, 1 / _FRAME_RATES):
        shifted, evidence = _refined(video, markers, offset + (1 - ratio) * middle, ratio)
        best = max(best, (evidence, ratio, shifted))
    return best[1], best[2]


def _slopes(values: np.ndarray, known: np.ndarray, rate: float) -> np.ndarray:
    """Velocities (T, C) of even samples by a Gaussian-weighted line fit; NaN where too few are ``known`` (T, C)."""
    from scipy.ndimage import correlate1d

    reach = int(np.ceil(3 * SMOOTHING * rate))
    lead = np.arange(-reach, reach + 1) / rate
    weight = np.exp(-0.5 * (lead / SMOOTHING) ** 2)
    weight /= weight.sum()

    def total(signal: np.ndarray, power: int) -> np.ndarray:
        return correlate1d(signal, weight * lead**power, axis=0, mode="constant")

    mask = known.astype(float)
    signal = np.where(known, values, 0.0)
    count, first, second = (total(mask, power) for power in range(3))
    spread = count * second - first**2
    enough = (count > 0.4) & (spread > 1e-3 * SMOOTHING**2)
    slope = count * total(signal, 1) - first * total(signal, 0)
    return np.where(enough, slope / np.where(enough, spread, 1.0), np.nan)


def _reduced(time: np.ndarray, velocity: np.ndarray) -> _Motion:
    """Principal components of velocities (T, C); unknown ones follow from the known ones of their frame."""
    velocity = velocity[:, np.isfinite(velocity).mean(axis=0) > 0.2]
    finite = np.isfinite(velocity)
    known = finite.mean(axis=1) > 0.3 if velocity.shape[1] else np.zeros(len(time), dtype=bool)
    if known.sum() < 3:
        return _Motion(time, np.zeros((len(time), 1)), np.zeros(len(time), dtype=bool))
    rows, finite = velocity[known], finite[known]
    rows = rows - np.nanmean(rows, axis=0)
    filled = np.where(finite, rows, 0.0)
    for _ in range(1 if finite.all() else 15):
        axes = np.linalg.eigh(filled.T @ filled)[1][:, ::-1][:, :COMPONENTS]
        scores = filled @ axes
        filled = np.where(finite, rows, scores @ axes.T)
    components = np.zeros((len(time), scores.shape[1]))
    components[known] = scores
    return _Motion(time, components, known)


def _of_video(landmarks: Landmarks) -> _Motion:
    time = landmarks.time[landmarks.tracked]
    step = float(np.median(np.diff(time)))
    even = np.arange(time[0], time[-1] + 0.5 * step, step)
    picture = landmarks.image[landmarks.tracked].reshape(len(time), -1)
    values = np.stack([np.interp(even, time, column) for column in picture.T], axis=1)
    after = np.clip(np.searchsorted(time, even), 1, len(time) - 1)
    known = np.repeat((time[after] - time[after - 1] < 2.5 * step)[:, None], values.shape[1], axis=1)
    sight = np.repeat(landmarks.visibility[landmarks.tracked].mean(axis=0), 2)
    return _reduced(even, _slopes(values, known, 1.0 / step) * sight)


def _of_markers(markers: Markers) -> _Motion:
    columns = markers.positions.reshape(len(markers.positions), -1)
    velocity = _slopes(columns, np.repeat(markers.present, 3, axis=1), markers.rate)
    velocity[np.abs(velocity) > FASTEST] = np.nan
    return _reduced(markers.time, velocity)


def _evidence(video: _Motion, markers: _Motion, lags: np.ndarray, ratio: float = 1.0) -> np.ndarray:
    """Nats in favour of each offset; NaN where the recordings overlap too little to say."""
    score = np.full(len(lags), np.nan)
    step = video.time[1] - video.time[0]
    rate = (len(markers.time) - 1) / (markers.time[-1] - markers.time[0])
    for i, lag in enumerate(lags):
        place = (ratio * video.time + lag - markers.time[0]) * rate
        before = np.floor(place).astype(int)
        inside = (before >= 0) & (before < len(markers.time) - 1) & video.known
        before, part = before[inside], (place - before)[inside, None]
        both = markers.known[before] & markers.known[before + 1]
        before, part = before[both], part[both]
        seconds = len(before) * step
        if seconds < MIN_OVERLAP:
            continue
        seen = video.components[inside][both]
        moved = (1 - part) * markers.components[before] + part * markers.components[before + 1]
        score[i] = seconds / (4 * SMOOTHING) * _information(seen, moved)
    return score


def _information(a: np.ndarray, b: np.ndarray) -> float:
    """Mutual information, nats a sample, of two Gaussian signals (N, P) and (N, Q)."""

    def whitened(x: np.ndarray) -> np.ndarray:
        x = x - x.mean(axis=0)
        variance = x.T @ x
        ridge = RIDGE * np.trace(variance) / len(variance) + 1e-12
        return np.linalg.solve(np.linalg.cholesky(variance + ridge * np.eye(len(variance))), x.T)

    correlations = np.linalg.svd(whitened(a) @ whitened(b).T, compute_uv=False)
    return float(-0.5 * np.log1p(-(np.clip(correlations, 0, 1 - 1e-9) ** 2)).sum())
