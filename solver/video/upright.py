"""The quarter turns and mirrorings that a phone writes beside the picture instead of turning it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np

if TYPE_CHECKING:
    from av import VideoFrame


@dataclass(frozen=True)
class Upright:
    """How the stored picture becomes the shown one: transposed first, then mirrored along either axis."""

    transpose: bool
    flip_x: bool
    flip_y: bool

    @classmethod
    def of(cls, frame: VideoFrame) -> Upright:
        """Read a frame's display matrix.

        It maps a stored pixel (x, y) to the shown (a x + c y, b x + d y) and lies in memory as a b u c d v ...,
        integers in the machine's byte order.
        """
        from av.sidedata.sidedata import Type

        try:
            data = bytes(cast(Any, frame.side_data)[Type.DISPLAYMATRIX])  # its stub knows motion vectors alone
        except KeyError:
            return IDENTITY
        a, b, _, c, d = np.frombuffer(data, dtype=np.int32)[:5].tolist()
        if abs(a) + abs(d) >= abs(b) + abs(c):
            return cls(False, a < 0, d < 0)
        return cls(True, c < 0, b < 0)

    def apply(self, picture: np.ndarray) -> np.ndarray:
        """The shown picture (H, W, C), contiguous."""
        if self.transpose:
            picture = picture.transpose(1, 0, 2)
        if self.flip_x:
            picture = picture[:, ::-1]
        if self.flip_y:
            picture = picture[::-1]
        return np.ascontiguousarray(picture)

    @property
    def turned(self) -> int:
        """Degrees clockwise, of the turn that is left when a mirroring is taken off along x first."""
        if self.transpose:
            return 90 if self.flip_x else 270
        return 180 if self.flip_y else 0


IDENTITY = Upright(False, False, False)
