"""How far off joint angles may be, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class AngleErrors:
    """Standard errors of joint angles, in the order and on the clock of a ``JointAngles``.

    Attributes
    ----------
    names : A column names
    shape : (T, A) degrees, what changes from frame to frame: noise of markers and video, sliding skin
    level : (T, A) degrees, what all frames share: where markers sit, body shape, joint centres, the video's constant
        error, and how much the anatomical frames differ between definitions
    definition : (A,) degrees, the last of these alone, root mean square over frames
    marker_mm, video_deg, image_share : noise a coordinate that was found in this session, NaN where there is none: of
        markers, of the video's joint rotations (its constant error included), of its landmarks as a share of the
        person's height

    NaN in ``shape`` and ``level`` where the angle is not defined.
    """

    names: tuple[str, ...]
    shape: np.ndarray
    level: np.ndarray
    definition: np.ndarray
    marker_mm: float
    video_deg: float
    image_share: float

    @property
    def total(self) -> np.ndarray:
        """(T, A) degrees, both together."""
        return np.hypot(self.shape, self.level)

    def mean_of(self, name: str) -> dict[str, float]:
        """Root mean squares over frames of one angle, degrees: level, shape, definition; NaN where it is undefined."""
        i = self.names.index(name)
        return {"level": _rms(self.level[:, i]), "shape": _rms(self.shape[:, i]), "definition": self.definition[i]}


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known, dtype=float)))) if len(known) else float("nan")
