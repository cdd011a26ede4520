"""A floor in metres: lines to draw, and where its numbers stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.widgets.scene.camera import Camera

_BELOW = 0.001  # m, under the soles
_LEAST = 1.5  # m from the middle to each edge


@dataclass(frozen=True)
class Floor:
    """A rectangle of whole metres at height ``z``: ``low`` and ``high`` are (x, y) m of its corners."""

    z: float
    low: tuple[int, int]
    high: tuple[int, int]

    def holding(self, points: np.ndarray) -> Floor:
        """Grown, never shrunk, to have half a metre about points (N, 3) m, at most 20 m wide."""
        flat = np.asarray(points, dtype=float).reshape(-1, 3)[:, :2]
        flat = flat[np.isfinite(flat).all(axis=1)]
        if not len(flat):
            return self
        middle = np.median(flat, axis=0)
        low = np.maximum(np.minimum(self.low, np.floor(flat.min(axis=0) - 0.5)), np.floor(middle) - 10)
        high = np.minimum(np.maximum(self.high, np.ceil(flat.max(axis=0) + 0.5)), np.ceil(middle) + 10)
        return Floor(self.z, (int(low[0]), int(low[1])), (int(high[0]), int(high[1])))

    @classmethod
    def about(cls, points: np.ndarray, z: float) -> Floor:
        """The least floor at height ``z`` that holds points (N, 3) m."""
        flat = np.asarray(points, dtype=float).reshape(-1, 3)[:, :2]
        flat = flat[np.isfinite(flat).all(axis=1)]
        middle = 0.5 * (flat.min(axis=0) + flat.max(axis=0)) if len(flat) else np.zeros(2)
        low, high = np.floor(middle - _LEAST), np.ceil(middle + _LEAST)
        return cls(z, (int(low[0]), int(low[1])), (int(high[0]), int(high[1]))).holding(points)

    def lines(self, faint: tuple[int, ...], strong: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Pieces (n, 3) to (n, 3) m with colours (n, 3), ``strong`` at each metre, ``faint`` at each half."""
        a, b, colours = [], [], []
        for axis in (0, 1):
            other = 1 - axis
            for value in np.arange(self.low[axis], self.high[axis] + 0.25, 0.5):
                ends = np.full((2, 3), self.z - _BELOW)
                ends[:, axis] = value
                ends[:, other] = self.low[other], self.high[other]
                a.append(ends[0])
                b.append(ends[1])
                colours.append(strong if float(value).is_integer() else faint)
        order = np.argsort([tuple(colour) == tuple(strong) for colour in colours], kind="stable")
        return np.array(a)[order], np.array(b)[order], np.array(colours, dtype=np.uint8)[order]

    def ticks(self, camera: Camera, width: float, height: float) -> tuple[np.ndarray, list[str]]:
        """Places (n, 3) m and texts of the numbers in a picture of this size.

        They stand along one line in x and one in y: of the lines at whole metres the nearest to the camera on which at
        least three numbers are seen, so that there are numbers however near one looks.
        """
        chosen, texts = [], []
        eye = camera.position()
        for axis in (0, 1):
            other = 1 - axis
            values = np.arange(self.low[axis], self.high[axis] + 1)
            words = [f"{value}".replace("-", "\u2212") for value in values]
            words = [f"{'xy'[axis]} = {word} m" if k == len(values) - 2 else word for k, word in enumerate(words)]
            best, most = None, 0
            nearest_first = sorted(
                range(self.low[other], self.high[other] + 1), key=lambda edge: abs(eye[other] - edge)
            )
            for edge in nearest_first:
                places = np.full((len(values), 3), self.z)
                places[:, axis] = values
                places[:, other] = edge + 0.08 * np.sign(eye[other] - edge)
                at = camera.project(places, width, height)[0]
                with np.errstate(invalid="ignore"):
                    seen = int(((at > 8) & (at < [width - 8, height - 8])).all(axis=1).sum())
                if seen > most:
                    best, most = places, seen
                if seen >= 3:
                    break
            if best is not None:
                chosen.append(best)
                texts += words
        return np.concatenate([np.zeros((0, 3)), *chosen]), texts
