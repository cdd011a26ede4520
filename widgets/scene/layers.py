"""What can be in a scene: markers, meshes, bones, lines, trails, a floor. Each takes arrays and owns one VTK actor."""

from __future__ import annotations

from typing import Any

import numpy as np
from vtkmodules.vtkRenderingCore import vtkActor, vtkPointGaussianMapper, vtkPolyDataMapper

from markerscope.widgets.scene.arrays import Geometry
from markerscope.widgets.scene.normals import Normals

MARKER_RADIUS = 0.008
"""m, a little over the usual 14 mm marker."""
LEAST_RADIUS_PX = 4.0
"""Smaller than this no marker is drawn, however far away, or its colour could not be told."""
# A ball lit from the upper left, in its own colour at the middle, darker towards the rim so that it stands out on
# skin as on the ground; `offsetVCVSOutput` runs from -1 to 1 over the ball.
_BALL = """
//VTK::Color::Impl
float off = dot(offsetVCVSOutput.xy, offsetVCVSOutput.xy);
if (off > 1.0) { discard; }
float lit = 0.80 + 0.20 * sqrt(1.0 - off) + 0.22 * dot(offsetVCVSOutput.xy, vec2(-0.45, 0.7)) * (1.0 - off * off);
float rim = smoothstep(0.66, 0.86, off);
diffuseColor *= lit * (1.0 - 0.62 * rim);
ambientColor *= lit * (1.0 - 0.62 * rim);
"""


# A see-through skin is denser where it is seen aslant, as glass is: its outline stays clear.
_RIM = """
//VTK::Light::Impl
float aslant = 1.0 - abs(normalVCVSOutput.z);
gl_FragData[0].a = mix(opacity, 1.0, 0.75 * opacity * aslant * aslant);
"""


class Layer:
    """A thing in the scene: ``actor``, and the points that a picture of it must show."""

    make_mapper: Any = vtkPolyDataMapper

    def __init__(self) -> None:
        self.geometry = Geometry()
        self.mapper: Any = self.make_mapper()
        self.mapper.SetInputData(self.geometry.data)
        self.actor: Any = vtkActor()
        self.actor.SetMapper(self.mapper)
        self.actor.VisibilityOff()
        self.actors = [self.actor]
        self.shown, self.filled = True, False
        self.extent = np.zeros((0, 3))

    def show(self, shown: bool) -> None:
        """Hide the layer or show it again."""
        self.shown = shown
        self._settle()

    def clear(self) -> None:
        """Have nothing in it."""
        self._fill(False)

    @property
    def visible(self) -> bool:
        """Whether there is something in it and it is not hidden."""
        return self.shown and self.filled

    def middle(self) -> np.ndarray:
        """(3) m, of its extent."""
        return 0.5 * (self.extent.min(axis=0) + self.extent.max(axis=0)) if len(self.extent) else np.zeros(3)

    def _fill(self, filled: bool, extent: np.ndarray | None = None) -> None:
        self.filled = filled
        self.extent = np.zeros((0, 3)) if extent is None or not filled else extent
        self._settle()

    def _settle(self) -> None:
        for actor in self.actors:
            actor.SetVisibility(self.visible)


class MarkerLayer(Layer):
    """Balls that always face the eye."""

    make_mapper = vtkPointGaussianMapper

    def __init__(self) -> None:
        super().__init__()
        self.mapper.EmissiveOff()
        self.mapper.SetSplatShaderCode(_BALL)
        self.mapper.SetBoundScale(2.5)
        self.mapper.SetScaleFactor(1.0)
        self.mapper.SetScaleArray("radius")
        self.actor.ForceOpaqueOn()
        self._factors = np.zeros(0)
        self._least = -1.0

    def set(self, positions: np.ndarray, colours: np.ndarray, sizes: np.ndarray | None) -> None:
        """Positions (M, 3) m, NaN hidden; colours (M, 3) uint8; sizes (M) times the usual."""
        seen = np.isfinite(positions).all(axis=1)
        self._factors = np.ones(int(seen.sum())) if sizes is None else np.asarray(sizes, dtype=float)[seen]
        self._least = -1.0
        if seen.any():
            self.geometry.set_points(positions[seen])
            self.geometry.set_colours(colours[seen])
        self._fill(bool(seen.any()), positions[seen])

    def at_least(self, radius: float) -> None:
        """No marker is drawn smaller than ``radius`` m times its size."""
        if self.filled and radius != self._least:
            self._least = radius
            self.geometry.set_values("radius", (self._factors * max(radius, MARKER_RADIUS)).astype(np.float32))
            self.geometry.data.Modified()


class MeshLayer(Layer):
    """A smooth skin, seen from outside."""

    def __init__(self) -> None:
        super().__init__()
        surface = self.actor.GetProperty()
        surface.SetInterpolationToPhong()
        surface.SetAmbient(0.20)
        surface.SetDiffuse(0.86)
        surface.SetSpecular(0.10)
        surface.SetSpecularPower(16)
        surface.BackfaceCullingOn()
        # Both actors go with what is solid, in the stage's order: the first fills the depth buffer alone, so that of a
        # see-through body the outermost skin is drawn and nothing of what folds behind it. What was drawn before,
        # markers and bones, shines through.
        self._depth: Any = vtkActor()
        self._depth.SetMapper(self.mapper)
        self._depth.GetProperty().BackfaceCullingOn()
        self._depth.GetProperty().LightingOff()
        self._depth.GetProperty().SetOpacity(0.001)
        self.actors = [self._depth, self.actor]
        for actor in self.actors:
            actor.ForceOpaqueOn()
        self.actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::Light::Impl", True, _RIM, False)
        self.opacity = 1.0
        self._faces = np.zeros((0, 3), dtype=np.int64)
        self._normals: Normals | None = None

    def set(self, vertices: np.ndarray | None, faces: np.ndarray, colour: np.ndarray, opacity: float) -> None:
        """Vertices (V, 3) m, faces (F, 3), a colour (3) or one a vertex (V, 3) uint8, opacity 0 to 1."""
        if vertices is None or not len(vertices) or opacity <= 0 or not np.isfinite(vertices[0]).all():
            self._fill(False)
            return
        vertices = np.asarray(vertices, dtype=np.float32)
        same = faces is self._faces or (faces.shape == self._faces.shape and np.array_equal(faces, self._faces))
        if self._normals is None or not same or self._normals.count != len(vertices):
            self._faces, self._normals = faces, Normals(faces, len(vertices))
        self.geometry.set_points(vertices)
        self.geometry.set_normals(self._normals.of(vertices))
        self.geometry.set_cells(self._faces, "triangles")
        colour = np.asarray(colour)
        self.geometry.set_colours(colour if colour.ndim == 2 else None)
        surface = self.actor.GetProperty()
        if colour.ndim == 1:
            surface.SetColor(*(colour[:3] / 255.0))
        self.opacity = float(min(opacity, 1.0))
        surface.SetOpacity(self.opacity)
        self._fill(True, vertices[:: max(1, len(vertices) // 1500)])


class BoneLayer(Layer):
    """Bones as slim double pyramids from joint to joint, thick near the first."""

    def __init__(self) -> None:
        super().__init__()
        surface = self.actor.GetProperty()
        surface.SetInterpolationToFlat()
        surface.SetAmbient(0.25)
        surface.SetDiffuse(0.8)
        self.points, self.edges = np.zeros((0, 3)), np.zeros((0, 2), dtype=int)

    def set(self, points: np.ndarray | None, edges: np.ndarray, colour: np.ndarray) -> None:
        """Joints (J, 3) m, NaN unknown; edges (B, 2); a colour (3) or one a bone (B, 3) uint8."""
        self.points, self.edges = np.zeros((0, 3)), np.asarray(edges, dtype=int).reshape(-1, 2)
        known: np.ndarray = np.zeros(0, dtype=bool)
        if points is not None:
            self.points = np.asarray(points, dtype=float)
            known = np.asarray(np.isfinite(self.points[self.edges]).all(axis=(1, 2)))
        if not known.any():
            self._fill(False)
            return
        a, b = (self.points[self.edges[known, k]] for k in (0, 1))
        vertices, triangles = _pyramids(a, b)
        colour = np.broadcast_to(np.asarray(colour, dtype=np.uint8), (len(known), 3))[known]
        self.geometry.set_points(vertices)
        self.geometry.set_cells(triangles, "triangles")
        self.geometry.set_colours(np.repeat(colour, 6, axis=0))
        self._fill(True, np.concatenate([a, b]))


class LineLayer(Layer):
    """Straight pieces."""

    def __init__(self) -> None:
        super().__init__()
        self.actor.GetProperty().LightingOff()
        self.actor.ForceOpaqueOn()

    def set(self, a: np.ndarray | None, b: np.ndarray | None, colours: np.ndarray) -> None:
        """From (N, 3) to (N, 3) m, NaN left out; a colour (3) or one a line (N, 3) uint8."""
        if a is None or b is None or not len(a):
            self._fill(False)
            return
        known = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1)
        if known.any():
            ends = np.stack([a[known], b[known]], axis=1).reshape(-1, 3)
            colours = np.asarray(colours, dtype=np.uint8)
            colours = np.broadcast_to(colours, (len(known), 3))[known]
            self.geometry.set_points(ends)
            self.geometry.set_cells(np.arange(len(ends)).reshape(-1, 2), "lines")
            self.geometry.set_colours(np.repeat(colours, 2, axis=0))
        self._fill(bool(known.any()), None if not known.any() else ends)

    def set_width(self, pixels: float) -> None:
        """Width of the lines, pixels of the picture."""
        self.actor.GetProperty().SetLineWidth(pixels)


def trail_lines(
    trails: np.ndarray, colours: np.ndarray, old: tuple[int, int, int]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pieces (n, 3) to (n, 3) m of trails (k, M, 3), oldest first, with colours (n, 3) that fade to ``old``."""
    a, b = trails[:-1].reshape(-1, 3), trails[1:].reshape(-1, 3)
    steps, count = max(len(trails) - 1, 0), trails.shape[1]
    young = np.repeat(np.linspace(0.0, 1.0, steps), count)[:, None]
    faded = young * np.tile(colours[:, :3], (steps, 1)) + (1 - young) * np.array(old)
    return a, b, faded.astype(np.uint8)


def _pyramids(a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices (6 B, 3) and faces (8 B, 3) of the bones from ``a`` (B, 3) to ``b`` (B, 3)."""
    along = b - a
    length = np.linalg.norm(along, axis=1, keepdims=True)
    unit = along / np.maximum(length, 1e-9)
    helper = np.where(np.abs(unit[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    u = np.cross(unit, helper)
    u /= np.maximum(np.linalg.norm(u, axis=1, keepdims=True), 1e-9)
    v = np.cross(unit, u)
    radius, waist = np.clip(0.09 * length, 0.005, 0.022), a + 0.16 * along
    ring = [waist + radius * w for w in (u, v, -u, -v)]
    vertices = np.stack([a, *ring, b], axis=1).reshape(-1, 3)
    one = np.array([[0, 2, 1], [0, 3, 2], [0, 4, 3], [0, 1, 4], [5, 1, 2], [5, 2, 3], [5, 3, 4], [5, 4, 1]])
    faces = (np.arange(len(a))[:, None, None] * 6 + one).reshape(-1, 3)
    return vertices, faces
