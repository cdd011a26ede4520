"""The turned square of a picture that a pose network looks at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

_MARGIN = 1.25  # of the crop about the circle that holds the body


@dataclass(frozen=True)
class Region:
    """The turned square that holds a person.

    Attributes
    ----------
    centre : (2,) px
    side : px
    turn : rad, from the picture's axes to the crop's, clockwise as seen
    """

    centre: np.ndarray
    side: float
    turn: float

    @classmethod
    def around(cls, centre: np.ndarray, scale_point: np.ndarray) -> Region:
        """Centred on the hips, upright along the line to the scale point."""
        x, y = scale_point - centre
        return cls(centre, 2 * _MARGIN * float(np.hypot(x, y)), float(np.arctan2(x, -y)))

    @property
    def rotation(self) -> np.ndarray:
        """(2, 2) from the crop's axes to the picture's."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.array([[c, -s], [s, c]])

    def to_picture(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 2) of the crop, 0..1, in px of the picture (a pixel's centre is at whole numbers)."""
        return self.centre + (points - 0.5) * self.side @ self.rotation.T

    def crop(self, picture: np.ndarray, size: int, *, outside_black: bool = False) -> np.ndarray:
        """The square resampled to (size, size, 3); its pixel i covers i/size to (i+1)/size of the side."""
        import cv2

        linear = self.rotation * (self.side / size)
        offset = self.to_picture(np.full((1, 2), 0.5 / size))[0]
        border = cv2.BORDER_CONSTANT if outside_black else cv2.BORDER_REPLICATE
        matrix = np.hstack([linear, offset[:, None]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(cv2.warpAffine(picture, matrix, (size, size), flags=flags, borderMode=border))
