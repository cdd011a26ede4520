"""The stages of the published method: those of the default one, but for grouping and everything up to the fit."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from markerscope.solver.clustering.segment import Segmentation, SegmentSettings
from markerscope.solver.core.progress import Progress
from markerscope.solver.fit.published.results import PaperLocalization, PaperSolve
from markerscope.solver.fit.published.settings import PaperFitSettings, PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.pipeline.fitting import group_markers
from markerscope.solver.pipeline.fitting import scene as scene_of
from markerscope.solver.pipeline.stage import NoSettings, Stage
from markerscope.solver.pipeline.stages import BODY, FITTED_TO, GRAPH, said_fit, said_orientation, said_segmentation


@dataclass(frozen=True)
class PaperSegmentSettings(SegmentSettings):
    """Grouping as in section 3.4.1: the tree cut at 5 mm, distance alone no reason to hold markers apart."""

    threshold: float = 0.005
    far: float = 0.0


def find_part(given: Mapping[str, Any], settings: PaperLocalizeSettings, progress: Progress) -> PaperLocalization:
    """The part of the body that carries the markers."""
    from markerscope.solver.fit.published.localize import localize_paper

    body, seen, _ = scene_of(given)
    return localize_paper(
        body, seen, given["clean"].markers.time, given["segment"].clusters, settings, given["prior"].betas, progress
    )


def solve_stages(given: Mapping[str, Any], settings: PaperSolveSettings, progress: Progress) -> PaperSolve:
    """The paper's five stages."""
    from markerscope.solver.fit.published.solve import solve_paper

    body, seen, _ = scene_of(given)
    return solve_paper(body, seen, given["localize"], settings, given["prior"].betas, progress)


def rank_yaws(given: Mapping[str, Any], settings: NoSettings, progress: Progress) -> Orientation:
    """Its yaws and chains as candidates."""
    from markerscope.solver.fit.published.ranking import orientation_of

    body, seen, points = scene_of(given)
    return orientation_of(body, seen, points, given["localize"], given["solve"])


def every_frame(given: Mapping[str, Any], settings: PaperFitSettings, progress: Progress) -> FittedMotion:
    """Its answer at every frame of the markers."""
    from markerscope.solver.fit.published.motion import motion_of

    body, seen, _ = scene_of(given)
    found, solved, ranked = given["localize"], given["solve"], given["orient"]
    return motion_of(body, seen, given["clean"].markers.time, found, solved, ranked, settings, progress)


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
        1,
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
        1,
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
