"""One training loop for every network: seeded, stopped in time or early, resumed where it was killed."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.io.atomic import write_bytes_atomic
from markerscope.solver.neural.training.examples import generator

if TYPE_CHECKING:
    from torch import Generator, Tensor

Params = dict[str, "Tensor"]
"""A network's numbers by name; networks are pure functions of them."""
Loss = Callable[[Params, "Generator"], dict[str, "Tensor"]]
"""Terms, already weighted, of the loss on a batch drawn with a generator; their sum is made small."""
Judge = Callable[[Params], dict[str, float]]
"""Figures on what is held out; ``score`` among them, the smaller the better."""

_USUAL = 1e-3


@dataclass(frozen=True)
class TrainSettings:
    """How a network is trained. Without ``seconds`` the same settings give the same weights.

    Attributes
    ----------
    steps, seconds : when to stop, whichever comes first; at least one is given
    rate : of learning at its highest; None takes what suits the network, or 1e-3
    warm : steps in which it rises to that
    last : share of it that is left at the end, along half a cosine
    decay : of weights
    clip : longest gradient
    average : how slowly the averaged weights, which are judged and kept, follow
    check : steps between two looks at what is held out
    patience : looks without a better score after which it stops; None never
    save : s between two checkpoints
    seed, threads : of every random choice; of torch, None leaves them
    """

    steps: int | None = None
    seconds: float | None = 480.0
    rate: float | None = None
    warm: int = 100
    last: float = 0.01
    decay: float = 0.0
    clip: float = 1.0
    average: float = 0.995
    check: int = 250
    patience: int | None = 12
    save: float = 30.0
    seed: int = 0
    threads: int | None = 1

    def __post_init__(self) -> None:
        """Refuse what would never end."""
        if self.steps is None and self.seconds is None:
            raise InputError("neither a number of steps nor a time is given", "training", "give one of them")


@dataclass(frozen=True, eq=False)
class Trained:
    """What came of it.

    Attributes
    ----------
    params : the averaged weights of the best look
    figures : of that look
    steps, seconds : in all, before and after resuming
    history : a row each look: step, seconds, loss terms, figures
    stopped : whether it was told to end before its time; its checkpoint is still there then
    """

    params: Params
    figures: dict[str, float]
    steps: int
    seconds: float
    history: tuple[dict[str, float], ...]
    stopped: bool = False


def never() -> bool:
    """Go on."""
    return False


@dataclass
class _State:
    """A training under way: all that a checkpoint holds."""

    params: Params
    averaged: Params
    best: Params
    step: int = 0
    seconds: float = 0.0
    stale: int = 0
    figures: dict[str, float] = field(default_factory=dict)
    history: list[dict[str, float]] = field(default_factory=list)
    smooth: dict[str, float] = field(default_factory=dict)


def train(
    params: Mapping[str, Tensor],
    loss: Loss,
    judge: Judge,
    settings: TrainSettings,
    *,
    checkpoint: Path | None = None,
    what: str = "",
    progress: Progress = silent,
    enough: Callable[[], bool] = never,
    keep: bool = False,
) -> Trained:
    """Train from ``params`` on, which are not changed.

    Parameters
    ----------
    loss, judge : see there; ``judge`` is called without gradients
    checkpoint : file that is written from time to time, taken up where it is there, and removed at the end
    keep : leave it there at the end: a training that is one of several is not done again when these are taken up
    what : digest of what is trained on what; a checkpoint of anything else is refused
    enough : asked before every step; True ends the training, the best so far is kept

    Raises
    ------
    InputError : the checkpoint is of another training
    Cancelled : whoever listens to the progress stopped it; the checkpoint holds what was reached
    """
    import torch

    with _threads(settings.threads):
        state = _State(_copied(params), _copied(params), _copied(params))
        for value in state.params.values():
            value.requires_grad_(True)
        optimiser = torch.optim.AdamW(list(state.params.values()), settings.rate or _USUAL, weight_decay=settings.decay)
        if checkpoint is not None and checkpoint.is_file():
            _resume(checkpoint, what, state, optimiser)
        started, saved, before = time.monotonic(), time.monotonic(), state.seconds
        stopped = False
        try:
            while _share(state, settings) < 1 and not _stale(state, settings):
                if enough():
                    stopped = True
                    break
                rate = _rate(state, settings)
                for group in optimiser.param_groups:
                    group["lr"] = rate
                terms = loss(state.params, generator(settings.seed, state.step))
                total = torch.stack(list(terms.values())).sum()
                optimiser.zero_grad()
                total.backward()
                length = torch.nn.utils.clip_grad_norm_(list(state.params.values()), settings.clip)
                if bool(torch.isfinite(length)):  # one bad batch shall not spoil all
                    optimiser.step()
                state.step += 1
                _follow(state, settings)
                for name, term in terms.items():
                    now = float(term.detach())
                    state.smooth[name] = 0.98 * state.smooth.get(name, now) + 0.02 * now
                state.seconds = before + time.monotonic() - started
                if state.step % settings.check == 0:
                    _look(state, judge)
                if state.step % 10 == 0:
                    progress(min(_share(state, settings), 1.0), _said(state, settings))
                if checkpoint is not None and time.monotonic() - saved > settings.save:
                    _save(checkpoint, what, state, optimiser)
                    saved = time.monotonic()
        except Cancelled:
            if checkpoint is not None:
                _save(checkpoint, what, state, optimiser)
            raise
        if state.step % settings.check or not state.history:
            _look(state, judge)
        if (stopped or keep) and checkpoint is not None:
            _save(checkpoint, what, state, optimiser)
    if checkpoint is not None and not (stopped or keep):
        checkpoint.unlink(missing_ok=True)
    progress(1.0, f"{state.step} steps, held out {state.figures['score']:.4g}")
    return Trained(state.best, state.figures, state.step, state.seconds, tuple(state.history), stopped)


def _share(state: _State, settings: TrainSettings) -> float:
    """How much of the training is done."""
    by_steps = 0.0 if settings.steps is None else state.step / max(settings.steps, 1)
    by_time = 0.0 if settings.seconds is None else state.seconds / max(settings.seconds, 1e-9)
    return max(by_steps, by_time)


def _rate(state: _State, settings: TrainSettings) -> float:
    falling = settings.last + (1 - settings.last) * 0.5 * (1 + math.cos(math.pi * _share(state, settings)))
    return (settings.rate or _USUAL) * falling * min(1.0, (state.step + 1) / max(settings.warm, 1))


def _stale(state: _State, settings: TrainSettings) -> bool:
    return settings.patience is not None and state.stale >= settings.patience


def _follow(state: _State, settings: TrainSettings) -> None:
    """Move the averaged weights; the first steps count fully."""
    import torch

    keep = min(settings.average, state.step / (state.step + 10))
    with torch.no_grad():
        averaged, now = list(state.averaged.values()), list(state.params.values())
        torch._foreach_lerp_(averaged, now, 1 - keep)


def _look(state: _State, judge: Judge) -> None:
    """Judge the averaged weights, and keep them if they are the best so far."""
    import torch

    with torch.no_grad():
        figures = judge(state.averaged)
    row = {"step": float(state.step), "seconds": state.seconds, **{f"loss_{k}": v for k, v in state.smooth.items()}}
    state.history.append(row | figures)
    if not state.figures or figures["score"] < state.figures["score"]:
        state.figures, state.stale = figures, 0
        state.best = {name: value.clone() for name, value in state.averaged.items()}
    else:
        state.stale += 1


def _said(state: _State, settings: TrainSettings) -> str:
    share = max(_share(state, settings), 1e-6)
    left = state.seconds * (1 - share) / share
    parts = [f"step {state.step}", "loss " + ", ".join(f"{name} {value:.3g}" for name, value in state.smooth.items())]
    if state.figures:
        parts.append(f"held out {state.figures['score']:.3g}")
    return "; ".join([*parts, f"{left / 60:.1f} min left" if left > 90 else f"{left:.0f} s left"])


@contextmanager
def _threads(wanted: int | None) -> Iterator[None]:
    import torch

    before = torch.get_num_threads()
    if wanted is not None:
        torch.set_num_threads(wanted)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _save(path: Path, what: str, state: _State, optimiser: Any) -> None:
    """The whole state as tensors and JSON."""
    from safetensors.torch import save

    tensors = {f"{group}/{k}": v.detach() for group in _GROUPS for k, v in getattr(state, group).items()}
    for name, value in state.params.items():
        for key, moment in optimiser.state.get(value, {}).items():
            tensors[f"{key}/{name}"] = moment.clone()
    said = {"what": what} | {name: getattr(state, name) for name in _NUMBERS}
    write_bytes_atomic(path, save({k: v.contiguous() for k, v in tensors.items()}, {"state": json.dumps(said)}))


_GROUPS = ("params", "averaged", "best")
_NUMBERS = ("step", "seconds", "stale", "figures", "history", "smooth")
_MOMENTS = ("step", "exp_avg", "exp_avg_sq")


def _copied(params: Mapping[str, Tensor]) -> Params:
    return {name: value.detach().clone() for name, value in params.items()}


def _resume(path: Path, what: str, state: _State, optimiser: Any) -> None:
    from safetensors import SafetensorError, safe_open

    try:
        with safe_open(path, "pt") as file:
            said = json.loads(file.metadata()["state"])
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
        if said["what"] != what or any(f"params/{name}" not in tensors for name in state.params):
            raise InputError("is of another training", path, "remove it, or train as before")
        for group in _GROUPS:
            for name, value in getattr(state, group).items():
                value.data.copy_(tensors[f"{group}/{name}"])
        for name, value in state.params.items():
            moments = {k: tensors[f"{k}/{name}"] for k in _MOMENTS if f"{k}/{name}" in tensors}
            if moments:
                optimiser.state[value] = moments
        for name in _NUMBERS:
            setattr(state, name, type(getattr(state, name))(said[name]))
    except (SafetensorError, OSError, ValueError, KeyError, TypeError, RuntimeError) as error:
        raise InputError("is no checkpoint that can be taken up", path, "remove it to begin anew") from error
