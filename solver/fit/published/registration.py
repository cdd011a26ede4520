"""The baseline of Milef et al. (2024), section 4.1.3: the video's pose, set rigidly on the unlabelled markers.

A video has no place in the lab, so besides one turn about the vertical every frame has a shift of its own. The part
comes from the published method's part localization, as it does in the paper (figure 7).
"""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.published.localize import Start, fit_chain
from markerscope.solver.fit.published.motion import camera_of, fitted_motion, full_shape
from markerscope.solver.fit.published.results import BodyState, PaperLocalization
from markerscope.solver.fit.published.sequence import WHOLE, chain_vertices, mesh_vertices, sequence_of, turned_video
from markerscope.solver.fit.published.settings import PaperLocalizeSettings
from markerscope.solver.fit.published.solve import nearest_on_average
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.fit.state import Observations

_YAWS = 4
_OFFSET = 0.0095


def register(
    body: Body,
    seen: Observations,
    landmarks: Points,
    time: np.ndarray,
    found: PaperLocalization,
    settings: PaperLocalizeSettings,
    video_betas: np.ndarray | None = None,
    progress: Progress = silent,
) -> FittedMotion:
    """The video's body, its pose and shape unchanged, turned about the vertical and shifted onto the markers.

    Of four yaws the one is taken that ends with the least one-way Chamfer distance.

    Parameters
    ----------
    seen, time : all T frames, s
    landmarks : (L) body points that the video's landmarks show
    found : frames and markers in use, and the part
    settings : mesh, iterations and learning rate of the registration
    video_betas : shape by the video, if it is this body's; zeros else
    """
    sequence = sequence_of(body, seen, found.frames, found.markers, settings.betas, video_betas)
    bones = WHOLE if found.whole_body else found.candidates[found.chosen].bones
    vertices = chain_vertices(body, mesh_vertices(body, settings.mesh), bones)
    fits = []
    for i in range(_YAWS):
        start = Start.on_markers(sequence, np.radians(found.yaw_deg) + 2 * np.pi * i / _YAWS)
        share = part_of(progress, i / _YAWS, (i + 1) / _YAWS)
        fits.append(fit_chain(sequence, bones, vertices, settings, share, start, free_shape=False))
    best = min(fits, key=lambda fit: fit.one_way)
    state = BodyState(turned_video(sequence.rotations.numpy(), best.yaw_deg), best.trans, best.betas)
    vertex = nearest_on_average(sequence, state, vertices)
    camera = camera_of(body, seen.at(found.frames), landmarks, state)
    every = sequence_of(body, seen, np.arange(len(time)), found.markers, settings.betas).rotations.numpy()
    at = time[found.frames]
    trans = np.stack([np.interp(time, at, best.trans[:, k]) for k in range(3)], axis=1)
    return fitted_motion(
        body,
        seen.markers,
        time,
        Pose(turned_video(every, best.yaw_deg), trans, full_shape(body, best.betas)),
        found.markers,
        vertex,
        _OFFSET,
        camera=camera,
        chosen=0,
        confidence=0.0,
        warnings=("The video's pose was only set rigidly on the markers.",),
    )
