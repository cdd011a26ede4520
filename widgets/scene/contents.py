"""What is in a scene, set by whoever knows it: markers, bodies, skeletons, lines, the floor and the legend."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from PySide6.QtWidgets import QWidget

from markerscope.widgets import theme
from markerscope.widgets.scene.legend import ColourBar, Legend, Rgb
from markerscope.widgets.scene.sheet import Sheet
from markerscope.widgets.scene.sight import Sight
from markerscope.widgets.scene.stage import Finer, Stage


class Contents(Sight):
    """A widget with a camera and things to look at; how they are drawn is left to who extends it."""

    def __init__(self, parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self._stage = Stage(theme.colours())
        self._sheet = Sheet()

    def set_markers(self, positions: np.ndarray, colours: np.ndarray, sizes: np.ndarray | None = None) -> None:
        """Markers at (M, 3) m, NaN hidden, in colours (M, 3) uint8 (or one for all), ``sizes`` (M) times the usual."""
        self._stage.set_markers(positions, colours, sizes)
        if self._sheet.hovered >= len(self._stage.markers):
            self._sheet.hovered = -1
        self._changed()

    def set_marker_labels(self, labels: Sequence[str] | None) -> None:
        """A name for each marker; None for none."""
        self._sheet.labels = list(labels or [])
        self.update()

    def set_selected(self, indices: Iterable[int]) -> None:
        """The markers with a ring about them."""
        self._sheet.selected = sorted({int(i) for i in indices})
        self.update()

    def set_trails(self, points: np.ndarray | None) -> None:
        """Where the markers were, (k, M, 3) m, oldest first; None for no trails. Set the markers first."""
        self._stage.set_trails(points)
        self._changed()

    def set_mesh(
        self,
        layer: str,
        vertices: np.ndarray | None,
        faces: np.ndarray,
        colour: np.ndarray | Rgb | None = None,
        opacity: float = 1.0,
        finer: Finer | None = None,
    ) -> None:
        """A skin of vertices (V, 3) m, None for none, and faces (F, 3).

        ``colour`` is one (3), one a vertex (V, 3) uint8, or None for the theme's body colour. ``finer`` makes the
        vertices and faces, and colours of its own, that are shown as soon as nothing moves any more, and at once where
        there is time.
        """
        wanted = np.asarray(theme.colours().body if colour is None else colour)
        self._stage.set_mesh(layer, vertices, np.asarray(faces), wanted, opacity, finer)
        self._changed()

    def set_bones(
        self, layer: str, points: np.ndarray | None, edges: np.ndarray, colour: np.ndarray | Rgb | None = None
    ) -> None:
        """A skeleton of joints (J, 3) m, None for none, and edges (B, 2) from the nearer to the farther joint.

        ``colour`` is one (3), one a bone (B, 3) uint8, or None for the theme's bone colour.
        """
        wanted = np.asarray(theme.colours().bone if colour is None else colour)
        self._stage.set_bones(layer, points, np.asarray(edges), wanted)
        self._changed()

    def set_lines(
        self, layer: str, a: np.ndarray | None, b: np.ndarray | None, colours: np.ndarray | Rgb = (128, 128, 128)
    ) -> None:
        """Pieces from (N, 3) to (N, 3) m, NaN left out, None for none; one colour (3) or one a piece (N, 3) uint8."""
        self._stage.set_lines(layer, a, b, np.asarray(colours))
        self._changed()

    def set_floor(self, z: float | None) -> None:
        """The floor's height, m, None for no floor. It holds what is shown now, and grows with the markers."""
        self._stage.set_floor(z)
        self._changed()

    def show_layer(self, layer: str, shown: bool) -> None:
        """Hide a layer, or show it again."""
        self._stage.show(layer, shown)
        self._changed()

    def remove(self, layer: str) -> None:
        """Take a mesh, bones or lines out for good."""
        self._stage.remove(layer)
        self._changed()

    def set_legend(
        self, title: str, entries: Sequence[tuple[str, Rgb]] | ColourBar | None, also: Legend | None = None
    ) -> None:
        """What the colours mean: kinds with their colour, or a scale; None for no legend. ``also`` stands below it."""
        self._sheet.legend = also if entries is None else Legend(title, entries, also)
        self.update()
