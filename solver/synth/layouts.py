"""Named marker sets: the places where laboratories put markers, found on the shaped body by its landmarks."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX, PARTS
from markerscope.solver.synth.sites import Sites, sites_at

_REACH = 0.25  # m, how far from a bone its skin is looked for

_TRUNK = ("c7", "t8", "sternum_ij", "sternum_px", "right_scapula")
_HEAD = ("left_front_head", "right_front_head", "left_back_head", "right_back_head")
_PELVIS = ("left_asis", "right_asis", "left_psis", "right_psis")
_ARM = ("upper_arm", "elbow_lateral", "elbow_medial", "forearm", "wrist_radius", "wrist_ulna", "hand_meta3")
_LEG = ("thigh", "knee_lateral", "knee_medial", "shank", "ankle_lateral", "ankle_medial", "calcaneus", "meta1", "meta5")

_TRUNK_IOR = ("c7", "t8", "sternum_ij", "sternum_px", "left_acromion", "right_acromion")
_ARM_PIG = ("acromion", "upper_arm", "elbow_lateral", "forearm", "wrist_radius", "wrist_ulna", "hand_meta2")
_LEG_PIG = ("thigh", "knee_lateral", "shank", "ankle_lateral", "calcaneus", "forefoot")
_LEG_IOR = ("trochanter", "knee_lateral", "fibula_head", "tibial_tuberosity", "ankle_lateral", "calcaneus", "meta1",
            "meta5")  # fmt: skip
_LEG_CAST = ("thigh_high", "thigh", "thigh_front", "thigh_low", "shank_high", "shank", "shin", "shank_low",
             "calcaneus", "meta1", "meta5")  # fmt: skip


def _sided(side: str, names: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(f"{side}_{name}" for name in names)


LAYOUTS: dict[str, tuple[str, ...]] = {
    "full_body": (
        *_HEAD,
        *_TRUNK,
        *_PELVIS,
        *(place for side in ("left", "right") for place in _sided(side, ("acromion", *_ARM, *_LEG))),
    ),
    "plug_in_gait": (
        *_HEAD,
        *_TRUNK,
        *_PELVIS,
        *(place for side in ("left", "right") for place in _sided(side, (*_ARM_PIG, *_LEG_PIG))),
    ),
    "ior": (*_TRUNK_IOR, *_PELVIS, *_sided("left", _LEG_IOR), *_sided("right", _LEG_IOR)),
    "cast": (*_PELVIS, *_sided("left", _LEG_CAST), *_sided("right", _LEG_CAST)),
    **{f"{side}_arm": _sided(side, (*_ARM, "triceps", "forearm_back", "thumb_side")) for side in ("left", "right")},
    **{f"{side}_leg": _sided(side, (*_LEG, "thigh_front", "shin", "hallux")) for side in ("left", "right")},
    **{
        f"{side}_shoulder": (
            *("t8", "sternum_ij", "sternum_px"),
            *_sided(side, ("acromion", "clavicle", "scapula", "upper_arm", "triceps")),
            *_sided(side, ("elbow_lateral", "elbow_medial", "forearm")),
        )
        for side in ("left", "right")
    },
}
"""Places of each layout: landmarks of the body, or places of the table below.

``plug_in_gait`` is the conventional gait model's whole body (Kadaba et al. 1990, Davis et al. 1991), with T8 for T10;
``ior`` the lower limbs of Leardini et al. (2007) and a trunk; ``cast`` clusters on thigh and shank as Cappozzo et al.
(1995) have them, with no marker on an epicondyle or a malleolus.
"""

_OUT, _FRONT, _BACK, _UP = (1.0, 0, 0), (0, 0, 1.0), (0, 0, -1.0), (0, 1.0, 0)
_BESIDE: dict[str, tuple[str, str, float, tuple[float, float, float]]] = {
    "upper_arm": ("shoulder", "elbow", 0.5, (0, 0.8, 0.2)),
    "triceps": ("shoulder", "elbow", 0.65, _BACK),
    "forearm": ("elbow", "wrist", 0.5, (0, 0.7, -0.5)),
    "forearm_back": ("elbow", "wrist", 0.35, _BACK),
    "thumb_side": ("wrist", "hand", 0.6, (0, 0.5, 1.0)),
    "thigh": ("hip", "knee", 0.6, (1.0, 0, 0.2)),
    "thigh_front": ("hip", "knee", 0.45, _FRONT),
    "trochanter": ("hip", "knee", 0.05, _OUT),
    "thigh_high": ("hip", "knee", 0.35, _OUT),
    "thigh_low": ("hip", "knee", 0.75, _OUT),
    "shank": ("knee", "ankle", 0.5, (1.0, 0, 0.2)),
    "shank_high": ("knee", "ankle", 0.25, _OUT),
    "shank_low": ("knee", "ankle", 0.75, _OUT),
    "forefoot": ("foot", "foot", 0.0, _UP),
    "shin": ("knee", "ankle", 0.4, (0.2, 0, 1.0)),
    "hallux": ("foot", "foot", 0.0, (-0.3, 0.1, 1.0)),
    "clavicle": ("collar", "shoulder", 0.4, (0, 0.6, 0.8)),
    "scapula": ("collar", "shoulder", 0.3, (0, -0.4, -1.0)),
    "front_head": ("head", "head", 0.0, (0.6, 1.1, 0.9)),
    "back_head": ("head", "head", 0.0, (0.6, 1.0, -0.9)),
}
"""Places beside a bone: from a point between two joints outward, on the left of the rest body (x left, y up)."""


def named_sites(body: Body, betas: np.ndarray, layout: str, part: str | None = None) -> Sites:
    """The sites of a layout, those on the bones of a part only where one is named."""
    names = LAYOUTS[layout]
    vertices = np.array([place_vertex(body, betas, name) for name in names])
    corners = body.faces[[int(np.flatnonzero((body.faces == v).any(axis=1))[0]) for v in vertices]]
    sites = sites_at(body, betas, corners, (corners == vertices[:, None]).astype(float))
    if part is None:
        return sites
    return sites.select(np.flatnonzero(np.isin(sites.joint, [INDEX[name] for name in PARTS[part]])))


def place_vertex(body: Body, betas: np.ndarray, name: str) -> int:
    """The skin vertex where a marker can sit that is nearest to a named place."""
    surface = body.surface(betas)
    allowed = np.flatnonzero(body.marker_mask)
    if name in body.landmark_names:
        return int(allowed[np.linalg.norm(surface[allowed] - body.landmarks(betas)[name], axis=1).argmin()])
    side, _, place = name.partition("_")
    a, b, share, direction = _BESIDE[place]
    joints = body.joints(betas)
    ends = [joints[INDEX[joint if joint in INDEX else f"{side}_{joint}"]] for joint in (a, b)]
    outward = np.array(direction) * (1 if side == "left" else -1, 1, 1)
    outward /= np.linalg.norm(outward)
    away = surface[allowed] - ((1 - share) * ends[0] + share * ends[1])
    along = away @ outward
    near = (along > 0) & (np.linalg.norm(away, axis=1) < _REACH) & (body.normals(betas)[allowed] @ outward > 0.3)
    off = np.linalg.norm(away - along[:, None] * outward, axis=1)
    return int(allowed[np.where(near, off, np.inf).argmin()])
