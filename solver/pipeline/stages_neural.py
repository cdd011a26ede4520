"""The stages of the method with a network: those of the default one, but for where the poses come from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Unpack

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, part_of
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.neural.layout_free.agnostic_fit import NetworkPoses, NeuralFitSettings
from markerscope.solver.pipeline.fitting import FittedTo, scene
from markerscope.solver.pipeline.stage import Stage
from markerscope.solver.pipeline.stages import BODY, FITTED_TO, GRAPH, said_fit

SHIPPED_VERSION = 1
"""To be raised with the weights that ship: what other weights said is computed again."""


@dataclass(frozen=True)
class NetworkSettings:
    """How the network is used.

    Attributes
    ----------
    tune_steps : steps of training on this session's own markers and body before it solves, on made motions; 300 take
        about a minute
    default_deg : degrees, spread of the default fit's joint rotations, beside which the network's count by what it gets
        wrong with these markers on made motions
    """

    tune_steps: int = 0
    default_deg: float = 5.0

    def __post_init__(self) -> None:
        """Refuse what cannot work."""
        if self.tune_steps < 0:
            raise InputError(f"{self.tune_steps} is not possible", "the setting tune_steps", "give 0 or more")
        if not (np.isfinite(self.default_deg) and self.default_deg > 0):
            raise InputError(f"{self.default_deg} is not possible", "the setting default_deg", "give a number above 0")


def ask_network(
    settings: NetworkSettings,
    progress: Progress,
    *,
    localize: Localization,
    orient: Orientation,
    weights_file: Path | None,
    **given: Unpack[FittedTo],
) -> NetworkPoses:
    """A network reads the poses off the markers, told where on the body they sit."""
    return _poses(settings, progress, 0, localize, orient, weights_file, given)


def fit_from_poses(
    settings: NeuralFitSettings,
    progress: Progress,
    *,
    localize: Localization,
    orient: Orientation,
    network: NetworkPoses,
    weights_file: Path | None,
    **given: Unpack[FittedTo],
) -> FittedMotion:
    """The network's poses refined on the markers in every frame."""
    from markerscope.solver.fit.method import chosen_row
    from markerscope.solver.neural.layout_free.agnostic_fit import fit_from_network

    body, seen, points = scene(**given)
    poses, row = network, chosen_row(orient, settings)
    if row != poses.chosen:
        again, half = NetworkSettings(poses.tuned, poses.default_deg), part_of(progress, 0.0, 0.5)
        poses = _poses(again, half, row, localize, orient, weights_file, given)
    time = given["clean"].markers.time
    return fit_from_network(body, seen, points, localize, orient, poses, time, settings, progress)


def _poses(
    settings: NetworkSettings,
    progress: Progress,
    row: int,
    found: Localization,
    ranked: Orientation,
    weights_file: Path | None,
    given: FittedTo,
) -> NetworkPoses:
    """The network's poses with the markers where a candidate has them, beside the default fit of that candidate."""
    from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
    from markerscope.solver.fit.method import fit, in_use
    from markerscope.solver.fit.settings import FitSettings
    from markerscope.solver.neural.layout_free.agnostic_fit import marked
    from markerscope.solver.neural.layout_free.agnostic_trust import blended
    from markerscope.solver.neural.posing import pose_network

    body, seen, landmarks = scene(**given)
    cleaned = given["clean"].markers
    chosen = ranked.candidates[row]
    network = pose_network(weights_file, body, marked(body, chosen), chosen.vertex)
    if settings.tune_steps:
        network = network.tuned(settings.tune_steps, part_of(progress, 0.0, 0.8))
    # The network is told where the candidate has the markers, so the fit beside it leaves them there.
    settled = FitSettings(row, landmark_pull="off")
    usual = fit(body, seen, landmarks, found, ranked, cleaned.time, settled, part_of(progress, 0.8, 0.9))
    markers = in_use(seen, found, ranked).markers
    solved = network.poses(markers, cleaned.rate, part_of(progress, 0.9, 1.0))
    blend = blended(solved.rotations, usual.rotations, network.expected_errors(), settings.default_deg)
    own = Pose(solved.rotations, solved.trans, chosen.betas)
    placed = place_points(Points(chosen.rest, chosen.dirs, chosen.weights), forward(body, own), own.betas)
    return NetworkPoses(
        chosen=row,
        rotations=blend.rotations,
        trans=usual.trans,
        share=blend.share,
        spread_deg=blend.spread_deg,
        seen=solved.seen,
        gap=float(np.nanmedian(np.linalg.norm(placed - markers, axis=2))),
        weights=network.about,
        tuned=settings.tune_steps,
        default_deg=settings.default_deg,
    )


def said_poses(poses: NetworkPoses) -> str:
    """How near it came, how much it counts, and by which weights."""
    return (
        f"markers {1000 * poses.gap:.1f} mm from the network's own poses (median); it counts {poses.share.mean():.2f} "
        f"beside the default fit; weights: {poses.weights}"
    )


_OWN = (
    Stage(
        "network",
        SHIPPED_VERSION + 1,  # the default fit beside it iterates every frame to its end
        NetworkSettings,
        (*FITTED_TO, "localize", "orient", "weights_file"),
        ask_network,
        NetworkPoses,
        said_poses,
        cost=3,
        shipped=BODY,
    ),
    Stage(
        "fit",
        3,
        NeuralFitSettings,
        (*FITTED_TO, "localize", "orient", "network", "weights_file"),
        fit_from_poses,
        FittedMotion,
        said_fit,
        cost=2,
        shipped=BODY,
    ),
)

GRAPH_NEURAL = (*(stage for stage in GRAPH if stage.name not in {own.name for own in _OWN}), *_OWN)
"""Every stage of the method with a network; those that do not fit are the default method's."""
