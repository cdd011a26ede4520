"""The joint angles as curves."""

from __future__ import annotations

import numpy as np

from app.models.workbench import Workbench
from app.views.angles import angles_picture
from app.window.shown import Shown
from widgets.plots.curves import CurvesView


class AnglesBinder:
    """Fills the plots; they follow the clock and the timelines' view."""

    def __init__(self, widget: CurvesView, bench: Workbench, shown: Shown) -> None:
        self.widget, self.bench, self.shown = widget, bench, shown
        shown.changed.connect(self._changed)
        bench.opened.connect(self._opened)
        bench.clock.moved.connect(widget.set_time)
        widget.seeked.connect(bench.clock.seek)

    def _opened(self) -> None:
        if not self.bench.document.is_open:
            self.widget.set_curves(np.zeros(0), ())
        self._restored = False

    def _changed(self, stages: frozenset[str]) -> None:
        if not stages & {"angles", "fit", "compared"}:
            return
        angles, motion = self.shown.get("angles"), self.shown.get("fit")
        if angles is None:
            self.widget.set_curves(np.zeros(0), ())
            return
        others = list(self.shown.compared("angles").values())
        bones = motion.marker_joint if motion is not None and not self.shown.stale("fit") else None
        reference = others[0] if others else None
        picture = self.shown.once(
            "angle curves", (angles, bones, reference), lambda: angles_picture(angles, bones, reference)
        )
        before = self.widget.shown()
        self.widget.set_curves(picture.time, picture.plots, picture.convention, picture.zero_pose)
        known = self.bench.document.view.get("angles")
        titles = {plot.title for plot in picture.plots}
        if not before and isinstance(known, list) and titles & set(known):
            self.widget.set_shown([title for title in known if title in titles])
        self.widget.set_time(self.bench.clock.time)
