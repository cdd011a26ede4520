"""Methods with something left out, and the published method after each of its stages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from markerscope.solver.bench.methods import (
    PAPER_CODE,
    Given,
    Solved,
    Variant,
    bundle,
    outcome,
    paper,
    run_stages,
    scene_of,
)
from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.fit.published.results import BodyState
from markerscope.solver.fit.published.settings import PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.state import Observations, Weights

_OFFSET = 0.0095


@dataclass(frozen=True)
class HeldPlacement(OrientSettings):
    """Markers stay on the vertices that they were given to, in the middle of where a marker may be above the skin."""

    def weights(self) -> Weights:
        """The same as weights of the fit."""
        return replace(super().weights(), free_placement=False)


def unfitted(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """The cheapest hypothesis of the default method as it is: the video's pose, turned and shifted onto the markers."""
    from markerscope.solver.fit.kinematics import Pose, forward, place_points
    from markerscope.solver.fit.placement import Skin
    from markerscope.solver.fit.published.motion import fitted_motion

    results, seconds = run_stages("bundle", given, settings, "localize", progress)
    body, seen, _ = scene_of(results)
    found = results["localize"]
    turn, vertex = found.R_lab_cam[0], found.vertex[0]
    rotations, betas = seen.prior.copy(), np.zeros(body.shape_count)
    rotations[:, 0] = turn @ rotations[:, 0]
    pose = Pose(rotations, np.zeros((len(rotations), 3)), betas)
    placement, _ = Skin(body, betas).on_vertices(vertex, _OFFSET)
    gap = seen.markers[:, found.markers] - place_points(placement, forward(body, pose), betas)
    known = np.isfinite(gap).all(axis=2).any(axis=1)
    every = np.arange(len(gap))
    shift = np.nanmean(gap[known], axis=1)
    trans = np.stack([np.interp(every, every[known], column) for column in shift.T], axis=1)
    motion = fitted_motion(
        body,
        seen.markers,
        given.markers.time,
        replace(pose, trans=trans),
        found.markers,
        vertex,
        _OFFSET,
        camera=CameraResult(turn, np.zeros(3), 0.0, (0, 0), float("nan")),
        chosen=0,
        confidence=float("nan"),
        warnings=(),
    )
    return Solved(motion, body, results["sync"].offset, seconds)


def paper_by_stages(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """The published method, with what it had after part matching, stage 2 and stage 4 of its best yaw (table 4)."""
    results, seconds = run_stages("paper", given, settings, "fit", progress)
    body, seen, _ = scene_of(results)
    solved = outcome("paper", results, seconds)
    return replace(solved, steps=partial(_paper_steps, body, seen, given.markers, results))


def _paper_steps(
    body: Body, seen: Observations, markers: Markers, results: Mapping[str, Any]
) -> dict[str, FittedMotion]:
    from markerscope.solver.core.rotations import slerp
    from markerscope.solver.fit.kinematics import Pose
    from markerscope.solver.fit.published.motion import fitted_motion, full_shape
    from markerscope.solver.fit.published.sequence import sequence_of, turned_video
    from markerscope.solver.fit.published.solve import nearest_on_average

    found, solved, last = results["localize"], results["solve"], results["fit"]
    best = solved.yaws[solved.chosen]
    sequence = sequence_of(body, seen, found.frames, found.markers, len(found.betas))
    yaw = found.yaw_deg + best.start_deg
    matched = BodyState(turned_video(sequence.rotations.numpy(), yaw), found.trans, found.betas)
    states = {
        "after part matching": (matched, nearest_on_average(sequence, matched)),
        "after stage 2": (best.pose.body, best.vertex),
        "after stage 4": (best.markers.body, best.vertex),
    }
    at, time = markers.time[found.frames], markers.time
    motions = {}
    for name, (state, vertex) in states.items():
        trans = np.stack([np.interp(time, at, column) for column in state.trans.T], axis=1)
        motions[name] = fitted_motion(
            body,
            seen.markers,
            time,
            Pose(slerp(state.rotations, at, time), trans, full_shape(body, state.betas)),
            found.markers,
            vertex,
            solved.settings.offset,
            camera=last.camera,
            chosen=last.chosen,
            confidence=last.confidence,
            warnings=last.warnings,
        )
    return motions


def ablations() -> tuple[Variant, ...]:
    """Each is named after the method that it is compared with."""
    yaws = (1, 2, 4)
    return (
        *(
            Variant(
                f"bundle-{count}-yaw{'s' * (count > 1)}",
                f"the default method, searching from {count} of the camera's headings instead of "
                f"{LocalizeSettings().yaws}",
                bundle,
                {"localize": LocalizeSettings(yaws=count)},
            )
            for count in yaws
        ),
        Variant(
            "bundle-few-keyframes",
            "the default method on 6 and 12 keyframes",
            bundle,
            {"localize": LocalizeSettings(few=6, many=12)},
        ),
        Variant(
            "bundle-on-vertices",
            "the default method without solving where on the skin a marker sits",
            bundle,
            {"orient": HeldPlacement()},
        ),
        Variant(
            "bundle-without-landmarks",
            "the default method without the pull to bony landmarks",
            bundle,
            {"fit": FitSettings(landmark_pull="off")},
        ),
        Variant("bundle-unfitted", "the default method's cheapest hypothesis before any adjustment", unfitted),
        Variant(
            "paper-stages",
            "the published method after each of its stages (its table 4)",
            paper_by_stages,
            {"localize": PaperLocalizeSettings(), "solve": PaperSolveSettings()},
            PAPER_CODE,
        ),
        Variant(
            "paper-1-yaw",
            "the published method from one yaw (its table 3)",
            paper,
            {"localize": PaperLocalizeSettings(), "solve": PaperSolveSettings(yaws=1)},
            PAPER_CODE,
        ),
    )
