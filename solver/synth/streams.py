"""Random numbers by name, so that what is drawn for one purpose never shifts what is drawn for another."""

from __future__ import annotations

import zlib

import numpy as np


def stream(seed: int, name: str) -> np.random.Generator:
    """The generator of one purpose: the same for the same seed and name, independent of every other."""
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(name.encode())]))
