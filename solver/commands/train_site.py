"""What a network is trained for: a layout with a name, on anybody, or that of a session, on its own body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress
from markerscope.solver.neural.layout import Layout, named_layout, session_layout
from markerscope.solver.neural.layout_free.finetune import Ground
from markerscope.solver.neural.places import places_of
from markerscope.solver.neural.request import TrainRequest
from markerscope.solver.neural.training.library import Clip

if TYPE_CHECKING:
    from markerscope.solver.neural.training.examples import Sampler
    from markerscope.solver.pipeline.session import Session
    from markerscope.solver.pipeline.stage import GraphRun

_BODIES = 48, 12
"""That are learnt from, and that are judged on."""
_LEARNT = 0.9
"""Of each motion; the rest of it is only judged on."""


@dataclass(frozen=True, eq=False)
class Site:
    """A layout, and whose body it is on.

    Attributes
    ----------
    layout : with the vertices and labels of its markers
    body : on whose mean shape it is
    own : whether that is one person's, and bodies differ from it by no more than a fit is off
    """

    layout: Layout
    body: Body
    own: bool

    def samplers(self, clips: Sequence[Clip], seed: int) -> tuple[Sampler, Sampler]:
        """What is learnt from, and what is judged on: the last tenth of each clip, on other bodies."""
        from markerscope.solver.neural.per_layout.named import groups_of
        from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool

        settings = ExampleSettings(fingers=len(groups_of(self.layout)) > 1)
        bones, bumps = 0.03, 0.010
        if self.own:
            settings = replace(settings, spread=0.2, bones=0.3, placement_mm=3.0, height_mm=1.0)
            bones, bumps = 0.01, 0.003
        learnt = body_pool(self.body, _BODIES[0], seed, bones=bones, bumps=bumps)
        judged = body_pool(self.body, _BODIES[1], seed + 1000, bones=bones, bumps=bumps, plain=False)
        return (
            Sampler([clip.part(0, _LEARNT) for clip in clips], learnt, settings),
            Sampler([clip.part(_LEARNT, 1) for clip in clips], judged, settings.plain()),
        )


def site_of(request: TrainRequest, progress: Progress) -> Site:
    """Where a network of one layout is to work; a session is solved first, where it was not."""
    if request.layout is not None:
        body = Body.load()
        return Site(named_layout(body, request.layout), body, own=False)  # type: ignore[arg-type]
    from markerscope.solver.body.bones import with_bone_lengths
    from markerscope.solver.pipeline.names import CLEAN, FIT

    session, run = _solved(request.session, FIT, progress)
    body, fitted = _body(session), run[FIT]
    grown = with_bone_lengths(body)
    person = replace(body, template=grown.surface(fitted.betas), joint_template=grown.joints(fitted.betas), _torch={})
    return Site(session_layout(grown, fitted, run[CLEAN].markers.labels), person, own=True)


def ground_of(request: TrainRequest, progress: Progress) -> tuple[Ground, dict[str, Any], tuple[str, ...]]:
    """The same for the layout-agnostic network: where its markers sit, and what they are called, beside it.

    Of a session it takes the markers as its fit goes on with them, which need not have been fitted.
    """
    if request.layout is not None:
        site = site_of(request, progress)
        return Ground(site.body, layout=site.layout), places_of(site.body, site.layout.vertex), site.layout.labels
    from markerscope.solver.body.bones import with_bone_lengths
    from markerscope.solver.fit.method import chosen_row
    from markerscope.solver.neural.layout_free.agnostic_fit import marked
    from markerscope.solver.pipeline.methods import graph_of
    from markerscope.solver.pipeline.names import CLEAN, LOCALIZE, ORIENT

    session, run = _solved(request.session, ORIENT, progress)
    fit = session.stage_settings(graph_of(session))["fit"]
    candidate = run[ORIENT].candidates[chosen_row(run[ORIENT], fit)]
    body, used = _body(session), run[CLEAN].markers.labels
    labels = tuple(used[int(i)] for i in run[LOCALIZE].markers)
    person = marked(with_bone_lengths(body), candidate)
    return Ground(body, person=person), places_of(body, candidate.vertex), labels


def _solved(path: Path | None, stage: str, progress: Progress) -> tuple[Session, GraphRun]:
    """A session as far as one of its stages; what is not cached is computed."""
    from markerscope.solver.pipeline.run import run_stages
    from markerscope.solver.pipeline.session import load_session

    assert path is not None
    if not path.exists():
        raise InputError("there is no such session", path, "check the name and the folder")
    session = load_session(path)
    return session, run_stages(session, ("markers", stage), progress)


def _body(session: Session) -> Body:
    file = session.inputs.get("body_file")
    return Body.load(None if file is None else file.path)
