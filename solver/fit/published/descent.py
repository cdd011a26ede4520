"""L-BFGS as the paper uses it, with its iterations capped, reported and thinned into a trace."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.core.progress import Found, Progress, tell
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.fit.published.results import BodyState, Descent, Trace

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

_GRADIENT, _CHANGE = 1e-7, 1e-9
"""Tolerances of section 3.6: on first-order optimality, and on the change of value and parameters."""
_HISTORY = 100


def minimise(
    terms: Callable[[], Mapping[str, Tensor]],
    parameters: list[Tensor],
    body: Callable[[], BodyState],
    *,
    lr: float,
    iterations: int,
    progress: Progress,
    text: str,
    traced: int = 300,
) -> Descent:
    """Move ``parameters`` to where the sum of ``terms`` is least.

    Each line search satisfies the strong Wolfe conditions; its first step is ``lr`` (as in the authors' program).

    Parameters
    ----------
    terms : weighted terms at the parameters as they stand
    parameters : leaves with derivatives, changed in place
    body : the body at the parameters as they stand, for the trace
    lr, iterations : first step of each line search, and the cap
    progress, text : told before every evaluation, so that a caller can cancel between any two
    traced : at most so many frames' poses are kept in the trace
    """
    import torch

    optimizer = torch.optim.LBFGS(
        parameters,
        lr=lr,
        max_iter=1,
        max_eval=1 << 30,
        tolerance_grad=_GRADIENT,
        tolerance_change=_CHANGE,
        history_size=_HISTORY,
        line_search_fn="strong_wolfe",
    )
    done = evaluations = 0

    def closure() -> Tensor:
        nonlocal evaluations
        progress(done / iterations, text)
        evaluations += 1
        optimizer.zero_grad()
        total = sum(terms().values(), start=torch.zeros((), dtype=parameters[0].dtype))
        total.backward()
        return total

    trace = _Recorder(traced)
    energies = _values(terms)
    trace.add(0, energies, body())
    converged = False
    while done < iterations and not converged:
        # The next stop is twice as far along: what is worth seeing happens early.
        wanted = min(max(2 * done, 1), iterations) - done
        optimizer.param_groups[0]["max_iter"] = wanted
        optimizer.step(closure)
        taken = int(optimizer.state[parameters[0]]["n_iter"]) - done
        done += taken
        converged = taken < wanted
        energies = _values(terms)
        if taken:
            trace.add(done, energies, body())
            tell(progress, Found("iteration", done, {"text": text, "energy": sum(energies.values())}))
    progress(1.0, text)
    return Descent(energies, done, evaluations, converged, trace.finished())


def _values(terms: Callable[[], Mapping[str, Tensor]]) -> dict[str, float]:
    import torch

    with torch.no_grad():
        return {name: float(value) for name, value in terms().items()}


class _Recorder:
    """A trace while it grows."""

    def __init__(self, most: int) -> None:
        self.most = most
        self.iteration: list[int] = []
        self.energy: list[float] = []
        self.states: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
        self.frames = np.zeros(0, dtype=np.intp)

    def add(self, iteration: int, energies: Mapping[str, float], state: BodyState) -> None:
        count = len(state.trans)
        self.frames = np.unique(np.linspace(0, count - 1, min(count, self.most)).round().astype(np.intp))
        vectors = log_so3(state.rotations[self.frames]).astype(np.float32)
        self.iteration.append(iteration)
        self.energy.append(sum(energies.values()))
        self.states.append((vectors, state.trans[self.frames].astype(np.float32), state.betas))

    def finished(self) -> Trace:
        vectors, trans, betas = (np.stack(values) for values in zip(*self.states, strict=True))
        return Trace(np.array(self.iteration), np.array(self.energy), self.frames, vectors, trans, betas)
