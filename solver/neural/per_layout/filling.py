"""Gaps filled by the occlusion network: how it learns, how it is used, and whether it is worth using on a recording."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.cleaning.fill import METHODS, fill
from markerscope.solver.cleaning.gap_model import GapModel, draw_gaps, heavy_tailed
from markerscope.solver.cleaning.gaps import Fill, Filled, FillSettings, gaps_to_fill, together
from markerscope.solver.cleaning.request import Method
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.neural.align import align, into, out_of, over_rest
from markerscope.solver.neural.layers import Params, spread_of
from markerscope.solver.neural.layout import Layout
from markerscope.solver.neural.metrics import ompe
from markerscope.solver.neural.per_layout.occlusion import WINDOW, Occlusion, corrected
from markerscope.solver.neural.training.examples import Sampler, generator
from markerscope.solver.neural.training.library import RATE

if TYPE_CHECKING:
    from torch import Generator, Tensor

_EVERYTHING = FillSettings(max_gap=None, min_confidence=0.0)
_SHARES = (0.05, 0.1, 0.2)
_BETTER = 0.98
"""Share of the default's error that the network has to stay below: less is chance."""
_NEAR_M = 0.05
"""Markers further from one that was never seen count ever less in where it is put."""
_FEWEST_HIDDEN = 50
"""Hidden samples on which a comparison means something."""


@dataclass(frozen=True, eq=False)
class FillNetwork:
    """A trained network with all that it takes to use it.

    Attributes
    ----------
    network, params : what corrects
    layout : of the markers, with their columns in the recording
    rest : (M, 3) m, the markers on the body at rest
    start : the method whose filling it corrects
    """

    network: Occlusion
    params: Params
    layout: Layout
    rest: np.ndarray
    start: Method = "edm"


@dataclass(frozen=True)
class Worth:
    """What a network and the default make of gaps made on purpose in one recording.

    Attributes
    ----------
    network_cm, default_cm : OMPE over the same samples
    hidden : how many these are
    accepted : whether the network is to be used there
    """

    network_cm: float
    default_cm: float
    hidden: int
    accepted: bool

    @property
    def sentence(self) -> str:
        """What was found, in words."""
        if not np.isfinite(self.network_cm + self.default_cm):
            return f"Only {self.hidden} samples could be hidden to try the network on: the default filled the gaps."
        return (
            f"On {self.hidden} samples hidden on purpose the network is {10 * self.network_cm:.1f} mm off, the default "
            f"{10 * self.default_cm:.1f} mm: the {'network' if self.accepted else 'default'} filled the gaps."
        )


def completed(positions: np.ndarray, rate: float, start: Method, layout: Layout, rest: np.ndarray) -> np.ndarray:
    """(T, M, 3) m without gaps: by the method, by a rigid body where it cannot, and at last as at rest.

    Parameters
    ----------
    positions : (T, M, 3) m, of the layout's markers, NaN = lost
    """
    import torch

    whole = fill(positions, rate, replace(_EVERYTHING, method=start)).positions
    for method in ("rigid", "linear"):
        if np.isfinite(whole).all():
            return whole
        whole = METHODS[method](whole, rate, replace(_EVERYTHING, method=method)).positions
    lost = ~np.isfinite(whole).all(axis=2)
    given, there, at_rest = (torch.tensor(array) for array in (whole, ~lost, rest))
    whole = whole.copy()
    for m in np.flatnonzero(lost.any(axis=0)):
        # Never seen: as the body at rest has it among the markers that are near, for these ride with it.
        near = ((at_rest - at_rest[m]).square().sum(-1) + _NEAR_M**2) ** -3
        R, t = over_rest(given, there, at_rest, near / near.max())
        whole[:, m] = np.where(lost[:, m, None], (R @ at_rest[m] + t).numpy(), whole[:, m])
    return np.nan_to_num(whole)


def say(found: FillNetwork, positions: np.ndarray, rate: float) -> np.ndarray:
    """(T, M, 3) m, the layout's markers without gaps, as the network has them; seen ones as they were."""
    import torch

    present = np.isfinite(positions).all(axis=2)
    whole = completed(positions, rate, found.start, found.layout, found.rest)
    rest = torch.as_tensor(found.rest, dtype=torch.float64)
    local, R, t = align(torch.as_tensor(whole), found.layout, rest)
    step = max(1, round(rate / RATE))  # the network knows one rate: of a faster recording, every other frame apart
    out = local.numpy().copy()
    for first in range(step):
        out[first::step] = corrected(found.network, found.params, out[first::step], present[first::step])
    lab = out_of(torch.as_tensor(out), R, t).numpy()
    return np.where(present[..., None], positions, lab)


def fill_network(positions: np.ndarray, rate: float, settings: FillSettings, network: FillNetwork) -> Filled:
    """A way of filling: the network's where it beats the default on gaps made in this very recording, else the default.

    Parameters
    ----------
    positions : (T, M, 3) m, all columns of the recording, NaN = lost
    rate : Hz
    """
    usual = fill(positions, rate, replace(settings, method=FillSettings().method))
    judged = worth(positions, rate, network)
    if not judged.accepted:
        return replace(usual, notes=(judged.sentence,))
    columns = network.layout.columns
    said = say(network, positions[:, columns], rate)
    better = judged.network_cm / max(judged.default_cm, 1e-9)
    expected = {(span.marker, span.first): span.error for span in usual.fills}
    place = {int(column): i for i, column in enumerate(columns)}
    parts: list[tuple[Fill, np.ndarray]] = []
    for gap in gaps_to_fill(np.isfinite(positions).all(axis=2), rate, settings):
        error = expected.get((gap.marker, gap.first))
        if error is None:  # what the default cannot tell, the network only guesses
            continue
        span = slice(gap.first, gap.last + 1)
        if gap.marker in place:
            values = said[span, place[gap.marker]]
            parts.append((Fill(gap.marker, gap.first, gap.last, "network", 0.0, better * error), values))
        else:
            kept = next(f for f in usual.fills if (f.marker, f.first) == (gap.marker, gap.first))
            parts.append((kept, usual.positions[span, gap.marker]))
    return replace(together(positions, parts, settings), notes=(judged.sentence,))


def worth(
    positions: np.ndarray,
    rate: float,
    network: FillNetwork,
    *,
    model: GapModel | None = None,
    share: float = 0.1,
    seed: int = 0,
) -> Worth:
    """Hide samples of a recording, fill them by the network and by the default, and compare.

    Parameters
    ----------
    positions : (T, M, 3) m, all columns of the recording
    model : of the gaps; by default their lengths have a heavy tail
    share : of the samples that are hidden
    """
    columns = network.layout.columns
    if positions.shape[1] <= int(columns.max()) or len(positions) < 2:
        return Worth(float("nan"), float("nan"), 0, False)
    truth = positions[:, columns]
    hidden = draw_gaps(np.isfinite(truth).all(axis=2), model or heavy_tailed(), share, seed)
    given = positions.copy()
    given[:, columns] = np.where(hidden[..., None], np.nan, truth)
    usual = fill(given, rate, _EVERYTHING).positions[:, columns]
    # Only what both fill is compared: the network fills all, the default what it can tell.
    hidden &= np.isfinite(usual).all(axis=2)
    count = int(hidden.sum())
    if count < _FEWEST_HIDDEN:
        return Worth(float("nan"), float("nan"), count, False)
    said = say(network, given[:, columns], rate)
    ours, theirs = ompe(said, truth, hidden), ompe(usual, truth, hidden)
    return Worth(ours, theirs, count, bool(ours < _BETTER * theirs))


@dataclass(frozen=True, eq=False)
class FillBank:
    """Recordings with gaps that were filled once, to learn from.

    Attributes
    ----------
    local : (S, T, M, 3) m, filled; truth : likewise, as it was; in the frame of the waist as the filled ones have it
    visible : (S, T, M) 1 where seen
    """

    local: Tensor
    truth: Tensor
    visible: Tensor


def fill_bank(
    sampler: Sampler,
    layout: Layout,
    rest: np.ndarray,
    count: int,
    seed: int,
    *,
    frames: int = 256,
    start: Method = "edm",
    model: GapModel | None = None,
    shares: tuple[float, ...] = _SHARES,
    progress: Progress = silent,
) -> FillBank:
    """Spans of motion with markers, hidden by the statistics, and filled by the method that the network starts from."""
    import torch

    rest_there = torch.as_tensor(rest, dtype=torch.float32)
    local, truth, visible = [], [], []
    for i in range(count):
        progress(i / count, "filling recordings to learn from")
        markers = sampler.draw(layout, 1, generator(seed, i), frames).markers
        positions = markers.numpy().astype(float)
        hidden = draw_gaps(
            np.ones(positions.shape[:2], dtype=bool), model or heavy_tailed(), shares[i % len(shares)], seed + i
        )
        given = np.where(hidden[..., None], np.nan, positions)
        whole = torch.as_tensor(completed(given, RATE, start, layout, rest), dtype=torch.float32)
        there, R, t = align(whole, layout, rest_there)
        local.append(there)
        truth.append(into(markers, R, t))
        visible.append(torch.as_tensor(~hidden, dtype=torch.float32))
    return FillBank(torch.stack(local), torch.stack(truth), torch.stack(visible))


@dataclass(frozen=True, eq=False)
class FillTask:
    """What the occlusion network learns: ``learnt`` and ``held_out`` share neither clips nor bodies."""

    network: Occlusion
    learnt: FillBank
    held_out: FillBank
    batch: int = 8

    def loss(self, params: Params, generator: Generator) -> dict[str, Tensor]:
        """Equation (3) on windows: mean distance of hidden samples from the truth, in units of a centimetre."""
        import torch

        bank = self.learnt
        which = torch.randint(len(bank.local), (self.batch, 1), generator=generator)
        frames = bank.local.shape[1]
        first = torch.randint(frames - WINDOW + 1, (self.batch, 1), generator=generator)
        span = first + torch.arange(WINDOW)
        local, truth, visible = (x[which, span] for x in (bank.local, bank.truth, bank.visible))
        said = self.network(params, local, visible)
        apart = (said - truth).square().sum(-1).clamp_min(1e-12).sqrt() * (1 - visible)
        return {"hidden_cm": 100 * apart.sum() / (1 - visible).sum().clamp_min(1)}

    @cached_property
    def start_cm(self) -> float:
        """OMPE of the filling that the network starts from, on what is held out."""
        bank = self.held_out
        return ompe(bank.local.numpy(), bank.truth.numpy(), bank.visible.numpy() == 0)

    def judge(self, params: Params) -> dict[str, float]:
        """OMPE (cm) on what is held out, of the network and of what it starts from."""
        bank = self.held_out
        said = [
            corrected(self.network, params, local.numpy(), visible.numpy() > 0)
            for local, visible in zip(bank.local, bank.visible)
        ]
        error = ompe(np.stack(said), bank.truth.numpy(), bank.visible.numpy() == 0)
        return {"score": error, "ompe": error, "start": self.start_cm}


def new_occlusion(
    sampler: Sampler, layout: Layout, rest: np.ndarray, *, hidden: int = 800, filled_first: bool = True
) -> Occlusion:
    """The network of a layout, its neighbours told from how its markers move on one body."""
    import torch

    from markerscope.solver.neural.graph import FILLING, distance_deviation, nearest
    from markerscope.solver.neural.per_layout.solving import only_first

    plain = replace(sampler.settings.plain(), spread=0.0, bones=0.0, placement_mm=0.0, height_mm=0.0, jitter_mm=0.0)
    still = Sampler(sampler.clips, only_first(sampler.pool), plain, sampler.mean)
    markers = still.draw(layout, 1500, generator(0)).markers
    local, _, _ = align(markers, layout, torch.as_tensor(rest, dtype=torch.float32))
    mean = np.round(local.mean(0).numpy().astype(float), 5).tolist()
    links = nearest(distance_deviation(markers.numpy()), FILLING)
    return Occlusion(links, mean, spread_of(local, links), hidden=hidden, filled_first=filled_first)
