"""The stage that cleans the markers, and what of it the later stages may look at."""

from __future__ import annotations

from dataclasses import dataclass

from markerscope.solver.cleaning.clean import Cleaned, CleanSettings, clean
from markerscope.solver.cleaning.gaps import FillSettings
from markerscope.solver.cleaning.outliers import OutlierSettings
from markerscope.solver.cleaning.request import Filling, OutlierMethod
from markerscope.solver.cleaning.swaps import Proposal, apply_proposals
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress


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

    def __post_init__(self) -> None:
        """Refuse what cannot work. Frames past the end are no mistake: the range may have been cut since."""
        self.plain()
        spans = [*((first, last) for _, first, last in self.keep), *((first, last) for *_, first, last in self.joins)]
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
        )


def clean_markers(settings: CleaningSettings, progress: Progress, *, markers: Markers) -> Cleaned:
    """The edits made that the user chose, outliers cut, gaps filled if asked for."""
    count, frames = len(markers.labels), len(markers.positions)
    edits = [
        *(Proposal("swap", frame, frames - 1, (a, b), 0.0, "") for a, b, frame in settings.swaps),
        *(Proposal("join", first, last, (a, b), 0.0, "") for a, b, first, last in settings.joins),
    ]
    named = [m for edit in edits for m in edit.markers] + [m for m, _, _ in settings.keep]
    for marker in named:
        if not 0 <= marker < count:
            raise InputError(
                f"there is no marker {marker}; they are numbered 0 to {count - 1}", "clean", "correct the edit"
            )
    return clean(apply_proposals(markers, edits), settings.plain(), progress)


def notes_of(cleaned: Cleaned) -> tuple[str, ...]:
    """What a user should know of the cleaning: what was cut, and each edit that is proposed."""
    cut = cleaned.outliers
    said = f"{len(cut.frame)} samples of {len(set(cut.marker.tolist()))} markers were cut as outliers."
    return (*((said,) if len(cut.frame) else ()), *(edit.sentence for edit in cleaned.proposals))


def said_cleaning(cleaned: Cleaned) -> str:
    """What was cut, filled and proposed."""
    cut, filled = len(cleaned.outliers.frame), int(cleaned.filled.sum())
    return f"{cut} samples cut, {filled} filled, {len(cleaned.proposals)} edits of tracks proposed"
