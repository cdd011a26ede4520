"""A marker set learnt from one labelled trial: where on the fitted body each named marker sits."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.fit.kinematics import Points, Pose, blended_turn, forward, place_points
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.markerset.marker_set import MarkerSet, SetMarker

_MOST_FRAMES = 120
_LOOKED_AT = 12
_LEAST_SEEN = 5
_FAR_M = 0.08
"""A trajectory whose place on the body wanders by more is no marker on it."""
_SPREAD_M = 0.010
_RIGID_M, _PLATE_MARKERS = 0.003, 3


def learn_from_motion(body: Body, markers: Markers, motion: FittedMotion, name: str, source: str = "") -> MarkerSet:
    """The set of a solved trial.

    A marker's place is the one at rest that, carried by the skin below it, comes nearest to its measured trajectory:
    the median over frames, so that a stretch under a wrong name does not move it.

    Parameters
    ----------
    markers : the trial, with the names that are to be learnt
    motion : the body fitted to it; markers that the fit left out are learnt too where they keep to the body

    Raises
    ------
    InputError : hardly any marker keeps to the body
    """
    pose = Pose(motion.rotations, motion.trans, motion.betas)
    return learn_from_pose(body, markers, pose, name, source)


def learn_from_pose(
    body: Body, markers: Markers, pose: Pose, name: str, source: str = "", said: tuple[str, ...] = ()
) -> MarkerSet:
    """The set of a trial whose poses, one a frame, are known; ``said`` goes first among its notes."""
    frames = np.unique(np.linspace(0, len(pose.trans) - 1, _MOST_FRAMES).astype(int))
    some = pose.at(frames)
    positions = markers.positions[frames]
    found: list[SetMarker] = []
    left_out: list[str] = []
    skin = Skin(body, pose.betas)
    looked = np.unique(np.linspace(0, len(frames) - 1, _LOOKED_AT).astype(int))
    vertices, _ = body.pose(some.rotations[looked], some.betas, some.trans[looked])
    surfaces = vertices[:, skin.index]
    for m, label in enumerate(markers.labels):
        seen = np.isfinite(positions[:, m]).all(axis=1)
        if seen.sum() < _LEAST_SEEN:
            left_out.append(label)
            continue
        vertex = _vertex(body, some.at(seen), positions[seen, m], skin, surfaces, positions[looked, m])
        place, strays = _place(body, some, seen, positions[:, m], vertex)
        if strays > _FAR_M:
            left_out.append(label)
            continue
        bone = int(body.weights[vertex].argmax())
        found.append(SetMarker(label, bone, tuple(np.round(place, 5).tolist()), max(_SPREAD_M, round(strays, 4))))
    if len(found) < 3:
        raise InputError("hardly any named marker keeps to the body", source or markers.source, "check the trial")
    notes = (f"Not on the body, or hardly seen, and left out: {', '.join(left_out)}.",) if left_out else ()
    plates = _plates(markers, found)
    named = tuple(SetMarker(m.name, m.bone, m.place, m.spread, plates.get(m.name, "")) for m in found)
    shape = tuple(np.round(pose.betas, 4).tolist())
    return MarkerSet(name, named, shape, "learnt", source or markers.source, (*said, *notes))


def _vertex(body: Body, pose: Pose, track: np.ndarray, skin: Skin, surfaces: np.ndarray, looked: np.ndarray) -> int:
    """The vertex that a trajectory stays nearest to in a constant offset: of those often nearest, the steadiest.

    Parameters
    ----------
    pose, track : the frames in which it is seen, and (F, 3) m where
    surfaces, looked : (K, V, 3) m the skin in some frames, and (K, 3) m the marker in them, NaN = lost
    """
    near: set[int] = set()
    for surface, point in zip(surfaces, looked):
        if not np.isfinite(point).all():
            continue
        away = ((surface - point) ** 2).sum(axis=1)
        near |= {int(skin.index[i]) for i in np.argpartition(away, 3)[:3]}
    if not near:
        near = {int(skin.index[0])}
    chosen = np.array(sorted(near))
    points = Points.of_vertices(body, chosen)
    links = forward(body, pose)
    off = track[:, None] - place_points(points, links, pose.betas)  # (F, V, 3)
    local = np.einsum("fvba,fvb->fva", blended_turn(points, links), off)
    middle = np.median(local, axis=0)
    # Steady in the skin's own frame, and near to it.
    wander = np.median(np.linalg.norm(local - middle, axis=2), axis=0) + 0.2 * np.linalg.norm(middle, axis=1)
    return int(chosen[wander.argmin()])


def _place(body: Body, pose: Pose, seen: np.ndarray, track: np.ndarray, vertex: int) -> tuple[np.ndarray, float]:
    """(3,) m on the shaped rest body, and how far the trajectory strays from it in the median frame, m."""
    some = pose.at(seen)
    own = forward(body, some)
    point = Points.of_vertices(body, np.array([vertex]))
    off = track[seen] - place_points(point, own, pose.betas)[:, 0]
    local = np.linalg.solve(blended_turn(point, own)[:, 0], off[..., None])[..., 0]
    middle = np.median(local, axis=0)
    strays = float(np.median(np.linalg.norm(local - middle, axis=1)))
    return point.shaped(pose.betas)[0] + middle, strays


def _plates(markers: Markers, found: list[SetMarker]) -> dict[str, str]:
    """Markers of one bone whose distances hold within some millimetres: a rigid plate, named after its bone."""
    from markerscope.solver.core.skeleton import BONES, JOINTS

    plates: dict[str, str] = {}
    column = {label: m for m, label in enumerate(markers.labels)}
    for bone in sorted({marker.bone for marker in found}):
        names = [marker.name for marker in found if marker.bone == bone]
        tracks = markers.positions[:, [column[name] for name in names]]
        spread = np.nanstd(np.linalg.norm(tracks[:, :, None] - tracks[:, None], axis=3), axis=0)
        rigid = spread < _RIGID_M
        left = set(range(len(names)))
        number = 0
        while left:
            # the largest group in which every pair keeps its distance, greedily from the best connected
            seed = max(left, key=lambda i: int(rigid[i, sorted(left)].sum()))
            group = [seed]
            for i in sorted(left - {seed}, key=lambda i: float(spread[seed, i])):
                if all(rigid[i, g] for g in group):
                    group.append(i)
            left -= set(group)
            if len(group) >= _PLATE_MARKERS:
                number += 1
                plates |= {names[i]: f"{BONES[JOINTS[bone]]}_{number}" for i in group}
    return plates
