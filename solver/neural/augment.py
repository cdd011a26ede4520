"""Data made worse on purpose (Pan et al. 2023, section 3.3): gaps as real recordings have them, and shifted markers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.cleaning.gap_model import GapModel, draw_gaps

if TYPE_CHECKING:
    from torch import Generator, Tensor


@dataclass(frozen=True)
class FrameNoise:
    """What single frames suffer that a solving network is to learn from: it sees cleaned markers.

    Attributes
    ----------
    lost : markers of an example are lost with a chance between 0 and this
    whole : share of the examples in which none is
    filled_mm : mm, a filled marker is off by up to about this along each axis, another size each
    shifted, shift_mm : chance that a seen marker is displaced, and the farthest along each axis, drawn evenly
    """

    lost: float = 0.15
    whole: float = 0.6
    filled_mm: float = 25.0
    shifted: float = 0.003
    shift_mm: float = 30.0


def corrupted(local: Tensor, noise: FrameNoise, generator: Generator) -> tuple[Tensor, Tensor]:
    """Markers (B, M, 3) m, some filled badly and some displaced, and which are seen (B, M) 1 or 0."""
    import torch

    count, markers = local.shape[:2]

    def even(*shape: int) -> Tensor:
        return torch.rand(*shape, generator=generator)

    chance = noise.lost * even(count, 1) * (even(count, 1) >= noise.whole)
    lost = even(count, markers) < chance
    error = 1e-3 * noise.filled_mm * even(count, markers, 1) * torch.randn(count, markers, 3, generator=generator)
    shift = 1e-3 * noise.shift_mm * (2 * even(count, markers, 3) - 1)
    shifted = (even(count, markers) < noise.shifted) & ~lost
    off = torch.where(lost[..., None], error, torch.where(shifted[..., None], shift, torch.zeros(())))
    return local + off, (~lost).to(local.dtype)


@dataclass(frozen=True)
class Augmentation:
    """How sequences are made worse.

    Attributes
    ----------
    lost : share of the samples that is hidden
    shifted : chance of a sample that is left to be displaced
    shift_mm : mm, sigma_shift: the displacement along each axis is even between minus and plus this
    """

    lost: float = 0.1
    shifted: float = 0.0
    shift_mm: float = 20.0


def augmented(
    positions: np.ndarray, model: GapModel, settings: Augmentation, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A recording made worse.

    Gaps are drawn by equation (6) as ``markerscope.solver.cleaning.gap_model.draw_gaps`` has it: with the mean of the
    markers' rates where the publication prints their sum, and with the fractions of a gap that rounding down loses
    drawn.

    Parameters
    ----------
    positions : (T, M, 3) m, NaN = lost
    model : how often markers are lost, and for how long
    seed : of every random choice

    Returns
    -------
    positions : (T, M, 3) m, NaN where hidden or lost before
    hidden, shifted : (T, M) True where a sample was
    """
    rng = np.random.default_rng([seed, 1])
    present = np.isfinite(positions).all(axis=2)
    hidden = draw_gaps(present, model, settings.lost, seed)
    shifted = present & ~hidden & (rng.random(present.shape) < settings.shifted)
    shift = 1e-3 * settings.shift_mm * rng.uniform(-1, 1, positions.shape)
    out = np.where(shifted[..., None], positions + shift, positions)
    return np.where(hidden[..., None], np.nan, out), hidden, shifted


@dataclass(frozen=True, eq=False)
class GapBank:
    """Long courses of gaps drawn once, from which windows are cut quickly.

    Attributes
    ----------
    hidden : (F, M) True where hidden
    """

    hidden: Tensor

    def cut(self, count: int, window: int, generator: Generator) -> Tensor:
        """(count, window, M) True, anywhere in the course, markers exchanged at random among those of the course."""
        import torch

        frames, markers = self.hidden.shape
        start = torch.randint(frames - window + 1, (count, 1), generator=generator)
        taken = self.hidden[start + torch.arange(window)]  # (count, window, M)
        order = torch.rand(count, markers, generator=generator).argsort(1)
        return taken.gather(2, order[:, None].expand(-1, window, -1))


def gap_bank(markers: int, model: GapModel, shares: tuple[float, ...], seed: int, frames: int = 4000) -> GapBank:
    """Courses for some shares of lost samples, one behind the other."""
    import torch

    present = np.ones((frames, markers), dtype=bool)
    drawn = [draw_gaps(present, model, share, seed + i) for i, share in enumerate(shares)]
    return GapBank(torch.as_tensor(np.concatenate(drawn)))
