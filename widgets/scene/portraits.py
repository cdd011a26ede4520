"""Small pictures of bodies among markers, drawn in a scene's own canvas while that one waits."""

from __future__ import annotations

import numpy as np
from PySide6.QtGui import QImage

from markerscope.widgets import theme
from markerscope.widgets.images import of_rgba
from markerscope.widgets.scene.camera import Camera
from markerscope.widgets.scene.stage import Stage

SIZE = 560, 420
"""px; about twice what is shown, so that edges are smooth there."""
_MARKER = np.array([200, 30, 60], dtype=np.uint8)
_OPACITY = 0.55


class Portraits:
    """Draws them one at a time.

    Parameters
    ----------
    beside : the stage of the scene
    """

    def __init__(self, beside: Stage) -> None:
        self._stage = Stage(theme.LIGHT, beside)

    def draw(
        self,
        vertices: np.ndarray,
        faces: np.ndarray,
        joints: np.ndarray,
        edges: np.ndarray,
        markers: np.ndarray,
        colour: np.ndarray,
    ) -> QImage:
        """A body of vertices (V, 3) m and faces (F, 3) with its skeleton, joints (J, 3) m and edges (B, 2), in a
        colour (3), among markers (M, 3) m, NaN hidden.
        """
        stage, (width, height) = self._stage, SIZE
        if stage.problem is not None:
            blank = QImage(width, height, QImage.Format.Format_RGB32)
            blank.fill(theme.qcolour(theme.colours().faint))
            return blank
        stage.set_look(theme.LIGHT)  # on a dark ground a body half seen through is hardly told from it
        stage.set_mesh("body", vertices, faces, colour, _OPACITY)
        stage.set_bones("skeleton", joints, edges, colour)
        stage.set_markers(markers, _MARKER, None)
        stage.set_floor(0.0)
        camera = Camera().turned_to("isometric").fitted(vertices, width / height)
        return of_rgba(stage.picture(camera, SIZE, 1.0, smooth=False))
