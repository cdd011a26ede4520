"""Where one looks from: an orbit about a target with z up, as plain numbers, and the pixels that follow from it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

PRESETS = ("front", "back", "left", "right", "top", "isometric")
"""Names for :meth:`Camera.turned_to`; left is the person's left."""
_TURNS = {  # azimuth from where the person faces, elevation; degrees
    "front": (0.0, 0.0), "back": (180.0, 0.0), "left": (90.0, 0.0), "right": (-90.0, 0.0), "top": (180.0, 90.0),
    "isometric": (40.0, 22.0),
}  # fmt: skip
NEAREST, FARTHEST = 0.02, 500.0  # m


@lru_cache(maxsize=64)
def _basis(azimuth: float, elevation: float) -> np.ndarray:
    ca, sa, ce, se = np.cos(azimuth), np.sin(azimuth), np.cos(elevation), np.sin(elevation)
    basis = np.array([[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]])
    basis.flags.writeable = False  # shared by all who ask for it
    return basis


@dataclass(frozen=True)
class Camera:
    """A camera on an orbit.

    Attributes
    ----------
    target : (3) m, what it looks at and turns about
    azimuth : rad about z from x, the direction from the target to the camera
    elevation : rad above the floor, -pi/2 to pi/2
    distance : m from target to camera
    view_angle : rad, from the lower to the upper edge of the picture
    parallel : whether things keep their size however far they are (the scale then is that at the target)
    """

    target: tuple[float, float, float] = (0.0, 0.0, 0.9)
    azimuth: float = 0.7
    elevation: float = 0.35
    distance: float = 4.5
    view_angle: float = float(np.radians(28))
    parallel: bool = False

    def basis(self) -> np.ndarray:
        """(3, 3) rows: right, up and backwards (from the target to the camera) in the lab."""
        return _basis(self.azimuth, self.elevation)

    def position(self) -> np.ndarray:
        """(3) m."""
        return np.array(self.target) + self.distance * self.basis()[2]

    def focal_px(self, height: float) -> float:
        """Pixels that one metre takes at one metre's distance in a picture of this height."""
        return 0.5 * height / np.tan(0.5 * self.view_angle)

    def metres_per_pixel(self, height: float) -> float:
        """At the target, in a picture of this height."""
        return self.distance / self.focal_px(height)

    def project(self, points: np.ndarray, width: float, height: float) -> tuple[np.ndarray, np.ndarray]:
        """Pixels (N, 2), y down from the upper left, NaN behind the camera, and depth (N) m, of points (N, 3)."""
        seen = (np.asarray(points, dtype=float).reshape(-1, 3) - self.target) @ self.basis().T
        depth = self.distance - seen[:, 2]
        if self.parallel:
            scale = np.full_like(depth, self.focal_px(height) / self.distance)
        else:
            scale = self.focal_px(height) / np.where(depth > 0.5 * NEAREST, depth, np.nan)
        return np.stack([0.5 * width + scale * seen[:, 0], 0.5 * height - scale * seen[:, 1]], axis=1), depth

    def orbited(self, right: float, up: float) -> Camera:
        """Turned about the target by angles, rad."""
        elevation = float(np.clip(self.elevation + up, -np.pi / 2, np.pi / 2))
        return replace(self, azimuth=float((self.azimuth + right + np.pi) % (2 * np.pi) - np.pi), elevation=elevation)

    def panned(self, right_px: float, down_px: float, height: float) -> Camera:
        """Moved sideways so that what lies at the target's depth follows the pointer."""
        right, up, _ = self.basis() * self.metres_per_pixel(height)
        return self.moved(-right_px * right + down_px * up)

    def zoomed(
        self, factor: float, at: tuple[float, float] | None = None, size: tuple[float, float] = (1, 1)
    ) -> Camera:
        """Nearer by ``factor`` > 1; what lies under the pixel ``at`` of a picture of ``size`` stays there."""
        distance = float(np.clip(self.distance / factor, NEAREST, FARTHEST))
        nearer = replace(self, distance=distance)
        if at is None:
            return nearer
        away = (at[0] - 0.5 * size[0], at[1] - 0.5 * size[1])
        shift = 1 - distance / self.distance
        right, up, _ = self.basis() * self.metres_per_pixel(size[1])
        return nearer.moved(shift * (away[0] * right - away[1] * up))

    def moved(self, by: np.ndarray) -> Camera:
        """With camera and target shifted by (3) m."""
        x, y, z = (float(a + b) for a, b in zip(self.target, by))
        return replace(self, target=(x, y, z))

    def turned_to(self, preset: str, facing: float = 0.0) -> Camera:
        """On the side of a person who faces ``facing`` (rad about z from x); see :data:`PRESETS`."""
        turn, elevation = np.radians(_TURNS[preset])
        azimuth = (facing + turn + np.pi) % (2 * np.pi) - np.pi
        return replace(self, azimuth=float(azimuth), elevation=float(elevation))

    def fitted(self, points: np.ndarray, aspect: float, margin: float = 1.12) -> Camera:
        """As near as shows all points (N, 3), NaN left out, in a picture of width / height ``aspect``.

        No point comes nearer to the camera than ``NEAREST``, which can leave room beside a single near one.
        """
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        points = points[np.isfinite(points).all(axis=1)]
        if not len(points):
            return self
        tan = np.tan(0.5 * self.view_angle) / margin
        reach = np.array([tan * aspect, tan])
        basis = self.basis()
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        seen = (points - middle) @ basis.T
        # A point is in the picture if |across - camera| <= reach * (camera depth - its depth): four planes to touch.
        lean = np.zeros(len(points)) if self.parallel else seen[:, 2]
        high = (seen[:, :2] + lean[:, None] * reach).max(axis=0)
        low = (-seen[:, :2] + lean[:, None] * reach).max(axis=0)
        # Where the nearest point bounds the picture on both sides, the planes meet in it: the camera would be there.
        least = max(0.3, seen[:, 2].max() + NEAREST)
        distance = float(np.clip((0.5 * (high + low) / reach).max(), least, max(least, FARTHEST)))
        x, y, z = (float(c) for c in middle + 0.5 * (high - low) @ basis[:2])
        return replace(self, target=(x, y, z), distance=distance)

    def state(self) -> dict[str, Any]:
        """Plain numbers, for a file."""
        return asdict(self) | {"target": list(self.target)}

    @classmethod
    def of_state(cls, state: Mapping[str, Any]) -> Camera:
        """The camera whose :meth:`state` this is; what is missing or no number is as usual."""
        usual = cls()
        try:
            x, y, z = (float(v) for v in state.get("target", usual.target))
            numbers = {
                k: float(state.get(k, getattr(usual, k))) for k in ("azimuth", "elevation", "distance", "view_angle")
            }
        except (TypeError, ValueError):
            return usual
        if not np.isfinite([x, y, z, *numbers.values()]).all() or not NEAREST <= numbers["distance"] <= FARTHEST:
            return usual
        return cls(target=(x, y, z), parallel=bool(state.get("parallel", False)), **numbers)
