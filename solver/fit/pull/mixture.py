"""Whether markers were placed on palpable landmarks: a mixture of "near landmark l" and "anywhere on the skin".

With the share w of markers that sit on a landmark, a marker at distance d_l from landmark l is (1 - w + w sum_l g_l)
times as likely as one put anywhere on a skin of area A, where g_l = A / (L 2 pi s^2) exp(-d_l^2 / 2 s^2): a Gaussian
of spread s along the skin about each of L landmarks, over the even density 1 / A.
"""

from __future__ import annotations

import numpy as np

MOST = 0.95
"""No layout is believed to be all on landmarks."""


def densities(distance: np.ndarray, spread: float, area: float) -> np.ndarray:
    """(M, L): how much likelier each marker's place is if it was put on that landmark than if it was put anywhere.

    Parameters
    ----------
    distance : (M, L) m; infinite where a pair cannot be
    spread : m, of hands and of what the fit misses, along each of the skin's two directions
    area : m^2 of skin that can carry markers
    """
    usual = area / (distance.shape[1] * 2 * np.pi * spread**2)
    return np.asarray(usual * np.exp(-0.5 * (distance / spread) ** 2))


def likelihood_ratio(given: np.ndarray) -> tuple[float, float]:
    """Natural logarithm of the greatest likelihood over that of no landmark at all, and the share w it is found at.

    Parameters
    ----------
    given : (M,) sum over the landmarks of :func:`densities`
    """
    if not len(given):
        return 0.0, 0.0
    gain = given - 1

    def slope(share: float) -> float:
        return float((gain / (1 + share * gain)).sum())

    # The logarithm is concave in the share, so its slope falls: the best share is where it crosses zero.
    low, high = 0.0, MOST
    if slope(low) <= 0:
        return 0.0, 0.0
    if slope(high) < 0:
        for _ in range(40):
            middle = (low + high) / 2
            low, high = (middle, high) if slope(middle) > 0 else (low, middle)
    else:
        low = high
    return float(np.log1p(low * gain).sum()), low


def expectation(given: np.ndarray, share: float) -> np.ndarray:
    """(M, L) probability that each marker sits on each landmark; no landmark is given away more than once.

    Parameters
    ----------
    given : (M, L) :func:`densities`
    share : of the markers that sit on some landmark
    """
    chance = share * given / (1 - share + share * given.sum(axis=1, keepdims=True))
    return np.asarray(chance / np.maximum(1, chance.sum(axis=0)))


def share_of(chance: np.ndarray) -> float:
    """The share of markers on landmarks, from their probabilities (M, L)."""
    return min(MOST, float(chance.sum()) / max(len(chance), 1))


def spread_of(chance: np.ndarray, distance: np.ndarray, believed: float, weight: float) -> float:
    """m, the spread about the landmarks that the hits show, blended with what was believed.

    Parameters
    ----------
    chance, distance : (M, L) probabilities, and m (infinite where a pair cannot be)
    believed : m
    weight : how many hits the belief counts as
    """
    squares = np.where(chance > 0, distance, 0.0) ** 2
    shown = float((chance * squares).sum()) / 2  # two directions along the skin
    return float(np.sqrt((shown + weight * believed**2) / (float(chance.sum()) + weight)))
