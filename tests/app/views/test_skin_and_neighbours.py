"""Signed distances to a skin of known shape, and the graph of markers on two bodies that move apart."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.app.views.neighbours import graph_at, graph_of
from markerscope.app.views.skin import LIMIT_M, by_skin, signed_distance
from markerscope.app.views.tracks import tracks_of
from markerscope.solver.clustering.segment import segment
from markerscope.solver.core.markers import Markers
from markerscope.widgets import palette

BOX = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 2) for z in (0.0, 3)])
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]]
)  # fmt: skip
"""Twelve triangles about a box, anticlockwise seen from outside."""


def test_distances_to_a_box_have_the_sign_of_the_side() -> None:
    centre = BOX.mean(axis=0)
    for face in FACES:
        corners = BOX[face]
        assert np.cross(corners[1] - corners[0], corners[2] - corners[0]) @ (corners.mean(axis=0) - centre) > 0
    rng = np.random.default_rng(5)
    points = rng.uniform([-0.6, -0.6, -0.6], [1.6, 2.6, 3.6], (300, 3))
    outside = np.maximum(np.maximum(-points, points - [1, 2, 3]), 0.0)
    inside = np.minimum(points, np.array([1, 2, 3]) - points).min(axis=1)
    expected = np.where(inside > 0, -inside, np.linalg.norm(outside, axis=1))
    # Its triangles are as large as the box: the nearest one is about the nearest corner for points near to one.
    near = np.linalg.norm(points[:, None] - BOX, axis=2).min(axis=1) < 0.45
    found = signed_distance(points, BOX, FACES)
    assert near.sum() > 20 and np.allclose(found[near], expected[near], atol=1e-9)
    assert np.isnan(signed_distance(np.full((2, 3), np.nan), BOX, FACES)).all()


def test_colours_say_outside_and_inside() -> None:
    made = by_skin(np.array([-LIMIT_M, 0.0, LIMIT_M, np.nan]))
    table = palette.scale_table("diverging")
    assert (made.colours[0] == table[0]).all() and (made.colours[2] == table[-1]).all()
    assert (made.colours[3] == palette.LOST).all()


def two_bodies() -> Markers:
    rng = np.random.default_rng(2)
    time = np.arange(200)[:, None, None] / 50
    one, other = rng.uniform(0, 0.2, (1, 5, 3)), rng.uniform(0.3, 0.5, (1, 5, 3))
    moved = np.concatenate([one + 0.2 * np.sin(2 * time), other + 0.2 * np.cos(3 * time)], axis=1) + rng.normal(
        0, 2e-4, (200, 10, 3)
    )
    moved[50:60, 0] = np.nan
    return Markers(moved, 50.0, tuple(f"m{k}" for k in range(10)))


def test_neighbours_are_of_the_same_body_and_drawn_where_both_are_seen() -> None:
    markers = two_bodies()
    graph = graph_of(segment(markers))
    assert (graph.edges[:, 0] < graph.edges[:, 1]).all() and len(np.unique(graph.edges, axis=0)) == len(graph.edges)
    assert ((graph.edges[:, 0] < 5) == (graph.edges[:, 1] < 5)).all(), "no line from body to body"
    assert set(graph.edges.ravel().tolist()) == set(range(10)) and graph.spread.max() < 1e-3
    for m in range(10):
        assert (graph.edges == m).any(axis=1).sum() >= 3
    tracks = tracks_of(markers)
    start, end, colours = graph_at(tracks, graph, 55)
    lost = (graph.edges == 0).any(axis=1).sum()
    assert lost >= 3 and len(start) == len(end) == len(colours) == len(graph.edges) - lost
    assert len(graph_at(tracks, graph, 10)[0]) == len(graph.edges)
    assert start[0] == pytest.approx(markers.positions[55, graph.edges[~(graph.edges == 0).any(axis=1)][0, 0]])
