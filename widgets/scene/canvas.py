"""VTK drawing into memory: works in a window, under Xvfb and without any display alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  registers what draws
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkUnsignedCharArray
from vtkmodules.vtkRenderingCore import vtkLight, vtkRenderer, vtkRenderWindow

from markerscope.widgets.scene.camera import Camera
from markerscope.widgets.scene.gl import SOFTWARE

# Position of each lamp about the head of who looks (right, up, backwards) and its strength: a key from the upper
# left, a fill from the right, one from behind that lights the rim, and a little from straight ahead.
_LAMPS = (((-0.55, 0.75, 0.9), 0.62), ((0.95, 0.15, 0.55), 0.36), ((0.25, 0.55, -1.0), 0.30), ((0.0, 0.0, 1.0), 0.36))
# Sub-pixel shifts whose mean smooths edges: a regular grid turned by atan(1/2), so that no two share a row or column.
JITTER = np.array([[-3, -1], [1, -3], [3, 1], [-1, 3], [-1, -1], [1, 1], [-3, 3], [3, -3]]) / 8.0
_FAR = 80.0  # m


class Canvas:
    """One scene, drawn off screen.

    Parameters
    ----------
    beside : another canvas, whose window of VTK this one draws in too, each at its time: a second window would be a
        second context of OpenGL, and VTK is not safe with those

    Attributes
    ----------
    software : whether a processor draws; smoothed edges then cost as many pictures as are averaged
    """

    def __init__(self, beside: Canvas | None = None) -> None:
        self._window: Any = vtkRenderWindow() if beside is None else beside._window
        if beside is None:
            self._window.SetOffScreenRendering(1)
            self._window.SetMultiSamples(0)
            self._window.SetSize(64, 64)
        self.software = True
        self.renderer = vtkRenderer()
        self.renderer.GradientBackgroundOn()
        self.renderer.SetUseOIT(False)  # culled meshes look as well without, at two thirds of the time
        self.renderer.AutomaticLightCreationOff()
        for position, strength in _LAMPS:
            lamp = vtkLight()
            lamp.SetLightTypeToCameraLight()
            lamp.SetPosition(*position)
            lamp.SetFocalPoint(0, 0, 0)
            lamp.SetIntensity(strength)
            self.renderer.AddLight(lamp)
        self._window.AddRenderer(self.renderer)
        self._bytes: Any = vtkUnsignedCharArray()
        if beside is not None:
            self.software = beside.software
            return
        self._window.Render()
        report = str(self._window.ReportCapabilities()).lower()
        self.software = any(word in report for word in SOFTWARE)
        if not self.software:
            self._window.SetMultiSamples(8)

    def set_background(self, top: tuple[int, int, int], bottom: tuple[int, int, int]) -> None:
        """The ground's colours, 0 to 255."""
        self.renderer.SetBackground(*(part / 255 for part in bottom))
        self.renderer.SetBackground2(*(part / 255 for part in top))

    def render(self, camera: Camera, width: int, height: int, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
        """The picture (height, width, 4) uint8, moved by a part of a pixel."""
        if tuple(self._window.GetSize()) != (width, height):
            self._window.SetSize(width, height)
        for renderer in self._window.GetRenderers():
            renderer.SetDraw(renderer is self.renderer)
        self._aim(camera, width, height, shift)
        self._window.Render()
        self._window.GetRGBACharPixelData(0, 0, width - 1, height - 1, 0, self._bytes)
        return vtk_to_numpy(self._bytes).reshape(height, width, 4)[::-1].copy()

    def render_smooth(self, camera: Camera, width: int, height: int) -> np.ndarray:
        """The picture (height, width, 4) uint8 with smoothed edges."""
        if not self.software:
            return self.render(camera, width, height)
        total = np.zeros((height, width, 4), dtype=np.uint16)
        for x, y in JITTER:
            total += self.render(camera, width, height, (x, y))
        return average(total, len(JITTER))

    def retire(self, things: object) -> None:
        """Draw no more. What the canvas and ``things``, which it drew, hold of graphics memory is kept to the end.

        VTK frees a marker mapper's buffers by their numbers in whatever context is current, and so those of another
        scene, which ends the process as that one draws next. A window needs one scene, so little is kept.
        """
        _retired.append((self, things))

    def _aim(self, camera: Camera, width: int, height: int, shift: tuple[float, float]) -> None:
        eye: Any = self.renderer.GetActiveCamera()
        _, up, back = camera.basis()
        away = camera.distance if not camera.parallel else 0.5 * _FAR
        eye.SetFocalPoint(*camera.target)
        eye.SetPosition(*(np.array(camera.target) + away * back))
        eye.SetViewUp(*up)
        eye.SetViewAngle(float(np.degrees(camera.view_angle)))
        eye.SetParallelProjection(camera.parallel)
        eye.SetParallelScale(0.5 * height * camera.metres_per_pixel(height))
        eye.SetClippingRange(0.1 if camera.parallel else max(0.04 * camera.distance, 0.01), away + 0.5 * _FAR)
        eye.SetWindowCenter(2 * shift[0] / width, 2 * shift[1] / height)


def average(total: np.ndarray, count: int) -> np.ndarray:
    """The mean (..., 4) uint8 of ``count`` pictures from their sum, uint16."""
    return ((total + count // 2) // count).astype(np.uint8)


_retired: list[tuple[Canvas, object]] = []
