"""The 3D scene."""

from widgets.scene.camera import PRESETS, Camera
from widgets.scene.legend import ColourBar, Legend
from widgets.scene.view import Scene3D

__all__ = ["PRESETS", "Camera", "ColourBar", "Legend", "Scene3D"]
