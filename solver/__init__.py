"""Markerscope's solver: from unlabelled markers and a video to a body and its joint angles.

Headless: never imports Qt, VTK, ``app`` or ``widgets``.
"""

__version__ = "0.1.0"
