"""Which results each view draws, and the note above it where one of them is out of date."""

from __future__ import annotations

from collections.abc import Mapping

from markerscope.app.models.fields import title
from markerscope.app.window.shown import Shown
from markerscope.widgets.panels.dated import Dated

_MARKERS = ("markers", "clean")
DRAWN: Mapping[str, tuple[str, ...]] = {
    "scene": (*_MARKERS, "segment", "localize", "solve", "orient", "fit", "neutral"),
    "video": (*_MARKERS, "landmarks", "sync", "segment", "fit"),
    "affinity": (*_MARKERS, "segment"),
    "candidates": (*_MARKERS, "localize", "orient"),
    "hypotheses": (*_MARKERS, "localize", "solve", "orient", "check"),
    "convergence": ("localize", "solve", "orient"),
    "markers": (*_MARKERS, "segment", "fit", "check"),
    "timelines": (*_MARKERS, "landmarks", "prior", "sync", "segment", "orient", "fit"),
    "curves": (*_MARKERS, "fit"),
    "angles": ("fit", "neutral", "angles", "errors"),
}
"""The stages whose results each view may draw, by panel. Cards and the history stand apart: they name their states."""


def note_of(shown: Shown, view: str) -> str:
    """What stands above a view: the results in it that are not what the settings ask for; empty where none is."""
    old = shown.out_of_date(DRAWN[view])
    if not old:
        return ""
    names = ", ".join(title(stage) for stage in old)
    return f"Out of date: {names}. A setting or a file has changed since; Run all (F5) brings this up to date."


class DatedBinder:
    """Has every panel say what in it is out of date.

    Parameters
    ----------
    panels : by the names of ``DRAWN``
    """

    def __init__(self, panels: Mapping[str, Dated], shown: Shown) -> None:
        self.panels, self.shown = panels, shown
        shown.changed.connect(lambda stages: self.fill())
        shown.dated.connect(lambda stages: self.fill())

    def fill(self) -> None:
        """Say it, or nothing."""
        for name, panel in self.panels.items():
            panel.set_note(note_of(self.shown, name))
