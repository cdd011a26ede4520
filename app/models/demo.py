"""The files of the embedded session."""

from __future__ import annotations

from markerscope.resources import resource

DEMO_MARKERS, DEMO_VIDEO = resource("demo", "session.c3d"), resource("demo", "video.mp4")
"""The embedded session; the truth that it was made from lies beside it."""
