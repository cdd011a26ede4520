"""What a capture does to markers: skin slides, cameras shake and lose them, nobody names them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.placement import Placement

_SLIDE = {
    "pelvis": 4.0,
    "spine3": 4.0,
    "head": 1.0,
    "shoulder": 5.0,
    "elbow": 3.0,
    "wrist": 1.5,
    "hip": 6.0,
    "knee": 4.0,
}
_SLIDE_ELSEWHERE = 2.0  # mm, standard deviation of skin sliding, by the last word of the bone's name above


@dataclass(frozen=True)
class Corruption:
    """What a capture does to marker paths.

    Attributes
    ----------
    slide : times the usual sliding of skin over bone (some 2 to 6 mm by bone, slow, partly shared and partly bound to
        the bending of the joint)
    jitter : m, white noise a coordinate
    lost : fraction of all samples that is missing, in gaps whose lengths have a heavy tail
    longest_gap : s
    """

    slide: float = 1.0
    jitter: float = 0.4e-3
    lost: float = 0.04
    longest_gap: float = 2.0


def corrupt(
    paths: np.ndarray,
    body: Body,
    betas: np.ndarray,
    motion: Motion,
    placement: Placement,
    rng: np.random.Generator,
    settings: Corruption | None = None,
) -> tuple[Markers, np.ndarray]:
    """Slide, shake, lose and shuffle marker paths (T, M, 3) m.

    Returns
    -------
    markers : with labels that mean nothing
    order : (M,) which marker of ``placement`` each of them is
    """
    settings = settings or Corruption()
    turns, _ = chain(motion.rotations, body.joints(betas), motion.trans)
    slide = settings.slide * sliding(motion, placement.joint, rng)
    noisy = paths + np.einsum("tmab,tmb->tma", turns[:, placement.joint], slide)
    noisy = noisy + rng.normal(0, settings.jitter, paths.shape)
    noisy[_gaps(paths.shape[:2], motion.rate, rng, settings)] = np.nan
    order = rng.permutation(paths.shape[1])
    labels = tuple(f"M{i + 1:02d}" for i in range(len(order)))
    return Markers(noisy[:, order], motion.rate, labels), order


def sliding(motion: Motion, joint: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """(T, M, 3) m, how skin slides over the bones of joints (M,), in each bone's axes."""
    from scipy.ndimage import gaussian_filter1d

    frames = len(motion.trans)

    def wander(count: int) -> np.ndarray:
        """(T, count, 3) of unit size, slow."""
        noise = gaussian_filter1d(rng.normal(size=(frames, count, 3)), 0.15 * motion.rate, axis=0)
        return noise / np.maximum(noise.std(axis=0), 1e-12)

    shared, own = wander(len(JOINTS)), wander(len(joint))
    # Bending away from the usual pose drags the skin, every marker in its own direction.
    trace = np.trace(motion.rotations, axis1=2, axis2=3)
    angle = np.arccos(np.clip((trace - 1) / 2, -1, 1))
    bent = angle - np.median(angle, axis=0)
    size = np.array([_SLIDE.get(JOINTS[j].split("_")[-1], _SLIDE_ELSEWHERE) for j in joint]) * 1e-3
    direction = rng.normal(size=(len(size), 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    bound = bent[:, joint, None] * direction
    return size[:, None] * (0.45 * shared[:, joint] + 0.35 * own + bound) / np.sqrt(3)


def _gaps(shape: tuple[int, int], rate: float, rng: np.random.Generator, settings: Corruption) -> np.ndarray:
    """(T, M) True where a marker is lost; some markers are lost far more often than others."""
    frames, count = shape
    lost = np.zeros(shape, dtype=bool)
    lengths = np.arange(1, max(2, min(int(settings.longest_gap * rate), frames // 2)) + 1)
    chance = (lengths + 0.6) ** -1.4
    chance /= chance.sum()
    prone = rng.gamma(0.7, size=count)
    prone /= prone.sum()
    while lost.mean() < settings.lost:
        marker, start = rng.choice(count, p=prone), rng.integers(frames)
        lost[start : start + rng.choice(lengths, p=chance), marker] = True
    return lost
