"""The camera, as a solve leaves it and a file holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CameraResult:
    """A fitted pinhole camera, lab frame.

    Attributes
    ----------
    R_lab_cam : (3, 3) turns camera axes (x right, y down, z away) into the internal lab frame
    position : (3,) m, lab frame
    focal : px, of square pixels; the principal point is the middle of the image
    image_size : (width, height) px, (0, 0) if there were no landmarks to see it by
    reprojection_px : median distance of the landmarks from where the body puts them; NaN without landmarks
    """

    R_lab_cam: np.ndarray
    position: np.ndarray
    focal: float
    image_size: tuple[int, int]
    reprojection_px: float
