"""The video."""

from markerscope.widgets.video.view import LAYERS, VideoView

__all__ = ["LAYERS", "VideoView"]
