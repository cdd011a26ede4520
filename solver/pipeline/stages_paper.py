"""The stages of the published method: those of the default one, but for grouping and everything up to the fit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Unpack

from markerscope.solver.clustering.segment import Segmentation, SegmentSettings
from markerscope.solver.core.progress import Progress
from markerscope.solver.fit.published.results import PaperLocalization, PaperSolve
from markerscope.solver.fit.published.settings import PaperFitSettings, PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.pipeline.fitting import FittedTo, group_markers, scene
from markerscope.solver.pipeline.stage import NoSettings, Stage
from markerscope.solver.pipeline.stages import BODY, FITTED_TO, GRAPH, said_fit, said_orientation, said_segmentation


@dataclass(frozen=True)
class PaperSegmentSettings(SegmentSettings):
    """Grouping as in section 3.4.1: the tree cut at 5 mm, distance alone no reason to hold markers apart."""

    threshold: float = 0.005
    far: float = 0.0


def find_part(
    settings: PaperLocalizeSettings, progress: Progress, *, segment: Segmentation, **given: Unpack[FittedTo]
) -> PaperLocalization:
    """The part of the body that carries the markers."""
    from markerscope.solver.fit.published.localize import localize_paper

    body, seen, _ = scene(**given)
    return localize_paper(
        body, seen, given["clean"].markers.time, segment.clusters, settings, given["prior"].betas, progress
    )


def solve_stages(
    settings: PaperSolveSettings, progress: Progress, *, localize: PaperLocalization, **given: Unpack[FittedTo]
) -> PaperSolve:
    """The paper's five stages."""
    from markerscope.solver.fit.published.solve import solve_paper

    body, seen, _ = scene(**given)
    return solve_paper(body, seen, localize, settings, given["prior"].betas, progress)


def rank_yaws(
    settings: NoSettings,
    progress: Progress,
    *,
    localize: PaperLocalization,
    solve: PaperSolve,
    **given: Unpack[FittedTo],
) -> Orientation:
    """Its yaws and chains as candidates."""
    from markerscope.solver.fit.published.ranking import orientation_of

    body, seen, points = scene(**given)
    return orientation_of(body, seen, points, localize, solve)


def every_frame(
    settings: PaperFitSettings,
    progress: Progress,
    *,
    localize: PaperLocalization,
    solve: PaperSolve,
    orient: Orientation,
    **given: Unpack[FittedTo],
) -> FittedMotion:
    """Its answer at every frame of the markers."""
    from markerscope.solver.fit.published.motion import motion_of

    body, seen, _ = scene(**given)
    return motion_of(body, seen, given["clean"].markers.time, localize, solve, orient, settings, progress)


def _said_part(found: PaperLocalization) -> str:
    if found.whole_body:
        return f"whole body: the markers' box is {found.box:.2f} of the body's; {found.groups} groups"
    bones = len(found.pruned[0])
    return f"best of {len(found.pruned)} chains of {bones} bones, of which there are {found.chains}"


def _said_solve(solved: PaperSolve) -> str:
    yaw = solved.yaws[solved.chosen]
    distance = 1000 * yaw.one_way**0.5
    return f"yaw {yaw.start_deg:.0f} degrees of {len(solved.yaws)} tried, markers {distance:.1f} mm from the skin"


_OWN = (
    Stage(
        "segment",
        1,
        PaperSegmentSettings,
        ("clean",),
        group_markers,
        Segmentation,
        said_segmentation,
        cost=0.3,
    ),
    Stage(
        "localize",
        1,
        PaperLocalizeSettings,
        (*FITTED_TO, "segment"),
        find_part,
        PaperLocalization,
        _said_part,
        cost=30,
        shipped=BODY,
    ),
    Stage(
        "solve",
        1,
        PaperSolveSettings,
        (*FITTED_TO, "localize"),
        solve_stages,
        PaperSolve,
        _said_solve,
        cost=200,
        shipped=BODY,
    ),
    Stage(
        "orient",
        2,
        NoSettings,
        (*FITTED_TO, "localize", "solve"),
        rank_yaws,
        Orientation,
        said_orientation,
        cost=2,
        shipped=BODY,
    ),
    Stage(
        "fit",
        2,
        PaperFitSettings,
        (*FITTED_TO, "localize", "solve", "orient"),
        every_frame,
        FittedMotion,
        said_fit,
        cost=1,
        shipped=BODY,
    ),
)

GRAPH_PAPER = (
    *(stage for stage in GRAPH if stage.name not in {own.name for own in _OWN}),
    *_OWN,
)
"""Every stage of the published method; those that do not fit are the default method's."""
