"""How the energies fell, and the body at any iteration that was kept."""

from __future__ import annotations

from markerscope.app.models.workbench import Workbench
from markerscope.app.views.convergence import TO_THE_END, TracedCurve, of_orientation, of_paper
from markerscope.app.views.running import curves_so_far
from markerscope.app.window.ghosts import Ghosts
from markerscope.app.window.shown import Shown
from markerscope.solver.core.progress import Found
from markerscope.widgets.plots.convergence import ConvergenceView


class ConvergenceBinder:
    """Fills the curves, and has the body follow the slider."""

    def __init__(self, widget: ConvergenceView, bench: Workbench, shown: Shown, ghosts: Ghosts) -> None:
        self.widget, self.bench, self.shown, self.ghosts = widget, bench, shown, ghosts
        self.curves: tuple[TracedCurve, ...] = ()
        self._telling = False
        shown.changed.connect(self._changed)
        bench.runner.found.connect(self._found)
        bench.runner.changed.connect(self.fill)
        bench.selection.changed.connect(self._select)
        widget.iteration_chosen.connect(self._chosen)

    def fill(self) -> None:
        """Show the descents that there are."""
        so_far: tuple[TracedCurve, ...] = ()
        if self.bench.runner.running:
            so_far = curves_so_far([note for notes in self.bench.runner.notes.values() for note in notes])
        curves = so_far or self._results()
        if len(curves) != len(self.curves) or any(a is not b for a, b in zip(curves, self.curves)):
            self.curves = curves
            self.widget.set_curves(curves, TO_THE_END)

    def _results(self) -> tuple[TracedCurve, ...]:
        found, ranked, solved = (self.shown.get(name) for name in ("localize", "orient", "solve"))
        from markerscope.solver.fit.published.results import PaperLocalization

        if isinstance(found, PaperLocalization):
            return self.shown.once("curves", (found, solved, ranked), lambda: of_paper(found, solved, ranked))
        return () if ranked is None else self.shown.once("curves", (ranked,), lambda: of_orientation(ranked))

    def _changed(self, stages: frozenset[str]) -> None:
        if stages & {"localize", "orient", "solve"}:
            self.fill()

    def _found(self, found: Found) -> None:
        if found.kind == "iteration" and self.widget.isVisible():
            self.fill()

    def _chosen(self, curve: int, iteration: int) -> None:
        if 0 <= curve < len(self.curves):
            own = self.curves[curve]
            self._telling = True
            try:
                self.bench.selection.select(
                    iteration=iteration, candidate=own.candidate if own.candidate >= 0 else None
                )
            finally:
                self._telling = False
            self.ghosts.show_iteration(own, own.step(iteration))

    def _select(self, what: frozenset[str]) -> None:
        """Show the descent of the candidate that was chosen elsewhere."""
        if self._telling or "candidate" not in what:
            return
        row = self.bench.selection.candidate
        place = next((k for k, own in enumerate(self.curves) if row is not None and own.candidate == row), -1)
        if place >= 0:
            steps = self.curves[place].iteration
            self.widget.set_iteration(place, int(steps[-1]) if len(steps) else 0)
