"""The rigidity of the markers as a matrix and a tree, cut anew while somebody drags."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.views.colours import Coloured, by_cluster
from markerscope.solver.clustering.segment import Segmentation, SegmentSettings, cut_at
from markerscope.solver.core.markers import Markers


@dataclass(frozen=True, eq=False)
class AffinityPicture:
    """Matrix and tree, by the names that ``AffinityView.set_data`` has for them.

    Attributes
    ----------
    matrix : (M, M) m, standard deviation of each pair's distance; NaN where never compared, even over other markers
    order : (U,) markers of the tree from left to right
    linkage : (U - 1, 4) as scipy writes it, heights in m
    labels : M names
    cut : m
    clusters : (M,) group of each marker, -1 for none
    marker_colours : (M, 3) uint8 by group
    leaves : (U,) the marker that each leaf of the tree is
    """

    matrix: np.ndarray
    order: np.ndarray
    linkage: np.ndarray
    labels: tuple[str, ...]
    cut: float
    clusters: np.ndarray
    marker_colours: np.ndarray
    leaves: np.ndarray


@dataclass(frozen=True, eq=False)
class Cut:
    """The groups that a cut leaves.

    Attributes
    ----------
    height : m
    clusters : (M,) group of each marker, -1 for none, hand edits made
    count : how many groups
    coloured : colours of the markers, and what they mean
    """

    height: float
    clusters: np.ndarray
    count: int
    coloured: Coloured


@dataclass(frozen=True, eq=False)
class PairDistance:
    """How far two markers are apart over time.

    Attributes
    ----------
    labels : their names
    time, distance : (T,) s and (T,) m, NaN where either is lost
    mean, deviation : m, over the frames that show both; NaN where there are none
    frames : how many show both
    affinity : m, what the tree was built on: the same deviation over the frames compared, or bridged
    bridged : True where the markers are seen together too rarely, and others stand in
    same_group : whether they are in one group now
    """

    labels: tuple[str, str]
    time: np.ndarray
    distance: np.ndarray
    mean: float
    deviation: float
    frames: int
    affinity: float
    bridged: bool
    same_group: bool


def affinity_picture(found: Segmentation, labels: tuple[str, ...]) -> AffinityPicture:
    """What the affinity view draws of M markers called ``labels``."""
    return AffinityPicture(
        matrix=found.affinity,
        order=found.order,
        linkage=found.linkage,
        labels=labels,
        cut=found.cut,
        clusters=found.clusters,
        marker_colours=by_cluster(found.clusters).colours,
        leaves=found.leaves,
    )


def recut(found: Segmentation, settings: SegmentSettings, height: float) -> Cut:
    """The groups that the same tree has when it is cut at ``height`` m; hand edits are made again.

    Parameters
    ----------
    settings : that ``found`` was made with
    """
    clusters = cut_at(found, settings, height)
    return Cut(height, clusters, int(clusters.max(initial=-1)) + 1, by_cluster(clusters))


def cut_for(found: Segmentation, groups: int) -> float:
    """The height, m, at which the tree falls into so many groups before hand edits: half way between two joins."""
    joins = np.concatenate([[0.0], np.sort(found.linkage[:, 2])])
    made = len(joins) - int(np.clip(groups, 1, len(joins)))
    above = joins[made + 1] if made + 1 < len(joins) else 1.5 * joins[made] + 1e-3
    return float(0.5 * (joins[made] + above))


def pair_distance(found: Segmentation, markers: Markers, one: int, other: int) -> PairDistance:
    """Distance of two markers over time."""
    distance = np.linalg.norm(markers.positions[:, one] - markers.positions[:, other], axis=1)
    known = distance[np.isfinite(distance)]
    mean, deviation = (float(known.mean()), float(known.std())) if len(known) else (float("nan"), float("nan"))
    return PairDistance(
        labels=(markers.labels[one], markers.labels[other]),
        time=markers.time,
        distance=distance,
        mean=mean,
        deviation=deviation,
        frames=len(known),
        affinity=float(found.affinity[one, other]),
        bridged=not found.measured[one, other],
        same_group=bool(found.clusters[one] >= 0 and found.clusters[one] == found.clusters[other]),
    )
