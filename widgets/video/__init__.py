"""The video."""

from widgets.video.view import LAYERS, VideoView

__all__ = ["LAYERS", "VideoView"]
