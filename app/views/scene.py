"""The 3D scene at one frame: markers with colours, trails, and lines to where they belong."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.colours import ColourBy, Coloured, by_bone, by_cluster, by_residual, by_selection, by_state
from markerscope.app.views.skin import by_skin
from markerscope.app.views.tracks import MarkerTracks
from markerscope.solver.clustering.segment import Segmentation
from markerscope.solver.fit.results import FittedMotion

_NEAR_M, _REACH_M = 0.1, 0.2
"""How far a marker may be out of where nearly all are, and how far the body reaches beyond its joints."""


@dataclass(frozen=True, eq=False)
class Lines:
    """Straight lines from ``start`` to ``end``, both (N, 3) m, and what each belongs to (N,)."""

    start: np.ndarray
    end: np.ndarray
    owner: np.ndarray


@dataclass(frozen=True, eq=False)
class SceneMarkers:
    """Markers of one frame.

    Attributes
    ----------
    positions : (M, 3) m, NaN where there is nothing to draw
    coloured : their colours (M, 3) uint8, and what these mean
    """

    positions: np.ndarray
    coloured: Coloured


def markers_at(
    tracks: MarkerTracks,
    frame: int,
    by: ColourBy,
    *,
    segmentation: Segmentation | None = None,
    clusters: np.ndarray | None = None,
    motion: FittedMotion | None = None,
    bones: np.ndarray | None = None,
    selected: Collection[int] = (),
    skin: np.ndarray | None = None,
) -> SceneMarkers:
    """The markers of one frame.

    Colours that need a result which is not there yet fall back to the gap state. Lost markers are drawn only where the
    colours tell that they are lost.

    Parameters
    ----------
    clusters : (M,) groups while a cut is being dragged, instead of the segmentation's
    bones : (M,) bones of another answer than the fit's, -1 for none
    skin : (M,) m, signed distance of the markers to the skin in this frame
    """
    if clusters is None and segmentation is not None:
        clusters = segmentation.clusters
    if bones is None and motion is not None:
        bones = motion.marker_joint
    if by == "cluster" and clusters is not None:
        coloured = by_cluster(clusters)
    elif by == "bone" and bones is not None:
        coloured = by_bone(bones)
    elif by == "residual" and motion is not None:
        coloured = by_residual(motion.residual[frame])
    elif by == "skin" and skin is not None:
        coloured = by_skin(skin)
    elif by == "selection":
        coloured = by_selection(tracks.state.shape[1], selected)
    else:
        return SceneMarkers(tracks.complete(frame), by_state(tracks.state[frame]))
    return SceneMarkers(tracks.seen(frame), coloured)


def trails(tracks: MarkerTracks, frame: int, seconds: float = 0.5, most: int = 24) -> np.ndarray:
    """(k, M, 3) m, where the markers were in the ``seconds`` up to a frame, oldest first, at most ``most`` points."""
    back = min(frame, round(seconds * tracks.markers.rate))
    step = max(1, -(-back // (most - 1)))
    # Counted back from the frame itself, so that a trail always ends at its marker.
    return tracks.markers.positions[np.arange(frame, frame - back - 1, -step)[::-1]]


def ties(tracks: MarkerTracks, body: BodyTrack, frame: int) -> Lines:
    """From each marker that is seen to the skin it sits on."""
    here = tracks.seen(frame)
    return misses(here, body.skin_places(tracks.time(frame), len(here)))


def misses(here: np.ndarray, places: np.ndarray) -> Lines:
    """From each marker (M, 3) m that is seen to where a body says its centre is (M, 3): as long as its residual."""
    drawn = np.flatnonzero(np.isfinite(here).all(axis=1) & np.isfinite(places).all(axis=1))
    return Lines(here[drawn], places[drawn], drawn)


def middle(tracks: MarkerTracks, frame: int) -> np.ndarray:
    """(3,) m, the median marker: what a camera that follows looks at; NaN where none is seen."""
    here = tracks.seen(frame)
    here = here[np.isfinite(here).all(axis=1)]
    return np.median(here, axis=0) if len(here) else np.full(3, np.nan)


def extent(tracks: MarkerTracks, most: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner (3,) m of where the markers are over the session, less the odd ghost."""
    points = _over_the_session(tracks, most)
    if not len(points):
        return np.zeros(3), np.zeros(3)
    low, high = np.percentile(points, [0.5, 99.5], axis=0)
    return low, high


def outline(tracks: MarkerTracks, track: BodyTrack | None = None, most: int = 60) -> np.ndarray:
    """(N, 3) m, what a picture of the whole session has to show: the markers, less the odd ghost, and the body."""
    low, high = extent(tracks)
    points = _over_the_session(tracks, most)
    points = points[((points >= low - _NEAR_M) & (points <= high + _NEAR_M)).all(axis=1)]
    if track is None:
        return points
    frames = _spread(len(track.times), most)
    joints = track.body.pose(track.rotations[frames], track.betas, track.trans[frames], want_vertices=False)[1]
    reach = np.array([[0.0, 0.0, _REACH_M], [0.0, 0.0, -_REACH_M]])  # the crown above, the soles below
    return np.concatenate([points, (joints.reshape(-1, 1, 3) + reach).reshape(-1, 3)])


def _over_the_session(tracks: MarkerTracks, most: int) -> np.ndarray:
    """(N, 3) m, where markers are in some frames."""
    points = tracks.markers.positions[_spread(len(tracks.state), most)].reshape(-1, 3)
    return points[np.isfinite(points).all(axis=1)]


def _spread(count: int, most: int) -> np.ndarray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(int))
