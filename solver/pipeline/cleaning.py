"""The stage that cleans the markers, and what of it the later stages may look at."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from markerscope.solver.cleaning.by_hand import TrackEdits, edited
from markerscope.solver.cleaning.clean import Cleaned, CleanSettings, clean
from markerscope.solver.cleaning.fill_by_hand import PlacedFill
from markerscope.solver.cleaning.gaps import FillSettings
from markerscope.solver.cleaning.outliers import OutlierSettings
from markerscope.solver.cleaning.request import Filling, Method, OutlierMethod
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress
from markerscope.solver.pipeline.digest import CHANGES_NOTHING

BY_FRAME = ("keep", "swaps", "joins", "deletes", "cuts", "fills", "placed", "rejected")
"""Settings that are decided by hand and name markers and frames."""


@dataclass(frozen=True)
class CleaningSettings:
    """How the markers are cleaned before anything is made of them.

    Attributes
    ----------
    outliers : how they are found; ``none`` cuts nothing
    ratio : times the usual acceleration that is too much
    least : m, samples nearer to their track than this are never outliers
    fill : how gaps are filled for the grouping; filled samples count as measured nowhere
    max_gap : s, longer gaps stay
    min_confidence : 0..1, gaps whose filling would be less sure stay
    keep : (marker, first frame, last frame), samples that are not cut
    swaps : (marker, marker, frame), tracks to be exchanged from that frame on
    joins : (marker, other, first frame, last frame), samples of the other to be given to the marker
    deletes : (marker, first frame, last frame), samples of the file's trajectory that are taken out
    cuts : (marker, first frame, last frame, number), samples of the file's trajectory that go to a new one
    fills : (marker, first frame, last frame, method), gaps to be filled so; filled samples count as measured nowhere
    placed : gaps for which the places of a fitted body were taken
    rejected : (kind, marker, marker, frame), proposed edits that are not offered again
    """

    outliers: OutlierMethod = "local"
    ratio: float = OutlierSettings.ratio
    least: float = OutlierSettings.least
    fill: Filling = "none"
    max_gap: float | None = FillSettings.max_gap
    min_confidence: float = FillSettings.min_confidence
    keep: tuple[tuple[int, int, int], ...] = ()
    swaps: tuple[tuple[int, int, int], ...] = ()
    joins: tuple[tuple[int, int, int, int], ...] = ()
    deletes: tuple[tuple[int, int, int], ...] = ()
    cuts: tuple[tuple[int, int, int, int], ...] = ()
    fills: tuple[tuple[int, int, int, Method], ...] = ()
    placed: tuple[PlacedFill, ...] = ()
    rejected: tuple[tuple[Literal["swap", "join"], int, int, int], ...] = field(default=(), metadata=CHANGES_NOTHING)

    def __post_init__(self) -> None:
        """Refuse what cannot work. Frames past the end are no mistake: the range may have been cut since."""
        self.plain()
        spans = [*((first, last) for _, first, last in (*self.keep, *self.deletes))]
        spans += [(first, last) for *_, first, last in self.joins]
        spans += [(first, last) for _, first, last, _ in (*self.cuts, *self.fills)]
        spans += [(given.first, given.last) for given in self.placed]
        for name, rows in (("swaps", self.swaps), ("joins", self.joins)):
            if twice := [row for row in rows if row[0] == row[1]]:
                raise ValueError(f"{name} names marker {twice[0][0]} twice, where two markers are needed")
        for first, last in [*spans, *((frame, frame) for *_, frame in self.swaps)]:
            if not 0 <= first <= last:
                raise ValueError(f"an edit of tracks goes from frame {first} to {last}: frames count up from 0")

    def plain(self) -> CleanSettings:
        """The same for ``clean``."""
        return CleanSettings(
            OutlierSettings(method=self.outliers, ratio=self.ratio, least=self.least),
            fill_gaps=self.fill != "none",
            fill=FillSettings(
                method="regression" if self.fill == "none" else self.fill,
                max_gap=self.max_gap,
                min_confidence=self.min_confidence,
            ),
            keep=self.keep,
            fills=self.fills,
            placed=self.placed,
        )

    @property
    def tracks(self) -> TrackEdits:
        """What is decided about trajectories."""
        return TrackEdits(self.deletes, self.cuts, self.swaps, self.joins)


def clean_markers(settings: CleaningSettings, progress: Progress, *, markers: Markers) -> Cleaned:
    """The edits made that the user chose, outliers cut, gaps filled if asked for."""
    require_markers(settings, len(markers.labels))
    return clean(edited(markers, settings.tracks), settings.plain(), progress)


def require_markers(settings: CleaningSettings, columns: int) -> None:
    """Refuse edits that name markers which a file with so many has not.

    Raises
    ------
    InputError : one does
    """
    count = settings.tracks.count(columns)
    new = sorted({number for *_, number in settings.cuts})
    if new != list(range(columns, count)):
        raise InputError(
            f"trajectories cut off are numbered {new}, and have to be numbered on from {columns}",
            "clean",
            "correct the cuts",
        )
    own = [m for m, *_ in (*settings.deletes, *settings.cuts)]
    named = [m for a, b, *_ in (*settings.swaps, *settings.joins) for m in (a, b)]
    named += [row[0] for row in settings.keep] + [row[0] for row in settings.fills]
    named += [given.marker for given in settings.placed]
    for markers, most in ((own, columns), (named, count)):
        for marker in markers:
            if not 0 <= marker < most:
                raise InputError(
                    f"there is no marker {marker}; they are numbered 0 to {most - 1}", "clean", "correct the edit"
                )


def notes_of(cleaned: Cleaned) -> tuple[str, ...]:
    """What a user should know of the cleaning: what was cut, and each edit that is proposed."""
    cut = cleaned.outliers
    said = f"{len(cut.frame)} samples of {len(set(cut.marker.tolist()))} markers were cut as outliers."
    return (*((said,) if len(cut.frame) else ()), *(edit.sentence for edit in cleaned.proposals))


def said_cleaning(cleaned: Cleaned) -> str:
    """What was cut, filled and proposed."""
    cut, filled = len(cleaned.outliers.frame), int(cleaned.filled.sum())
    return f"{cut} samples cut, {filled} filled, {len(cleaned.proposals)} edits of tracks proposed"
