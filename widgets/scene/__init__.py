"""The 3D scene."""

from markerscope.widgets.scene.camera import PRESETS, Camera
from markerscope.widgets.scene.legend import ColourBar, Legend
from markerscope.widgets.scene.view import Scene3D

__all__ = ["PRESETS", "Camera", "ColourBar", "Legend", "Scene3D"]
