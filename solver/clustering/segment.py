"""Markers that move rigidly together: the groups that stand for bones.

Milef et al. (2024), section 3.4.1: the affinity of two markers is the standard deviation of their distance over time;
average linkage cuts the tree at a threshold. Lost markers are left out of the sums here, never taken as zeros.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.clustering.affinity import Affinity, affinity, bridged
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, part_of, silent


@dataclass(frozen=True)
class SegmentSettings:
    """How markers are grouped, and what was decided by hand.

    Attributes
    ----------
    threshold : m, average standard deviation of distance at which the tree is cut. The paper's 0.005 splits bones
        under ordinary skin motion; 0.008 to 0.010 does not
    groups : cut into this many groups instead, None to go by the threshold
    far : m, pairs further apart than this on average are held apart; 0 switches it off. Two planted feet keep their
        distance as well as two markers of one foot do
    far_penalty : m of affinity added per m beyond ``far``
    max_frames : at most so many frames, evenly spaced, enter the affinity
    min_overlap : pairs seen together in fewer of these frames are bridged by way of other markers
    merges : each a tuple of markers whose groups become one
    splits : each a tuple of markers that leave their groups and form one of their own
    moves : (marker, host) pairs: the marker joins the host's group
    left_out : markers that belong to no group

    Edits name markers by column and are made after the cut, in the order merges, splits, moves, left_out.
    """

    threshold: float = 0.008
    groups: int | None = None
    far: float = 0.35
    far_penalty: float = 0.1
    max_frames: int = 5000
    min_overlap: int = 10
    merges: tuple[tuple[int, ...], ...] = ()
    splits: tuple[tuple[int, ...], ...] = ()
    moves: tuple[tuple[int, int], ...] = ()
    left_out: tuple[int, ...] = ()


@dataclass(frozen=True, eq=False)
class Segmentation:
    """Groups of markers, with all that they were made from.

    Attributes
    ----------
    affinity : (M, M) m, standard deviation of each pair's distance; bridged where ``measured`` is False, and NaN where
        even that is not possible (a marker that is never seen)
    measured : (M, M) True where the pair was seen together often enough
    overlap : (M, M) frames in which both markers were seen
    distance : (M, M) m, mean distance, NaN where never seen together
    frames : number of frames compared
    linkage : (U - 1, 4) as scipy writes it, over the U markers in ``leaves``; heights in m, the penalty included
    leaves : (U,) the marker that each leaf of the tree is
    order : (U,) markers as the drawn tree has them from left to right
    cut : m, height at which the tree was cut
    clusters : (M,) group of each marker, 0..K-1 in tree order, -1 for none, hand edits made
    """

    affinity: np.ndarray
    measured: np.ndarray
    overlap: np.ndarray
    distance: np.ndarray
    frames: int
    linkage: np.ndarray
    leaves: np.ndarray
    order: np.ndarray
    cut: float
    clusters: np.ndarray

    @property
    def count(self) -> int:
        """The number of groups."""
        return int(self.clusters.max(initial=-1)) + 1


def segment(markers: Markers, settings: SegmentSettings | None = None, progress: Progress = silent) -> Segmentation:
    """Group the markers by rigidity.

    Parameters
    ----------
    markers : cleaned trajectories
    settings : see ``SegmentSettings``
    progress : called along the way

    Raises
    ------
    InputError
        Where no marker is ever seen, or a setting names a marker that does not exist.
    """
    settings = settings or SegmentSettings()
    check_settings(settings, markers.positions.shape[1])
    pairs = affinity(markers.positions, settings.max_frames, part_of(progress, 0.0, 0.9))
    leaves = np.flatnonzero(np.diag(pairs.overlap) > 0)
    if not len(leaves):
        raise InputError("no marker is seen in any frame", markers.source, "check the export and the range of frames")
    measured = pairs.overlap >= min(settings.min_overlap, pairs.frames)
    filled = bridged(pairs.deviation, measured)
    progress(0.95, "building the tree")
    tree, order = _tree(_dissimilarity(filled, pairs, settings)[np.ix_(leaves, leaves)])
    flat, cut = _cut(tree, order, settings)
    clusters = np.full(len(filled), -1)
    clusters[leaves] = flat
    progress(1.0, "grouping markers")
    return Segmentation(
        affinity=filled,
        measured=measured,
        overlap=pairs.overlap,
        distance=pairs.distance,
        frames=pairs.frames,
        linkage=tree,
        leaves=leaves,
        order=leaves[order],
        cut=cut,
        clusters=edited(clusters, settings, leaves[order]),
    )


def cut_at(found: Segmentation, settings: SegmentSettings, height: float) -> np.ndarray:
    """(M,) groups that the same tree has when it is cut at ``height`` m, hand edits made again.

    Parameters
    ----------
    settings : that ``found`` was made with; only the edits in them count
    """
    order = np.searchsorted(found.leaves, found.order)
    flat, _ = _cut(found.linkage, order, replace(settings, threshold=height, groups=None))
    clusters = np.full(len(found.clusters), -1)
    clusters[found.leaves] = flat
    return edited(clusters, settings, found.order)


def regroup(found: Segmentation, settings: SegmentSettings) -> Segmentation:
    """The same tree cut anew, with other hand edits: what ``segment`` would find, without looking at the markers.

    Parameters
    ----------
    settings : may differ from those of ``found`` in ``threshold``, ``groups`` and the hand edits alone
    """
    check_settings(settings, len(found.clusters))
    rank = {int(m): i for i, m in enumerate(found.leaves)}
    flat, cut = _cut(found.linkage, np.array([rank[int(m)] for m in found.order]), settings)
    clusters = np.full(len(found.clusters), -1)
    clusters[found.leaves] = flat
    return replace(found, cut=cut, clusters=edited(clusters, settings, found.order))


def check_settings(settings: SegmentSettings, markers: int) -> None:
    """Refuse settings that cannot be meant, naming the setting."""
    for name, value in (
        ("threshold", settings.threshold),
        ("far", settings.far),
        ("far_penalty", settings.far_penalty),
    ):
        if not (np.isfinite(value) and value >= 0):
            raise InputError(f"{value} is not a length of 0 or more", f"segment.{name}", "give it in metres")
    if settings.groups is not None and settings.groups < 1:
        raise InputError(f"{settings.groups} groups are not possible", "segment.groups", "give 1 or more")
    if settings.max_frames < 2 or settings.min_overlap < 1:
        raise InputError("too few frames are allowed", "segment.max_frames", "allow at least 2")
    named = {
        "merges": [m for group in settings.merges for m in group],
        "splits": [m for group in settings.splits for m in group],
        "moves": [m for pair in settings.moves for m in pair],
        "left_out": list(settings.left_out),
    }
    for name, used in named.items():
        beyond = [m for m in used if not 0 <= m < markers]
        if beyond:
            raise InputError(f"there is no marker number {beyond[0]}", f"segment.{name}", f"use 0 to {markers - 1}")


def edited(clusters: np.ndarray, settings: SegmentSettings, order: np.ndarray) -> np.ndarray:
    """(M,) groups after the hand edits, numbered anew in tree order; ``clusters`` is left as it is."""
    clusters = clusters.copy()
    for group in settings.merges:
        touched = {int(clusters[m]) for m in group} - {-1}
        if touched:
            clusters[np.isin(clusters, list(touched))] = min(touched)
    for group in settings.splits:
        seen = [m for m in group if clusters[m] >= 0]
        clusters[seen] = clusters.max(initial=-1) + 1
    for marker, host in settings.moves:
        if clusters[marker] >= 0:
            clusters[marker] = clusters[host]
    clusters[list(settings.left_out)] = -1
    return _renumbered(clusters, order)


def _renumbered(clusters: np.ndarray, order: np.ndarray) -> np.ndarray:
    rank = {label: i for i, label in enumerate(dict.fromkeys(clusters[m] for m in order if clusters[m] >= 0))}
    return np.array([rank.get(label, -1) for label in clusters], dtype=np.int64)


def _dissimilarity(filled: np.ndarray, pairs: Affinity, settings: SegmentSettings) -> np.ndarray:
    """What the tree is built on: the affinity, with a penalty on pairs that lie far apart."""
    if not settings.far:
        return filled
    return filled + settings.far_penalty * np.maximum(np.nan_to_num(pairs.distance) - settings.far, 0)


def _tree(dissimilarity: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Average linkage (N - 1, 4) and the order of its leaves (N,)."""
    from scipy.cluster.hierarchy import leaves_list, linkage
    from scipy.spatial.distance import squareform

    if len(dissimilarity) == 1:
        return np.zeros((0, 4)), np.zeros(1, dtype=np.intp)
    # two halves of a recording that share no marker have no common measure: put them further apart than anything
    known = dissimilarity[np.isfinite(dissimilarity)]
    apart = np.where(np.isfinite(dissimilarity), dissimilarity, 10 * max(float(known.max()), 0.1))
    np.fill_diagonal(apart, 0.0)
    tree = linkage(squareform(apart, checks=False), "average", optimal_ordering=len(apart) <= 300)
    return tree, leaves_list(tree).astype(np.intp)


def _cut(tree: np.ndarray, order: np.ndarray, settings: SegmentSettings) -> tuple[np.ndarray, float]:
    """Group of each leaf, numbered in tree order, and the height of the cut.

    Average linkage never joins lower than it did before, so K groups are what a cut between two heights leaves.
    """
    from scipy.cluster.hierarchy import fcluster

    heights = np.concatenate([[0.0], tree[:, 2]])
    cut = settings.threshold
    if settings.groups is not None:
        last = len(order) - min(settings.groups, len(order))  # joins that are made
        above = heights[last + 1] if last + 1 < len(heights) else 2 * heights[last] + 1e-3
        cut = float(heights[last] + above) / 2
    flat = fcluster(tree, cut, "distance") if len(order) > 1 else np.ones(1, dtype=np.int64)
    return _renumbered(flat - 1, order), float(cut)
