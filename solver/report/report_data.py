"""What a report shows, as plain data: whoever has results fills it in, the writer draws it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Headline:
    """One figure that sums up the solve: what it is, its value with its unit, and how to read it."""

    label: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class InputFile:
    """A file the result was computed from.

    Attributes
    ----------
    role : "markers", "video"...
    name : file name, without its folder
    digest : SHA-256 in hexadecimal
    notes : what was assumed while reading, one sentence each
    """

    role: str
    name: str
    digest: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Groups:
    """How markers were grouped; the fields are those of ``segment.Segmentation``.

    Attributes
    ----------
    labels : M names of markers
    affinity : (M, M) m
    measured : (M, M) False where the value was bridged over other markers
    linkage : (U - 1, 4) tree over the U seen markers, heights in m
    leaves, order : (U,) the marker of each leaf, and the markers as the tree is drawn
    cut : m, height of the cut
    clusters : (M,) group of each marker, -1 for none
    """

    labels: tuple[str, ...]
    affinity: np.ndarray
    measured: np.ndarray
    linkage: np.ndarray
    leaves: np.ndarray
    order: np.ndarray
    cut: float
    clusters: np.ndarray


@dataclass(frozen=True)
class Hypothesis:
    """One way to put the markers on the body.

    Attributes
    ----------
    part : the bones that carry markers, in words
    heading_deg : degrees, which way the camera looks about the vertical
    energy : total
    energies : its terms by name
    refined : False if it was given up after the coarse phase
    chosen : True for the answer
    runner_up : True for the best different answer
    """

    part: str
    heading_deg: float
    energy: float
    energies: Mapping[str, float] = field(default_factory=dict)
    refined: bool = True
    chosen: bool = False
    runner_up: bool = False


@dataclass(frozen=True, eq=False)
class AngleCurve:
    """One joint angle over time, of both sides or of none.

    Attributes
    ----------
    title : "Knee flexion"
    unit : "degrees"
    time : (T,) s
    sides : values (T,) by side: "left" and "right", or "" for the trunk and pelvis; NaN where unknown
    singular : (T,) True where the angle is not defined by the pose and must not be read, or None
    errors : (T,) standard error by side, where it is known
    unmeasured : sides with no marker on either segment, whose curve is what the video says
    """

    title: str
    unit: str
    time: np.ndarray
    sides: Mapping[str, np.ndarray]
    singular: np.ndarray | None = None
    errors: Mapping[str, np.ndarray] = field(default_factory=dict)
    unmeasured: frozenset[str] = frozenset()


@dataclass(frozen=True)
class MarkerResidual:
    """How well one marker is explained.

    Attributes
    ----------
    name : its new name, after its bone
    label : the file's name for it
    bone : the bone it was given to, "" if none
    mean_mm, worst_mm : distance from where the body puts it; NaN if it was not used
    worst_time : s, when it was worst
    lost : share of the frames in which it was lost, 0..1
    landmark : the bony landmark that it was drawn to, with its probability and distance in mm, in words; "" for none
    """

    name: str
    label: str
    bone: str
    mean_mm: float
    worst_mm: float
    worst_time: float
    lost: float
    landmark: str = ""


@dataclass(frozen=True, eq=False)
class Gaps:
    """When each marker was seen.

    Attributes
    ----------
    labels : M names
    time : (T,) s
    present : (T, M) True where measured
    filled : (T, M) True where filled in
    """

    labels: tuple[str, ...]
    time: np.ndarray
    present: np.ndarray
    filled: np.ndarray


@dataclass(frozen=True)
class Stage:
    """One step of the solve: its name, the settings it ran with, and the seconds it took (None if it was cached)."""

    title: str
    settings: Mapping[str, str] = field(default_factory=dict)
    seconds: float | None = None


@dataclass(frozen=True)
class Picture:
    """A view of the session: what it shows, and the PNG file's bytes."""

    caption: str
    png: bytes


@dataclass(frozen=True, eq=False)
class ReportData:
    """Everything in a report; what is empty or None gets no section.

    Attributes
    ----------
    title : of the session
    subtitle : one line on what was solved
    headlines : figures at the top
    warnings : what is ambiguous or doubtful, one sentence each
    pictures : views of the session
    inputs : files with digests
    groups : affinity and dendrogram
    hypotheses : best first
    margin : energy of the best different answer over the best, NaN or infinite if there is none
    angles : curves in the order they are drawn
    gait : the page of gait curves as SVG, "" where there were no whole cycles
    gait_notes : on that page, one sentence each
    zero_pose : what the angles are counted from, and their convention, in words
    residuals : one per marker
    gaps : when markers were seen
    stages : with settings, in the order they ran
    versions : program and libraries
    """

    title: str
    subtitle: str = ""
    headlines: tuple[Headline, ...] = ()
    warnings: tuple[str, ...] = ()
    pictures: tuple[Picture, ...] = ()
    inputs: tuple[InputFile, ...] = ()
    groups: Groups | None = None
    hypotheses: tuple[Hypothesis, ...] = ()
    margin: float = float("nan")
    angles: tuple[AngleCurve, ...] = ()
    gait: str = ""
    gait_notes: tuple[str, ...] = ()
    zero_pose: str = ""
    residuals: tuple[MarkerResidual, ...] = ()
    gaps: Gaps | None = None
    stages: tuple[Stage, ...] = ()
    versions: Mapping[str, str] = field(default_factory=dict)


def marker_residuals(
    names: tuple[str, ...],
    labels: tuple[str, ...],
    bones: tuple[str, ...],
    residual: np.ndarray,
    present: np.ndarray,
    time: np.ndarray,
    landmarks: tuple[str, ...] | None = None,
) -> tuple[MarkerResidual, ...]:
    """One row per marker from the residuals (T, M) m, presence (T, M) and clock (T,) s; the worst mean first."""
    rows = []
    drawn = landmarks or ("",) * len(names)
    for m, (name, label, bone) in enumerate(zip(names, labels, bones, strict=True)):
        known = np.isfinite(residual[:, m])
        mean = worst = when = float("nan")
        if known.any():
            frame = int(np.nanargmax(residual[:, m]))
            mean, worst, when = float(residual[known, m].mean()), float(residual[frame, m]), float(time[frame])
        lost = float(1 - present[:, m].mean())
        rows.append(MarkerResidual(name, label, bone, mean * 1000, worst * 1000, when, lost, drawn[m]))
    return tuple(sorted(rows, key=lambda row: -np.nan_to_num(row.mean_mm, nan=np.inf)))
