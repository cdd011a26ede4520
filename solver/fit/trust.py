"""How good the video's poses are in this trial, read off the joints that the markers hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.fit.state import FREE, Observations, State, Weights
from markerscope.solver.fit.terms.video_pose import bias_residual, video_residual

_BELIEVED_JOINTS = 2
"""What was believed before counts as much as this many joints do."""
_FEWEST_MARKERS = 2
_LEAST_DEG = 2.0


def believed(weights: Weights) -> Weights:
    """What is thought of a reconstruction before its trial is looked at; common postures then say little."""
    return replace(weights, anatomical=0.03, prior_deg=12.0, bias_deg=8.0, root_deg=25.0)


def trusted(seen: Observations, state: State, weights: Weights) -> Weights:
    """The weights with the spreads of the video's bias, and of its errors about it, as this trial has them.

    Parameters
    ----------
    seen, state : the keyframes and their solution
    weights : what is believed beforehand, which holds where few joints carry markers
    """
    carried = np.bincount(state.placement.weights.argmax(axis=1), minlength=24)[FREE] >= _FEWEST_MARKERS
    carried[0] = False
    watched = seen.tracked
    if not carried.any() or not watched.any():
        return weights
    bias = bias_residual(state)[carried]
    wander = video_residual(seen.prior, seen.tracked, state, weights)[0][watched][:, carried]
    return replace(
        weights,
        bias_deg=_blended(weights.bias_deg, bias),
        prior_deg=_blended(float(np.mean(weights.prior_deg)), np.sqrt((wander**2).mean(axis=0))),
    )


def _blended(believed_deg: float, found: np.ndarray) -> float:
    """Degrees: root mean square of what was believed and what was found (J, 3) rad."""
    squares = _BELIEVED_JOINTS * believed_deg**2 + np.degrees(1) ** 2 * (found**2).mean(axis=1).sum()
    return max(float(np.sqrt(squares / (_BELIEVED_JOINTS + len(found)))), _LEAST_DEG)
