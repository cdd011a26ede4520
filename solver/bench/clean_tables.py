"""What the benchmark of cleaning found, as rows and as tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass

import numpy as np


@dataclass(frozen=True)
class FillRow:
    """One method on one recording, over all seeds.

    Attributes
    ----------
    recording, frames, markers, method, lost : which; ``lost`` is the share of samples hidden
    mean_cm, median_cm, p95_cm : distance of filled samples from the truth, everything filled that the method can
    filled : share of the hidden samples that is
    sure_mean_cm, sure_filled : the same with the default limits of confidence and length
    expected_cm : mean of the errors that were expected
    rank_correlation : of confidence and minus error, over the gaps (Spearman)
    frames_per_s : of processor time
    """

    recording: str
    frames: int
    markers: int
    method: str
    lost: float
    mean_cm: float
    median_cm: float
    p95_cm: float
    filled: float
    sure_mean_cm: float
    sure_filled: float
    expected_cm: float
    rank_correlation: float
    frames_per_s: float


@dataclass(frozen=True)
class OutlierRow:
    """One way of finding outliers on one recording, over all seeds.

    Attributes
    ----------
    recording, rate, kind, method : which; ``kind``: single samples, or spans of up to 5
    f1, precision, recall : of the samples displaced on purpose; all else that is found counts as wrong
    own : samples found in the recording as it is: jumps that it came with, or good samples taken for such
    f1_apart : the same score where those ``own`` count neither as right nor as wrong
    """

    recording: str
    rate: float
    kind: str
    method: str
    f1: float
    precision: float
    recall: float
    own: int
    f1_apart: float


@dataclass(frozen=True)
class CleanTables:
    """All rows, and what was left out and why."""

    fills: tuple[FillRow, ...]
    outliers: tuple[OutlierRow, ...]
    left_out: tuple[str, ...]

    def markdown(self, fillings: Sequence[str] = (), outliers: Sequence[str] = ()) -> str:
        """Both tables, of some methods or all; the mean over the recordings comes last."""
        fills = [row for row in (*self.fills, *_means(self.fills)) if not fillings or row.method in fillings]
        found = [row for row in self.outliers if not outliers or row.method in outliers]
        text = [
            "| recording | frames x markers | lost | method | mean error cm | median | 95 % | filled | "
            "with the limits: mean cm | filled | expected cm | rank correlation | frames/s |",
            "|---|---|---|---|---|---|---|---|---|---|---|---|---|",
        ]
        for row in fills:
            text.append(
                f"| {row.recording} | {row.frames} x {row.markers} | {100 * row.lost:.0f} % | {row.method} | "
                f"{row.mean_cm:.2f} | {row.median_cm:.2f} | {row.p95_cm:.2f} | {100 * row.filled:.0f} % | "
                f"{row.sure_mean_cm:.2f} | {100 * row.sure_filled:.0f} % | {row.expected_cm:.2f} | "
                f"{row.rank_correlation:.2f} | {row.frames_per_s:.0f} |"
            )
        text += [
            "",
            "| recording | Hz | outliers | method | F1 | precision | recall | found untouched | F1 without these |",
            "|---|---|---|---|---|---|---|---|---|",
        ]
        text += [
            f"| {row.recording} | {row.rate:g} | {row.kind} | {row.method} | {row.f1:.3f} | {row.precision:.3f} | "
            f"{row.recall:.3f} | {row.own} | {row.f1_apart:.3f} |"
            for row in found
        ]
        return "\n".join([*text, "", *(f"Left out: {said}" for said in self.left_out)]) + "\n"


def _means(rows: Sequence[FillRow]) -> list[FillRow]:
    """The mean over the recordings, for each method and share."""
    means = []
    for method, lost in dict.fromkeys((row.method, row.lost) for row in rows):
        alike = [asdict(row) for row in rows if (row.method, row.lost) == (method, lost)]
        figures = {
            key: float(np.nanmean([row[key] for row in alike]))
            for key in alike[0]
            if key not in ("recording", "frames", "markers", "method")
        }
        frames, markers = sum(row["frames"] for row in alike), round(np.mean([row["markers"] for row in alike]))
        means.append(FillRow(f"mean of {len(alike)}", frames, markers, method, **figures))
    return means
