"""The stages of the method with a network: those of the default one, but for where the poses come from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from solver.errors import InputError
from solver.neural.agnostic_fit import NetworkPoses, NeuralFitSettings
from solver.pipeline.fitting import scene as scene_of
from solver.pipeline.stage import Stage
from solver.pipeline.stages import FITTED_TO, GRAPH, said_fit
from solver.progress import Progress, part_of
from solver.solve.results import FittedMotion

SHIPPED_VERSION = 1
"""To be raised with the weights that ship: what other weights said is computed again."""


@dataclass(frozen=True)
class NetworkSettings:
    """How the network is used.

    Attributes
    ----------
    tune_steps : steps of training on this session's own layout and body before it solves, on made motions; 300 take
        about a minute
    """

    tune_steps: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        if self.tune_steps < 0:
            raise InputError(f"{self.tune_steps} is not possible", "the setting tune_steps", "give 0 or more")


def ask_network(given: Mapping[str, Any], settings: NetworkSettings, progress: Progress) -> NetworkPoses:
    """A network reads the poses off the markers, told where on the body they sit."""
    return _poses(given, settings.tune_steps, 0, progress)


def fit_from_poses(given: Mapping[str, Any], settings: NeuralFitSettings, progress: Progress) -> FittedMotion:
    """The network's poses refined on the markers in every frame."""
    from solver.neural.agnostic_fit import fit_from_network
    from solver.solve.method import chosen_row

    body, seen, points = scene_of(given)
    poses: NetworkPoses = given["network"]
    row = chosen_row(given["orient"], settings)
    if row != poses.chosen:
        poses = _poses(given, poses.tuned, row, part_of(progress, 0.0, 0.5))
    time = given["clean"].markers.time
    return fit_from_network(body, seen, points, given["localize"], given["orient"], poses, time, settings, progress)


def _poses(given: Mapping[str, Any], tune_steps: int, row: int, progress: Progress) -> NetworkPoses:
    """The network's poses with the markers where a candidate has them."""
    from solver.neural import agnostic_solve
    from solver.neural.agnostic_fit import marked, with_video
    from solver.neural.places import check_places
    from solver.solve.kinematics import Points, forward, place_points

    path: Path | None = given["weights_file"]
    body, seen, _ = scene_of(given)
    found, chosen = given["localize"], given["orient"].candidates[row]
    ready = agnostic_solve.load(path)
    card = ready.card
    check_places(card, body, chosen.vertex, path)
    there = marked(body, chosen)
    if tune_steps:
        from solver.neural.finetune import Ground, tuned

        ready = tuned(ready, Ground(body, person=there), tune_steps, part_of(progress, 0.0, 0.9))
    used = replace(seen, markers=seen.markers[:, found.markers])
    solved = agnostic_solve.solve_frames(ready, used.markers, there, progress)
    pose = with_video(body, used, chosen, solved, there.turned)
    points = Points(chosen.rest, chosen.dirs, chosen.weights)
    placed = place_points(points, forward(body, pose), pose.betas)
    gap = float(np.nanmedian(np.linalg.norm(placed - used.markers, axis=2)))
    which = f"{'shipped' if path is None else path.name}, {card.steps} steps, {card.date[:10]}"
    return NetworkPoses(row, pose.rotations, pose.trans, there.turned, solved.seen, gap, which, tune_steps)


def said_poses(poses: NetworkPoses) -> str:
    """How near it came, and by which weights."""
    told = "every bone" if poses.known.all() else f"{poses.known.sum()} of {len(poses.known)} bones"
    return f"markers {1000 * poses.gap:.1f} mm from the network's poses (median), of {told}; weights: {poses.weights}"


_OWN = (
    Stage(
        "network",
        SHIPPED_VERSION,
        NetworkSettings,
        (*FITTED_TO, "localize", "orient", "weights_file"),
        ask_network,
        NetworkPoses,
        said_poses,
        cost=3,
    ),
    Stage(
        "fit",
        1,
        NeuralFitSettings,
        (*FITTED_TO, "localize", "orient", "network", "weights_file"),
        fit_from_poses,
        FittedMotion,
        said_fit,
        cost=2,
    ),
)

GRAPH_NEURAL = (*(stage for stage in GRAPH if stage.name not in {own.name for own in _OWN}), *_OWN)
"""Every stage of the method with a network; those that do not fit are the default method's."""
