"""The things in the scene by name, and the pictures of them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

import numpy as np

from markerscope.widgets.scene.camera import Camera
from markerscope.widgets.scene.canvas import JITTER, Canvas, average
from markerscope.widgets.scene.floor import Floor
from markerscope.widgets.scene.gl import gl_problem
from markerscope.widgets.scene.layers import (
    LEAST_RADIUS_PX,
    BoneLayer,
    Layer,
    LineLayer,
    MarkerLayer,
    MeshLayer,
    trail_lines,
)
from markerscope.widgets.theme import Colours

_Kind = TypeVar("_Kind", bound=Layer)
Finer = Callable[[], tuple[np.ndarray, np.ndarray] | tuple[np.ndarray, np.ndarray, np.ndarray]]
"""Makes the vertices (V, 3) m and faces (F, 3) of a finer skin, and colours (V, 3) of its own where it has any, when
there is time to show it."""
_FINE = " (fine)"
_COVER_PX = 12.0  # a skin's points, thinned, lie about as far apart
OVERLAYS = ("labels", "axes", "legend")
"""Layers that are painted over the picture; those of the picture are named by whoever fills them."""


class Stage:
    """What is in the scene.

    Parameters
    ----------
    look : colours
    beside : a stage whose canvas this one shares; it ends with that one

    Attributes
    ----------
    problem : why nothing can be drawn here, None where it can
    markers : (M, 3) m, NaN hidden
    colours : (M, 3) uint8
    floor : None where none is shown
    """

    def __init__(self, look: Colours, beside: Stage | None = None) -> None:
        self.problem: str | None = gl_problem() if beside is None else beside.problem
        self._canvas: Canvas | None = None if self.problem else Canvas(None if beside is None else beside._canvas)
        self._beside: list[Stage] = []
        if beside is not None:
            beside._beside.append(self)
        self.markers, self.colours = np.zeros((0, 3)), np.zeros((0, 3), dtype=np.uint8)
        self.floor: Floor | None = None
        self._layers: dict[str, Layer] = {}
        self._finer: dict[str, tuple[Finer | None, np.ndarray, float]] = {}
        self._hidden: set[str] = set()
        self._look = look
        self._order: list[str] = []
        self._floor = self._layer("floor", LineLayer)
        self._trails = self._layer("trails", LineLayer)
        self._markers = self._layer("markers", MarkerLayer)
        self.set_look(look)

    @property
    def software(self) -> bool:
        """Whether a processor draws, not a graphics card."""
        return self._canvas is None or self._canvas.software

    def set_look(self, look: Colours) -> None:
        """The colours of ground and floor."""
        self._look = look
        if self._canvas is not None:
            self._canvas.set_background(look.scene_top, look.scene_bottom)
        self._draw_floor()

    def set_markers(self, positions: np.ndarray, colours: np.ndarray, sizes: np.ndarray | None) -> None:
        """See :meth:`markerscope.widgets.scene.Scene3D.set_markers`."""
        self.markers = np.array(positions, dtype=float).reshape(-1, 3)
        self.colours = np.broadcast_to(np.asarray(colours, dtype=np.uint8), (len(self.markers), 3)).copy()
        self._markers.set(self.markers, self.colours, sizes)
        if self.floor is not None:
            grown = self.floor.holding(self.markers)
            if grown != self.floor:
                self.floor = grown
                self._draw_floor()

    def set_trails(self, trails: np.ndarray | None) -> None:
        """Where the markers were, (k, M, 3) m, oldest first, in the markers' colours."""
        if trails is None or len(trails) < 2:
            self._trails.set(None, None, np.zeros((0, 3)))
        else:
            self._trails.set(*trail_lines(np.asarray(trails, dtype=float), self.colours, self._look.floor))

    def set_mesh(
        self,
        name: str,
        vertices: np.ndarray | None,
        faces: np.ndarray,
        colour: np.ndarray,
        opacity: float,
        finer: Finer | None = None,
    ) -> None:
        """A skin; see :meth:`MeshLayer.set`. ``finer`` makes the vertices and faces that :meth:`refine` shows."""
        self._layer(name, MeshLayer).set(vertices, faces, colour, opacity)
        if self._finer.pop(name, None) is not None and _fine(name) in self._layers:
            self._layers[_fine(name)].clear()  # it is of what was shown before
        if finer is not None and vertices is not None:
            self._finer[name] = finer, colour, opacity

    @property
    def coarse(self) -> bool:
        """Whether a skin is seen that :meth:`refine` would show finer."""
        return any(made is not None for made, _, _ in self._finer.values())

    @property
    def fine(self) -> bool:
        """Whether a skin is seen finer than it was set."""
        return any(made is None for made, _, _ in self._finer.values())

    def refine(self) -> None:
        """Show every skin as fine as there is."""
        for name, (finer, colour, opacity) in self._finer.items():
            if finer is not None:
                vertices, faces, *own = finer()
                self._layer(_fine(name), MeshLayer).set(vertices, faces, own[0] if own else colour, opacity)
                self._layers[name].clear()
                self._finer[name] = None, colour, opacity

    def set_bones(self, name: str, points: np.ndarray | None, edges: np.ndarray, colour: np.ndarray) -> None:
        """A skeleton; see :meth:`BoneLayer.set`."""
        self._layer(name, BoneLayer).set(points, edges, colour)

    def set_lines(self, name: str, a: np.ndarray | None, b: np.ndarray | None, colours: np.ndarray) -> None:
        """Straight pieces; see :meth:`LineLayer.set`."""
        self._layer(name, LineLayer).set(a, b, colours)

    def set_floor(self, z: float | None) -> None:
        """The floor's height, m; None for none."""
        self.floor = None if z is None else Floor.about(self.points(), z)
        self._draw_floor()

    def remove(self, name: str) -> None:
        """Take a named layer out for good."""
        self._finer.pop(name, None)
        for own in (name, _fine(name)):
            layer = self._layers.pop(own, None)
            if layer is not None and self._canvas is not None:
                for actor in layer.actors:
                    self._canvas.renderer.RemoveActor(actor)

    def show(self, name: str, shown: bool) -> None:
        """Hide a layer, or show it again; also one that comes later."""
        (self._hidden.discard if shown else self._hidden.add)(name)
        for own in (name, _fine(name)):
            if own in self._layers:
                self._layers[own].show(shown)

    def shows(self, name: str) -> bool:
        """Whether a layer is not hidden."""
        return name not in self._hidden

    def bones(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Joints (J, 3) m and edges (B, 2) of every skeleton that is seen."""
        return {
            name: (layer.points, layer.edges)
            for name, layer in self._layers.items()
            if isinstance(layer, BoneLayer) and layer.visible
        }

    def points(self) -> np.ndarray:
        """(N, 3) m that a picture of everything that is seen must show; the floor is no part of it."""
        seen = [layer.extent for layer in self._layers.values() if layer.visible and layer is not self._floor]
        return np.concatenate([np.zeros((0, 3)), *seen])

    def covers(self, camera: Camera, pixels: np.ndarray, depth: np.ndarray, size: tuple[int, int]) -> np.ndarray:
        """(n) bool: whether a skin lies before what is seen at pixels (n, 2) at a depth (n) m."""
        skins = [layer for layer in self._layers.values() if isinstance(layer, MeshLayer) and layer.visible]
        points = np.concatenate([np.zeros((0, 3)), *[layer.extent for layer in skins if layer.opacity > 0.2]])
        at, before = camera.project(points, *size)
        near = np.abs(pixels[:, None] - at).max(axis=2) < _COVER_PX
        return np.asarray((near & (before < depth[:, None] - 0.02)).any(axis=1))

    def picture(self, camera: Camera, size: tuple[int, int], ratio: float, smooth: bool) -> np.ndarray:
        """The scene (H, W, 4) uint8 for ``size`` (width, height), each of whose pixels is ``ratio`` pixels wide."""
        canvas, width, height = self._prepared(camera, size, ratio)
        return (canvas.render_smooth if smooth else canvas.render)(camera, width, height)

    def smoothing(self, camera: Camera, size: tuple[int, int], ratio: float) -> Iterator[np.ndarray | None]:
        """The smooth picture in small steps: None until the last, which is the picture (H, W, 4) uint8."""
        canvas, width, height = self._prepared(camera, size, ratio)
        total = np.zeros((height, width, 4), dtype=np.uint16)
        for k, (x, y) in enumerate(JITTER):
            total += canvas.render(camera, width, height, (x, y))
            yield None if k + 1 < len(JITTER) else average(total, len(JITTER))

    def release(self) -> None:
        """Draw no more."""
        for stage in self._beside:
            stage.release()
        if self._canvas is not None:
            self._canvas.retire(self._layers)
            self._canvas, self.problem = None, "The 3D view is closed."

    def _prepared(self, camera: Camera, size: tuple[int, int], ratio: float) -> tuple[Canvas, int, int]:
        if self._canvas is None:
            raise RuntimeError(self.problem)
        self._sort(self._canvas, camera)
        self._markers.at_least(LEAST_RADIUS_PX * camera.metres_per_pixel(size[1]))
        for layer in self._layers.values():
            if isinstance(layer, LineLayer):
                layer.set_width((1.0 if layer is self._floor else 1.6) * ratio)
        return self._canvas, max(1, round(size[0] * ratio)), max(1, round(size[1] * ratio))

    def _sort(self, canvas: Canvas, camera: Camera) -> None:
        """Have VTK draw skins last, the most solid first and the nearest last: each covers or tints what is there."""

        def rank(name: str) -> tuple[bool, float, float]:
            layer = self._layers[name]
            if not isinstance(layer, MeshLayer):
                return False, 0.0, 0.0
            twin = self._layers.get(_fine(name), layer)  # the two are one skin, and take one place
            if name.endswith(_FINE):
                twin = self._layers[name.removesuffix(_FINE)]
            seen = twin if twin.visible and isinstance(twin, MeshLayer) else layer
            return True, -round(seen.opacity, 2), -float(np.linalg.norm(seen.middle() - camera.position()))

        order = sorted(self._layers, key=rank)
        if order != self._order:
            self._order = order
            canvas.renderer.RemoveAllViewProps()
            for name in order:
                for actor in self._layers[name].actors:
                    canvas.renderer.AddActor(actor)

    def _layer(self, name: str, kind: type[_Kind]) -> _Kind:
        if name not in self._layers:
            made: Layer = kind()
            self._layers[name] = made
            made.show(name.removesuffix(_FINE) not in self._hidden)
        found = self._layers[name]
        if not isinstance(found, kind):
            raise ValueError(f"the layer {name} is a {type(found).__name__} already")
        return found

    def _draw_floor(self) -> None:
        if self.floor is None:
            self._floor.set(None, None, np.zeros((0, 3)))
        else:
            self._floor.set(*self.floor.lines(self._look.floor, self._look.floor_strong))


def _fine(name: str) -> str:
    """The layer of a skin's finer mesh: its own, so that each keeps what was prepared for its faces."""
    return name + _FINE
