"""Arms of average length: the rig's are some 8 % short for their stature.

Targets are joint-to-joint lengths over stature, means of men and women: de Leva 1996 (J Biomech 29:1223) gives 0.160
and 0.153, ANSUR's acromion-radiale and radiale-stylion lengths lead to 0.164 and 0.150.
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.core.skeleton import INDEX, descendants

TARGETS = {("shoulder", "elbow"): 0.161, ("elbow", "wrist"): 0.151}
"""Mean length of the bone between two joints over stature."""


def lengthen_arms(
    joints: np.ndarray, vertices: np.ndarray, weights: np.ndarray, stature: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Joints (N, 24, 3) and vertices (N, V, 3) in the T-pose, arms stretched along themselves by one factor for all."""
    joints, vertices = joints.copy(), vertices.copy()
    for (near, far), target in TARGETS.items():
        bones = [(INDEX[f"{side}_{near}"], INDEX[f"{side}_{far}"]) for side in ("left", "right")]
        lengths = [np.linalg.norm(joints[:, child] - joints[:, joint], axis=-1) for joint, child in bones]
        mean = np.mean(lengths / stature)
        share = target / mean - 1
        for joint, child in bones:
            bone = joints[:, child] - joints[:, joint]
            moved = descendants()[child]
            along = np.einsum("nvd,nd->nv", vertices - joints[:, joint, None], bone)
            along = np.clip(along / np.sum(bone * bone, axis=-1)[:, None], 0, 1)
            # The bone's own skin is stretched along it, skin beyond its far end moves whole.
            part = weights[:, joint] * along + weights[:, moved].sum(axis=1)
            vertices += share * part[..., None] * bone[:, None]
            joints[:, moved] += share * bone[:, None]
        print(f"{near} to {far}: {100 * mean:.2f} % of stature, stretched by {100 * share:.1f} %")
    return joints, vertices
