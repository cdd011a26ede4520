"""Where the feet are: heel, toe and pelvis over time, from markers by name, markers by bone, or the solved body."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import INDEX

_SIDE = {"left": r"(?:l|left)[ _.-]*", "right": r"(?:r|right)[ _.-]*"}
_HEEL = r"(?:heel|hee|calc|calcaneus|hel|fcc|cal|heel[ _.-]?(?:back|rear))"
_TOE = (
    r"(?:toe|to|toetip|mtp2|mt2|fm2|smh|dm2|meta2|2meta|mth2|hallux|hlx|toe[ _.-]?tip|big[ _.-]?toe|mt1|fmh|fm1|mt23)"
)
_SIDE_OF_FOOT = r"(?:mt5|fm5|5meta|vmh|d5m|mth5|dm5|lfoot|5th[ _.-]?met|little[ _.-]?toe)"
_PELVIS = r"(?:asi|asis|psi|psis|ias|ips|iasd|ipsd)[sd]?"
_SACRUM = r"(?:sacr|sacrum|vsacral|v[ _.-]?sacral|s1|s2)"


@dataclass(frozen=True, eq=False)
class Foot:
    """One foot over time.

    Attributes
    ----------
    heel, toe : (T, 3) m, z up, NaN = lost; anywhere at the back and the front of the foot
    """

    heel: np.ndarray
    toe: np.ndarray

    @property
    def centre(self) -> np.ndarray:
        """(T, 3) m, the middle of heel and toe."""
        return (self.heel + self.toe) / 2


@dataclass(frozen=True, eq=False)
class Feet:
    """What is needed to find steps.

    Attributes
    ----------
    time : (T,) s
    rate : Hz
    sides : left and right, those that there are
    pelvis : (T, 3) m, what the feet swing about; NaN = lost
    source : what they were read off, in words
    """

    time: np.ndarray
    rate: float
    sides: Mapping[str, Foot]
    pelvis: np.ndarray
    source: str

    @property
    def seen(self) -> dict[str, float]:
        """Share of the frames in which each foot is there."""
        return {side: float(np.isfinite(foot.heel + foot.toe).all(axis=1).mean()) for side, foot in self.sides.items()}


def feet_by_name(markers: Markers) -> Feet | None:
    """Heel, toe and pelvis by the names that laboratories give their markers; None where a heel or toe is not found."""
    sides = {}
    for side in ("left", "right"):
        heel, toe = (_find(markers.labels, side, part) for part in (_HEEL, _TOE))
        if not toe:
            toe = _find(markers.labels, side, _SIDE_OF_FOOT)
        if heel and toe:
            sides[side] = Foot(_first(markers.positions[:, heel]), _first(markers.positions[:, toe]))
    if not sides:
        return None
    pelvis = [m for side in ("left", "right") for m in _find(markers.labels, side, _PELVIS)]
    pelvis = pelvis or [m for m, label in enumerate(markers.labels) if re.fullmatch(_SACRUM, _plain(label), re.I)]
    used = pelvis or list(range(len(markers.labels)))
    return Feet(markers.time, markers.rate, sides, _middle(markers.positions[:, used]), "markers by their names")


def feet_by_bone(markers: Markers, marker_joint: np.ndarray, rotations: np.ndarray) -> Feet | None:
    """Heel and toe from the markers that a solve put on each foot: those furthest back and furthest forward.

    Parameters
    ----------
    marker_joint : (M,) index of the joint whose bone each marker sits on, -1 for none
    rotations : (T, 24, 3, 3) of every joint in the lab
    """
    sides = {}
    for side in ("left", "right"):
        on = np.flatnonzero(np.isin(marker_joint, [INDEX[f"{side}_ankle"], INDEX[f"{side}_foot"]]))
        if len(on) < 2:
            continue
        ahead = rotations[:, INDEX[f"{side}_ankle"], :, 2]  # the rest body's forward axis
        along = np.einsum("tmk,tk->tm", markers.positions[:, on], ahead)
        known = np.isfinite(along).all(axis=1)
        if not known.any():
            continue
        place = np.median(along[known] - along[known].mean(axis=1, keepdims=True), axis=0)
        heel, toe = on[np.argmin(place)], on[np.argmax(place)]
        sides[side] = Foot(markers.positions[:, heel], markers.positions[:, toe])
    pelvis = np.flatnonzero(marker_joint == INDEX["pelvis"])
    if not sides:
        return None
    used = pelvis if len(pelvis) else np.flatnonzero(marker_joint >= 0)
    middle = _middle(markers.positions[:, used])
    return Feet(markers.time, markers.rate, sides, middle, "markers by the bone that a solve put them on")


def feet_of_body(
    time: np.ndarray,
    rate: float,
    rotations: np.ndarray,
    joints: np.ndarray,
    rest: np.ndarray,
    landmarks: Mapping[str, np.ndarray],
) -> Feet:
    """Heel and toe of a solved body, fixed to its feet.

    Parameters
    ----------
    rotations : (T, 24, 3, 3) of every joint in the lab
    joints : (T, 24, 3) m in the lab
    rest : (24, 3) m joints of the shaped body at rest
    landmarks : (3,) m by name, likewise
    """
    sides = {}
    for side in ("left", "right"):
        ankle = INDEX[f"{side}_ankle"]
        heel, toe = (
            joints[:, ankle] + rotations[:, ankle] @ (landmarks[f"{side}_{name}"] - rest[ankle])
            for name in ("calcaneus", "toe")
        )
        sides[side] = Foot(heel, toe)
    return Feet(time, rate, sides, joints[:, 0], "the solved body")


def _find(labels: Sequence[str], side: str, part: str) -> list[int]:
    return [m for m, label in enumerate(labels) if re.fullmatch(_SIDE[side] + part, _plain(label), re.I)]


def _plain(label: str) -> str:
    """A label without the subject's name before it."""
    return label.rsplit(":", 1)[-1].strip()


def _first(positions: np.ndarray) -> np.ndarray:
    """(T, 3) of the marker seen most often of (T, M, 3)."""
    seen = np.isfinite(positions).all(axis=2).mean(axis=0)
    return np.asarray(positions[:, int(np.argmax(seen))])


def _middle(positions: np.ndarray) -> np.ndarray:
    """(T, 3) mean of (T, M, 3), lost markers bridged by the others so that losing one does not move it."""
    present = np.isfinite(positions).all(axis=2)
    enough = present.mean(axis=0) > 0.5 * present.mean(axis=0).max(initial=0)
    positions, present = positions[:, enough], present[:, enough]
    full = present.all(axis=1)
    if not present.any():
        return np.full((len(positions), 3), np.nan)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.where(present[..., None], positions, 0).sum(axis=1) / present.sum(axis=1)[:, None]
    if full.any():
        usual = np.median(positions[full] - positions[full].mean(axis=1, keepdims=True), axis=0)
        off = np.where(present[..., None], usual, 0).sum(axis=1) / np.maximum(present.sum(axis=1), 1)[:, None]
        mean = mean - off
    return np.asarray(mean)
