"""What a set of marked bones is called."""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import JOINTS, PARTS

_MOST, _FAR = 0.6, 1 / 3
"""The share of the markers that names a part, and the share beyond a limb's first bone that makes it that limb."""


def part_name(bone: np.ndarray) -> str:
    """The part of the body that carries most of the markers, in words."""
    carried = {JOINTS[b] for b in bone}
    if len(carried) > 8 or ({"left", "right"} <= {name.split("_")[0] for name in carried} and len(carried) > 4):
        return "whole body" if len(carried) > 10 else "several parts"
    shares = {part: np.mean([JOINTS[b] in names for b in bone]) for part, names in PARTS.items()}
    # An arm with a marker on the acromion is an arm as long as its forearm carries its share.
    far = {part: np.mean([JOINTS[b] in names[1:] for b in bone]) for part, names in PARTS.items()}
    limbs = [part for part in PARTS if not part.endswith("shoulder") and shares[part] >= _MOST and far[part] >= _FAR]
    best = max(limbs or PARTS, key=lambda part: shares[part])
    return best.replace("_", " ") if shares[best] >= _MOST else ", ".join(sorted(carried)).replace("_", " ")
