"""How far one motion is from another: errors of joints, surfaces, markers and angles.

Everything is in metres, seconds and radians; figures for people are made of them at the edge. Frames or points that
are NaN on either side do not count.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import kabsch, slerp

_FRAMES_AT_ONCE = 16


@dataclass(frozen=True, eq=False)
class PointErrors:
    """Distances between corresponding points, or between their velocities.

    Attributes
    ----------
    mean : over all points and frames, m (or m/s)
    per_point : (N,) means over the frames
    per_frame : (T,) means over the points
    """

    mean: float
    per_point: np.ndarray
    per_frame: np.ndarray


@dataclass(frozen=True)
class AngleDifference:
    """One angle against another.

    Attributes
    ----------
    rmse : rad, root mean square difference
    rmse_less_offset : rad, the same once the mean difference is taken away
    offset : rad, mean difference
    share : of the frames that could be compared, 0..1
    """

    rmse: float
    rmse_less_offset: float
    offset: float
    share: float


def mpjpe(found: np.ndarray, reference: np.ndarray) -> PointErrors:
    """Mean per-joint position error (m) of (T, J, 3) joints. The same over vertices is V2V."""
    return _errors(np.linalg.norm(found - reference, axis=2))


def v2v(found: np.ndarray, reference: np.ndarray) -> PointErrors:
    """Mean vertex-to-vertex error (m) of two posed meshes (T, V, 3) of one topology."""
    return mpjpe(found, reference)


def mpjve(found: np.ndarray, reference: np.ndarray, time: np.ndarray) -> PointErrors:
    """Mean per-joint velocity error (m/s) of (T, J, 3) joints.

    A velocity is the difference of adjacent poses over the time (T,) s between them; the error is the length of the
    difference of the two velocity vectors.
    """
    steps = np.diff(time)[:, None, None]
    return _errors(np.linalg.norm(np.diff(found - reference, axis=0) / steps, axis=2))


def pa_mpjpe(found: np.ndarray, reference: np.ndarray) -> PointErrors:
    """MPJPE (m) once each frame of ``found`` has been turned, shifted and scaled onto ``reference``, both (T, J, 3)."""
    a = found - found.mean(axis=1, keepdims=True)
    centre = reference.mean(axis=1, keepdims=True)
    b = reference - centre
    good = np.isfinite(a).all(axis=(1, 2)) & np.isfinite(b).all(axis=(1, 2))
    aligned = np.full_like(reference, np.nan)
    a, b = a[good], b[good]
    turned = a @ kabsch(a, b).transpose(0, 2, 1)
    scale = np.einsum("tjk,tjk->t", turned, b) / np.maximum(np.einsum("tjk,tjk->t", a, a), 1e-300)
    aligned[good] = scale[:, None, None] * turned + centre[good]
    return mpjpe(aligned, reference)


def angle_difference(found: np.ndarray, reference: np.ndarray) -> AngleDifference:
    """Compare two angles (T,) rad frame by frame; a whole turn between them is no difference."""
    difference = found - reference
    valid = np.isfinite(difference)
    if not valid.any():
        return AngleDifference(np.nan, np.nan, np.nan, 0.0)
    difference = difference[valid]
    middle = np.angle(np.exp(1j * difference).mean())
    about = middle + _wrapped(difference - middle)
    return AngleDifference(
        rmse=float(np.sqrt(np.mean(_wrapped(difference) ** 2))),
        rmse_less_offset=float(np.std(about)),
        offset=float(about.mean()),
        share=float(valid.mean()),
    )


def marker_to_surface(
    markers: np.ndarray,
    vertices: np.ndarray | Callable[[np.ndarray], np.ndarray],
    faces: np.ndarray,
    *,
    signed: bool = False,
    progress: Progress = silent,
) -> np.ndarray:
    """Distance of every marker to the body's surface, frame by frame; its mean is m2s.

    Parameters
    ----------
    markers : (T, M, 3) m, NaN = lost
    vertices : (T, V, 3) m, or a function that gives those of the frames (n,) asked for, some at a time
    faces : (F, 3) vertex indices, outward orientation
    signed : negative inside the body
    progress : called along the way

    Returns
    -------
    (T, M) m, NaN where the marker or the body is lost
    """
    surface = vertices if callable(vertices) else vertices.__getitem__
    distance = np.full(markers.shape[:2], np.nan)
    for start in range(0, len(markers), _FRAMES_AT_ONCE):
        chunk = np.arange(start, min(start + _FRAMES_AT_ONCE, len(markers)))
        for frame, mesh in zip(chunk, surface(chunk)):
            seen = np.isfinite(markers[frame]).all(axis=1)
            if seen.any() and np.isfinite(mesh).all():
                distance[frame, seen] = distance_to_mesh(markers[frame][seen], mesh, faces, signed=signed)
        progress((start + len(chunk)) / len(markers), "measuring markers to the surface")
    return distance


def distance_to_mesh(
    points: np.ndarray, vertices: np.ndarray, faces: np.ndarray, *, signed: bool = False
) -> np.ndarray:
    """(N,) m from points (N, 3) to a mesh (V, 3), (F, 3).

    The sign, negative inside, is that of the smooth normal at the nearest point, so that an open mouth does no harm.
    """
    import open3d as o3d

    centre = vertices.mean(axis=0)  # Open3D computes in float32: stay near the origin
    scene = o3d.t.geometry.RaycastingScene()
    scene.add_triangles(
        o3d.core.Tensor.from_numpy((vertices - centre).astype(np.float32)),
        o3d.core.Tensor.from_numpy(faces.astype(np.uint32)),
    )
    nearest = scene.compute_closest_points(o3d.core.Tensor.from_numpy((points - centre).astype(np.float32)))
    uv = nearest["primitive_uvs"].numpy().astype(float)
    triangle = faces[nearest["primitive_ids"].numpy().astype(np.intp)]
    shares = np.stack([1 - uv.sum(axis=1), uv[:, 0], uv[:, 1]], axis=1)
    away = points - np.einsum("nk,nkx->nx", shares, vertices[triangle])
    distance = np.linalg.norm(away, axis=1)
    if not signed:
        return distance
    from markerscope.solver.core.meshes import vertex_normals

    normal = np.einsum("nk,nkx->nx", shares, vertex_normals(vertices, faces)[triangle])
    return np.copysign(distance, np.einsum("nx,nx->n", away, normal))


def points_at(time: np.ndarray, points: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(W, ...) values of ``points`` (T, ...) at the times ``wanted`` (W,) s, linear between frames, NaN outside."""
    if len(time) == 1:
        inside = np.isclose(wanted, time[0])
        return np.where(inside.reshape(-1, *[1] * (points.ndim - 1)), points[0], np.nan)
    right = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
    share = (wanted - time[right - 1]) / (time[right] - time[right - 1])
    shape = (-1, *[1] * (points.ndim - 1))
    before, after = points[right - 1], points[right]
    share = share.reshape(shape)
    # a frame met exactly does not depend on its neighbour, which may be lost
    between = np.where(share == 0, before, np.where(share == 1, after, before + share * (after - before)))
    return np.where(_inside(time, wanted).reshape(shape), between, np.nan)


def rotations_at(time: np.ndarray, rotations: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """(W, J, 3, 3) rotations at the times ``wanted`` (W,) s, slerp between frames (T, J, 3, 3), NaN outside."""
    return np.where(_inside(time, wanted)[:, None, None, None], slerp(rotations, time, wanted), np.nan)


def nanmean(values: np.ndarray) -> float:
    """Mean of what is finite; NaN, without a warning, where nothing is."""
    return float(values[np.isfinite(values)].mean()) if np.isfinite(values).any() else np.nan


def nanmean_along(values: np.ndarray, axis: int) -> np.ndarray:
    """Means of what is finite along an axis; NaN, without a warning, where nothing is."""
    finite = np.isfinite(values)
    count = finite.sum(axis=axis)
    return np.where(count > 0, np.where(finite, values, 0).sum(axis=axis) / np.maximum(count, 1), np.nan)


def _errors(distances: np.ndarray) -> PointErrors:
    return PointErrors(nanmean(distances), nanmean_along(distances, 0), nanmean_along(distances, 1))


def _wrapped(angle: np.ndarray) -> np.ndarray:
    return (angle + np.pi) % (2 * np.pi) - np.pi


def _inside(time: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """True within the recording, ends included up to rounding."""
    return (wanted >= time[0] - 1e-9) & (wanted <= time[-1] + 1e-9)
