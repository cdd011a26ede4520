"""The joint angles as curves, beside those of the results that are compared."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import QTimer

from markerscope.app.actions import Actions
from markerscope.app.actions.edit_actions import TELL_ANGLES
from markerscope.app.models.results import Ref
from markerscope.app.models.workbench import Workbench
from markerscope.app.views.angles import angles_picture, bones_of, conventions, joint_of
from markerscope.app.window.shown import Shown
from markerscope.widgets.plots.curves import CurvesView


class AnglesBinder:
    """Fills the plots; they follow the clock and the selection."""

    def __init__(self, widget: CurvesView, bench: Workbench, shown: Shown, table: Actions) -> None:
        self.widget, self.bench, self.shown = widget, bench, shown
        self.table = table
        self._filling = QTimer(widget, singleShot=True, interval=0)  # after the scene, so that neither waits for both
        self._filling.timeout.connect(self._fill)
        shown.changed.connect(self._changed)
        shown.dated.connect(self._changed)
        bench.opened.connect(self._opened)
        bench.document.changed.connect(lambda another: self._conventions())
        bench.clock.moved.connect(widget.set_time)
        bench.selection.changed.connect(self._select)
        widget.seeked.connect(bench.clock.seek)
        widget.joint_chosen.connect(self._joint)
        widget.convention_chosen.connect(self._convention)
        widget.export_wanted.connect(lambda: table.trigger("export.angles"))

    def _opened(self) -> None:
        if not self.bench.document.is_open:
            self.widget.set_conventions((), "")
            self.widget.set_curves(np.zeros(0), ())

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"angles", "errors", "fit", "compared"}:
            self._filling.start()

    def _fill(self) -> None:
        if not self.bench.document.is_open:
            return
        angles, motion = self.shown.get("angles"), self.shown.get("fit")
        self._conventions()
        if angles is None:
            self.widget.set_curves(np.zeros(0), ())
            return
        bones = motion.marker_joint if motion is not None and not self.shown.stale("fit") else None
        reference, said, missing = self._reference(angles.convention)
        errors = None if self.shown.stale("errors") else self.shown.get("errors")
        picture = self.shown.once(
            "angle curves",
            (angles, bones, reference, errors),
            lambda: angles_picture(angles, bones, reference, errors),
        )
        before, old = self.widget.shown(), self.shown.stale("angles")
        self.widget.set_curves(picture.time, picture.plots, picture.convention, picture.zero_pose, said, missing, old)
        known = self.bench.document.view.get("angles")
        titles = {plot.title for plot in picture.plots}
        if not before and isinstance(known, list) and titles & set(known):
            self.widget.set_shown([title for title in known if title in titles])
        self.widget.set_time(self.bench.clock.time)
        self._select(frozenset({"bone"}))

    def _reference(self, convention: str) -> tuple[Any, str, str]:
        """The angles that are compared, and what they are of: their own, or those of a fit that is compared.

        Where there are none although something is compared, the last says why.
        """
        missing = ""
        for ref, angles in self.shown.compared("angles").items():
            if angles.convention == convention:
                return angles, self._said("angles", ref.key), ""
            missing = "The angles that are compared are told by another convention, so they are not drawn."
        board = self.bench.board
        for ref in self.shown.compared("fit"):
            missing = (
                "The fit that is compared has no angles in this convention yet, so none are drawn: "
                "go back to it once and run the stage Angles."
            )
            for entry in board.results.entries("angles"):
                same = entry.about.get("settings", {}).get("convention") == convention
                if not same or entry.about.get("inputs", {}).get("fit") != ref.key:
                    continue
                if board.results.is_loaded("angles", entry.key):
                    return board.results.get("angles", entry.key), self._said("fit", ref.key), ""
                board.results.loaded.connect(self._loaded)
                board.results.load_ahead("angles", entry.key)
                missing = ""
        return None, "", missing

    def _said(self, stage: str, key: str) -> str:
        row = next((row for row in self.bench.board.card(stage).earlier if row.key == key), None)
        return "" if row is None else row.settings or f"of {row.when}"

    def _loaded(self, ref: Ref) -> None:
        if ref.stage == "angles":
            self._changed(frozenset({"compared"}))

    def _conventions(self) -> None:
        board = self.bench.board
        settings = board.settings.get("angles") if self.bench.document.is_open else None
        if settings is not None:
            self.widget.set_conventions(
                [(name, own["title"]) for name, own in conventions().items()], settings.convention
            )
            why_not = self.table.why_not_with(TELL_ANGLES, settings.convention)
            self.widget.set_reasons(why_not, self.table.why_not("export.angles"))

    def _convention(self, name: str) -> None:
        """Tell the angles by another convention at once, where there is a fit to tell them of."""
        if not self.table.do(TELL_ANGLES, name):
            self._conventions()

    def _select(self, what: frozenset[str]) -> None:
        if "bone" in what:
            self.widget.set_joint(joint_of(self.bench.selection.bone))

    def _joint(self, joint: str) -> None:
        """Select the markers on the bones that turn about a joint."""
        motion = self.shown.fit
        if motion is not None:
            self.bench.selection.select_markers(np.flatnonzero(np.isin(motion.marker_joint, bones_of(joint))))
            self.widget.set_joint(joint)
