"""A recording cleaned: outliers cut, gaps filled, broken tracks pointed out. Nothing is lost by it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from markerscope.solver.cleaning.fill_by_hand import PlacedFill, parts_by_hand, put_in
from markerscope.solver.cleaning.gaps import Fill, FillMethod, FillSettings, find_gaps
from markerscope.solver.cleaning.outliers import OutlierSettings, find_outliers
from markerscope.solver.cleaning.request import Method
from markerscope.solver.cleaning.swaps import Proposal, find_proposals
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, silent


@dataclass(frozen=True)
class CleanSettings:
    """What is done to a recording.

    Attributes
    ----------
    outliers : which samples are cut
    fill_gaps : fill gaps, those of the cut samples among them
    fill : how
    tracks : look for tracks that exchanged or broke
    keep : (marker, first frame, last frame), samples that are not cut whatever they look like
    fills : (marker, first frame, last frame, method), gaps that are filled so in any case
    placed : gaps for which places are given
    """

    outliers: OutlierSettings = field(default_factory=OutlierSettings)
    fill_gaps: bool = True
    fill: FillSettings = field(default_factory=FillSettings)
    tracks: bool = True
    keep: tuple[tuple[int, int, int], ...] = ()
    fills: tuple[tuple[int, int, int, Method], ...] = ()
    placed: tuple[PlacedFill, ...] = ()


@dataclass(frozen=True, eq=False)
class Cut:
    """Samples taken out of a recording, and all that is needed to put them back.

    Attributes
    ----------
    frame, marker : (N,) indices
    values : (N, 3) m, as they were
    filled : (N,) True where the file had them as filled already
    """

    frame: np.ndarray
    marker: np.ndarray
    values: np.ndarray
    filled: np.ndarray

    def mask(self, shape: tuple[int, int]) -> np.ndarray:
        """(T, M) True where a sample was taken out."""
        mask = np.zeros(shape, dtype=bool)
        mask[self.frame, self.marker] = True
        return mask


@dataclass(frozen=True, eq=False)
class Cleaned:
    """A recording after cleaning.

    Attributes
    ----------
    markers : outliers cut, gaps filled and flagged in ``filled``
    outliers : what was cut
    fills : what was filled, by marker, then by frame
    proposals : edits that would mend exchanged or broken tracks; none has been made
    notes : what was done and what could not be, one sentence each
    """

    markers: Markers
    outliers: Cut
    fills: tuple[Fill, ...]
    proposals: tuple[Proposal, ...]
    notes: tuple[str, ...]

    @cached_property
    def measured(self) -> Markers:
        """What was measured and not cut: the markers that a body is fitted to, and that it is judged by."""
        return put_back(self, outliers=False) if self.fills else self.markers

    @cached_property
    def filled(self) -> np.ndarray:
        """(T, M) True where this cleaning filled a sample; those that the file had as filled are not among them."""
        return _mask(self.fills, self.markers.positions.shape[:2])

    @cached_property
    def decided(self) -> Markers:
        """What was measured and not cut, with the gaps that were filled by hand, flagged: what is exported."""
        others = tuple(fill for fill in self.fills if not fill.by_hand)
        return put_back(replace(self, fills=others), outliers=False) if others else self.markers


def clean(
    markers: Markers,
    settings: CleanSettings | None = None,
    progress: Progress = silent,
    fill_by: FillMethod | None = None,
) -> Cleaned:
    """Cut outliers, fill gaps, point out tracks that exchanged or broke.

    Measured samples stay as they are, to the bit, unless they are cut; lost ones stay lost where nothing can be known.

    Parameters
    ----------
    fill_by : how gaps are filled, instead of by the method that the settings name

    Raises
    ------
    InputError : not one marker is seen in the recording
    """
    from markerscope.solver.cleaning.fill import fill

    settings = settings or CleanSettings()
    if not markers.present.any():
        raise InputError(
            "holds no marker position: every sample is lost", markers.source, "export the trial with its trajectories"
        )
    progress(0.0, "looking for outliers")
    out = find_outliers(markers.positions, markers.rate, settings.outliers)
    for kept, first, last in settings.keep:
        out[first : last + 1, kept] = False
    frame, marker = np.nonzero(out)
    already = np.zeros(out.shape, bool) if markers.filled is None else markers.filled
    cut = Cut(frame, marker, markers.positions[frame, marker].copy(), already[frame, marker].copy())
    without = _without(markers, out)
    progress(0.2, "looking for exchanged tracks")
    proposals = find_proposals(without) if settings.tracks else ()
    fills: tuple[Fill, ...] = ()
    notes: tuple[str, ...] = ()
    cleaned = without
    if settings.fill_gaps:
        progress(0.3, "filling gaps")
        result = (fill_by or fill)(without.positions, without.rate, settings.fill)
        cleaned = replace(without, positions=result.positions, filled=(already & ~out) | result.filled)
        fills, notes = result.fills, result.notes
    if settings.fills or settings.placed:
        progress(0.8, "filling gaps as decided by hand")
        parts, left = parts_by_hand(without, settings.fills, settings.placed)
        positions, fills = put_in(cleaned.positions, fills, parts)
        cleaned = replace(cleaned, positions=positions, filled=(already & ~out) | _mask(fills, out.shape))
        notes = (*notes, *left)
    progress(1.0, "clean")
    return Cleaned(cleaned, cut, fills, proposals, (*_notes(cleaned, cut, fills, proposals), *notes))


def put_back(cleaned: Cleaned, outliers: bool = True, fills: bool = True) -> Markers:
    """The markers with fillings taken out again, and what was cut put back: both together give what was measured."""
    markers = cleaned.markers
    positions = markers.positions.copy()
    filled = None if markers.filled is None else markers.filled.copy()
    cut = cleaned.outliers
    if fills:
        positions[cleaned.filled] = np.nan
        if filled is not None:
            filled[cleaned.filled] = False
    if outliers:
        positions[cut.frame, cut.marker] = cut.values
        if filled is not None:
            filled[cut.frame, cut.marker] = cut.filled
    return replace(markers, positions=positions, filled=filled)


def _mask(fills: tuple[Fill, ...], shape: tuple[int, ...]) -> np.ndarray:
    mask = np.zeros(shape, dtype=bool)
    for span in fills:
        mask[span.first : span.last + 1, span.marker] = True
    return mask


def _without(markers: Markers, out: np.ndarray) -> Markers:
    positions = markers.positions.copy()
    positions[out] = np.nan
    return replace(markers, positions=positions, filled=None if markers.filled is None else markers.filled & ~out)


def _notes(markers: Markers, cut: Cut, fills: tuple[Fill, ...], proposals: tuple[Proposal, ...]) -> tuple[str, ...]:
    left = find_gaps(markers.present)
    never = int((~markers.present.any(axis=0)).sum())
    said = []
    if len(cut.frame):
        said.append(f"{len(cut.frame)} samples of {len(set(cut.marker.tolist()))} markers were cut as outliers.")
    if fills:
        samples = sum(fill.length for fill in fills)
        error = sum(fill.error * fill.length for fill in fills) / samples
        known = f"{1000 * error:.1f} mm" if np.isfinite(error) else "not known"
        said.append(f"{len(fills)} gaps ({samples} samples) were filled; expected error {known}.")
    if left:
        said.append(f"{len(left)} gaps ({sum(gap.length for gap in left)} samples) are left as they were.")
    if never:
        said.append(f"{never} marker{'s were' if never > 1 else ' was'} never seen and stay{'s' * (never == 1)} lost.")
    if proposals:
        said.append(f"{len(proposals)} edits of exchanged or broken tracks are proposed; none was made.")
    return tuple(said)
