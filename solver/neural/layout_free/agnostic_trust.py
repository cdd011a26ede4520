"""How far the network's poses can be trusted with given markers, and those poses put together with others by that."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Ready
from markerscope.solver.neural.training.library import procedural_clips

if TYPE_CHECKING:
    from markerscope.solver.neural.training.examples import Sampler

_CLIPS, _FRAMES, _SECONDS = 24, 512, 4.0
_UNLIKE = 5.0
"""Times as far off as on made motions: people, their skin and what a solve believes of their bodies are unlike these.
Found on four synthetic sessions of recorded movements."""


@dataclass(frozen=True, eq=False)
class Blend:
    """Poses put together from the network's and others.

    Attributes
    ----------
    rotations : (T, 24, 3, 3)
    share : (24,) how much the network counts, 0..1
    spread_deg : (24,) how far each joint is expected to be off
    """

    rotations: np.ndarray
    share: np.ndarray
    spread_deg: np.ndarray


def expected_errors(ready: Ready, body: Body, person: Marked, seed: int = 0) -> np.ndarray:
    """(24, 3, 3) rad2: what the network gets wrong at each joint with these very markers, about the joint's own axes.

    Measured on made motions of this body, its markers slid and misplaced as a fit's are. What no marker tells of, such
    as a forearm's without markers, or the twist of an upper arm above it, comes out as uncertain as it is.
    """
    import torch

    from markerscope.solver.neural.layout_free.agnostic_examples import Spoiling, one_person
    from markerscope.solver.neural.training.examples import generator

    task = one_person(
        made_poses(body, seed), person, _FRAMES, generator(seed), Spoiling(slide=5e-3, lost=0.05, far=0.0)
    )
    with torch.no_grad():
        found = ready.network(ready.params, task.frames)[-1].local.numpy().astype(float)
    return spread_of_errors(found, task.local.numpy().astype(float))


def made_poses(body: Body, seed: int = 0) -> Sampler:
    """Made motions that no network has learnt from, to try one on."""
    from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool

    clips = procedural_clips(_CLIPS, 1000 + seed, seconds=_SECONDS)
    return Sampler(clips, body_pool(body, 0, seed), ExampleSettings().plain())


def spread_of_errors(found: np.ndarray, true: np.ndarray) -> np.ndarray:
    """(24, 3, 3) rad2 to be expected of a recording, from rotations (T, 24, 3, 3) found in made motions."""
    off = log_so3(np.swapaxes(true, -1, -2) @ found)
    return np.asarray(_UNLIKE**2 * np.einsum("tja,tjb->jab", off, off) / len(off))


def blended(network: np.ndarray, other: np.ndarray, errors: np.ndarray, other_deg: float) -> Blend:
    """Joint by joint the most likely rotation, of two that err independently.

    Parameters
    ----------
    network, other : (T, 24, 3, 3), the root in the lab, others relative to the parent
    errors : (24, 3, 3) rad2 of the network's
    other_deg : degrees, spread of the other's about each axis
    """
    variance = np.radians(other_deg) ** 2
    gain = variance * np.linalg.inv(errors + variance * np.eye(3))
    apart = log_so3(np.swapaxes(other, -1, -2) @ network)
    rotations = other @ exp_so3(np.einsum("jab,tjb->tja", gain, apart))
    left = np.trace(gain @ errors, axis1=1, axis2=2) / 3
    share = np.trace(gain, axis1=1, axis2=2) / 3
    assert len(share) == len(JOINTS)
    return Blend(rotations, share, np.degrees(np.sqrt(np.maximum(left, 0))))
