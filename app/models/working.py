"""The trajectories as the decisions of now have them, cleaned or not yet: what curves show and edits are made on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from markerscope.app.models.stages import StageBoard
from markerscope.solver.cleaning.by_hand import NOWHERE, edited, sources
from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.cleaning.gaps import Gap, find_gaps
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.pipeline.cleaning import CleaningSettings, require_markers
from markerscope.solver.pipeline.store import Absent


@dataclass(frozen=True, eq=False)
class Working:
    """Trajectories of now.

    Attributes
    ----------
    raw : as the file has them
    edited : after the hand edits: what was measured, outliers among it
    settings : of the cleaning, with all that was decided
    cleaned : the last result of the cleaning, None before there is one
    in_force : whether that is the result of these settings
    """

    raw: Markers
    edited: Markers
    settings: CleaningSettings
    cleaned: Cleaned | None
    in_force: bool

    @cached_property
    def outliers(self) -> np.ndarray:
        """(T, M') True where a sample counts as an outlier: by the last cleaning, if it is the same sample."""
        positions = self.edited.positions
        found: np.ndarray = np.zeros(positions.shape[:2], dtype=bool)
        if self.cleaned is None or not len(self.cleaned.outliers.frame):
            return found
        cut = self.cleaned.outliers
        inside = (cut.frame < found.shape[0]) & (cut.marker < found.shape[1])
        frame, marker = cut.frame[inside], cut.marker[inside]
        same = (positions[frame, marker] == cut.values[inside]).all(axis=1)
        found[frame[same], marker[same]] = True
        for kept, first, last in self.settings.keep:
            if kept < found.shape[1]:
                found[first : last + 1, kept] = False
        return found

    @cached_property
    def measured(self) -> Markers:
        """What is measured and not cut: gaps are where this is lost."""
        if self.in_force and self.cleaned is not None:
            return self.cleaned.measured
        if not self.outliers.any():
            return self.edited
        positions = self.edited.positions.copy()
        positions[self.outliers] = np.nan
        return replace(self.edited, positions=positions)

    @cached_property
    def sources(self) -> np.ndarray:
        """(T, M') which of the file's trajectories each shows, ``NOWHERE`` for none."""
        return sources(self.settings.tracks, *self.raw.positions.shape[:2])

    @cached_property
    def gaps(self) -> tuple[Gap, ...]:
        """Every gap, by frame, then by marker."""
        return tuple(sorted(find_gaps(self.measured.present), key=lambda gap: (gap.first, gap.marker)))

    @cached_property
    def cut_stretches(self) -> tuple[Gap, ...]:
        """Every stretch that was cut as an outlier, by frame, then by marker."""
        mask = self.outliers
        whole = [Gap(int(m), 0, len(mask) - 1) for m in np.flatnonzero(mask.all(axis=0))]
        return tuple(sorted([*find_gaps(~mask), *whole], key=lambda gap: (gap.first, gap.marker)))

    @property
    def proposals(self) -> tuple[Proposal, ...]:
        """What the last cleaning proposes, by frame, less what was rejected; those accepted since are among it."""
        if self.cleaned is None:
            return ()
        rejected = set(self.settings.rejected)
        return tuple(
            p
            for p in sorted(self.cleaned.proposals, key=lambda p: p.frame)
            if (p.kind, *p.markers, p.frame) not in rejected
        )

    @property
    def rejected(self) -> tuple[Proposal, ...]:
        """Those that were rejected."""
        if self.cleaned is None:
            return ()
        known = set(self.settings.rejected)
        return tuple(p for p in self.cleaned.proposals if (p.kind, *p.markers, p.frame) in known)

    def accepted(self, proposal: Proposal) -> bool:
        """Whether a proposal has been made true, to be applied by the next cleaning."""
        a, b = (int(marker) for marker in proposal.markers)
        if proposal.kind == "swap":
            return (a, b, int(proposal.frame)) in self.settings.swaps
        return (a, b, int(proposal.frame), int(proposal.last)) in self.settings.joins

    @cached_property
    def of_marker(self) -> dict[int, list[Gap]]:
        """The gaps of each marker that has some, by frame."""
        found: dict[int, list[Gap]] = {}
        for gap in self.gaps:
            found.setdefault(gap.marker, []).append(gap)
        return found

    def gaps_of(self, marker: int, first: int, last: int) -> list[Gap]:
        """The gaps of a marker that a span of frames touches."""
        return [gap for gap in self.of_marker.get(marker, ()) if gap.first <= last and gap.last >= first]

    def seen_sources(self, marker: int, first: int, last: int) -> list[tuple[int, int, int]]:
        """(file's trajectory, first, last): the samples of the file that a marker shows in a span, outliers too."""
        shown = self.sources[first : last + 1, marker]
        seen = (shown != NOWHERE) & self.edited.present[first : last + 1, marker]
        shown = np.where(seen, shown, NOWHERE)
        begins = np.flatnonzero(np.diff(shown, prepend=NOWHERE - 1))
        ends = np.append(begins[1:], len(shown)) - 1
        return [(int(shown[a]), first + int(a), first + int(b)) for a, b in zip(begins, ends) if shown[a] != NOWHERE]


class WorkingTracks:
    """Has them made again when what they stand on is another."""

    def __init__(self, board: StageBoard) -> None:
        self._board = board
        self._stands_on: tuple[Any, ...] = ()
        self._now: Working | None = None

    def forget(self) -> None:
        """Let go of the trajectories of a session that is left."""
        self._stands_on, self._now = (), None

    def now(self) -> Working | None:
        """The trajectories of now; None before the markers are read, or where the edits cannot be made on them."""
        board = self._board
        markers, settings = board.latest("markers"), board.settings.get("clean")
        if markers is None or settings is None or not markers[1]:
            return None
        clean = board.latest("clean")
        try:
            raw = board.results.get("markers", markers[0])
            cleaned = None if clean is None else board.results.get("clean", clean[0])
        except Absent:
            return None
        stands_on = (raw, cleaned, settings, clean is not None and clean[1])
        known = self._stands_on
        if len(known) != 4 or any(a is not b for a, b in zip(known[:2], stands_on[:2])) or known[2:] != stands_on[2:]:
            self._stands_on, self._now = stands_on, _made(*stands_on)
        return self._now


def _made(raw: Markers, cleaned: Cleaned | None, settings: CleaningSettings, in_force: bool) -> Working | None:
    try:
        require_markers(settings, len(raw.labels))
    except InputError:  # whoever runs the stage hears why
        return None
    frames, count = len(raw.positions), settings.tracks.count(len(raw.labels))
    if cleaned is not None and len(cleaned.markers.positions) != frames:
        cleaned = None
    in_force = in_force and cleaned is not None and cleaned.markers.positions.shape[:2] == (frames, count)
    return Working(raw, edited(raw, settings.tracks), settings, cleaned, in_force)
