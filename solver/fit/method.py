"""The default method as three stages with results that can be drawn: localize, orient, fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.fit.bundle import FINE, Fit, descend, relax, settled_again
from markerscope.solver.fit.converge import Settled
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.fit.doubts.clouds import clouds, one_body, taken_cloud
from markerscope.solver.fit.doubts.mirror import both_sides, in_mirror, video_in_doubt
from markerscope.solver.fit.doubts.still import still_markers
from markerscope.solver.fit.ending import motion_from
from markerscope.solver.fit.kinematics import Points, Pose, forward, place_points
from markerscope.solver.fit.localize import Hypothesis, Search, hypotheses
from markerscope.solver.fit.parts import part_name
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.problem import Problem
from markerscope.solver.fit.pull.stage import to_landmarks
from markerscope.solver.fit.refine import every_frame
from markerscope.solver.fit.results import Candidate, FittedMotion, Localization, Orientation, Solution, Steps
from markerscope.solver.fit.second.stage import search_limbs
from markerscope.solver.fit.settings import FitSettings, LocalizeSettings, OrientSettings
from markerscope.solver.fit.sifting import loose_share, strays, without_place
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights
from markerscope.solver.fit.trust import believed, trusted

_REACH_M = 2.0
"""No marker on a person is usually further from the middle of all markers."""
_SIFTINGS = 2
"""Times that markers which fit no place are left out; the first time, those of others still pull at the body."""
_FEWEST = 3
_CLEAR, _LOOSE_SHARE = 1.15, 0.1
"""An answer that is less clear than this, or leaves more of the markers off their places, may have a wrong video."""
_NEARER = 0.95
"""The mirror image of a right video lies at best as near to the markers (0.99 and more), a mirrored one's nearer."""


def localize(
    body: Body,
    seen: Observations,
    left_out: np.ndarray,
    settings: LocalizeSettings,
    camera: CameraResult | None = None,
) -> Localization:
    """Hypotheses of where the markers sit.

    Parameters
    ----------
    body : with bone lengths among its shape coefficients
    seen : all T frames
    left_out : (M,) True for markers that the user left out
    camera : from another trial of the same session
    """
    present = np.isfinite(seen.markers).all(axis=2)
    often = (present.mean(axis=0) >= settings.seen_share) & (present.sum(axis=0) >= 3)
    wanted = np.flatnonzero(often & ~left_out)
    standing = wanted[still_markers(seen.markers[:, wanted])] if settings.leave_out_still else wanted[:0]
    wanted = np.setdiff1d(wanted, standing)
    cloud = np.full(seen.markers.shape[1], -1)
    cloud[wanted] = clouds(seen.markers[:, wanted])
    overlay = partial(_laid_over, body, seen, settings=settings, camera=camera)
    if cloud.max(initial=0) > 0:
        cloud = one_body(cloud, lambda own: overlay(own)[0][0].cost)
    taken = taken_cloud(cloud, settings.part_of_cloud, lambda own: overlay(own)[0][0].cost)
    used = within_reach(seen.markers, wanted[(cloud[wanted] == taken) | (cloud[wanted] < 0)])
    if len(used) < 3:
        raise InputError(
            f"only {len(used)} markers are seen in enough frames", "the markers", "record or keep at least 3 markers"
        )
    found, few = overlay(used)
    many = np.union1d(few, keyframes(seen, used, settings.many))
    vertex = np.stack([h.vertex for h in found])
    return Localization(
        markers=used,
        few=few,
        many=many,
        vertex=vertex,
        bone=body.weights[vertex].argmax(axis=2),
        R_lab_cam=np.stack([h.R_lab_cam for h in found]),
        trans=np.stack([h.trans for h in found]),
        cost_mm=np.sqrt([h.cost for h in found]) * 1000,
        start=tuple(h.start for h in found),
        yaw_deg=np.array([h.yaw_deg for h in found]),
        still=standing,
        cloud=cloud,
        taken=taken,
    )


def _laid_over(
    body: Body, seen: Observations, used: np.ndarray, settings: LocalizeSettings, camera: CameraResult | None
) -> tuple[tuple[Hypothesis, ...], np.ndarray]:
    """The ways to lay the video's body over some columns of the markers, the nearest first, and the few keyframes."""
    few = keyframes(seen, used, settings.few)
    betas = np.zeros(body.shape_count)
    vertices = np.intersect1d(body.lod_index, np.flatnonzero(body.marker_mask))[::3]
    placement, _ = Skin(body, betas).on_vertices(vertices, Weights().offset)
    still = Pose(seen.prior[few], np.repeat(-body.joint_template[:1], len(few), axis=0), betas)
    points = place_points(placement, forward(body, still), betas)
    bone = body.weights[vertices].argmax(axis=1)
    search = Search(yaws=settings.yaws, keep=settings.keep, any_orientation=settings.any_orientation)
    turn = None if camera is None else camera.R_lab_cam
    return hypotheses(seen.markers[few][:, used], points, vertices, bone, search, turn), few


def within_reach(markers: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Those of the ``used`` markers (T, M, 3) m that can sit on one body with most of the others.

    A reflection across the room would otherwise be laid a body over, and the body stretched towards it.
    """
    cloud = markers[:, used]
    cloud = cloud[np.isfinite(cloud).all(axis=2).any(axis=1)]
    if not cloud.size:
        return used
    middle = np.nanmedian(cloud, axis=1, keepdims=True)
    distance = np.nanmedian(np.linalg.norm(cloud - middle, axis=2), axis=0)
    return used[distance <= _REACH_M]


def keyframes(seen: Observations, used: np.ndarray, count: int) -> np.ndarray:
    """Ascending frame numbers, evenly spread over the frames with a tracked video and most markers in sight."""
    share = np.isfinite(seen.markers[:, used]).all(axis=2).mean(axis=1)
    good = np.flatnonzero(seen.tracked & (share >= min(0.5, 0.8 * float(share.max()))))
    if len(good) < 2:
        good = np.flatnonzero(share >= 0.8 * share.max())
    if not seen.tracked.any():
        raise InputError(
            "the video tracks the person at no time when markers were recorded",
            "the video",
            "check that both show the same movement, and the offset between them",
        )
    return np.unique(good[np.linspace(0, len(good) - 1, min(count, len(good))).round().astype(int)])


def orient(
    body: Body,
    seen: Observations,
    landmarks: Points,
    found: Localization,
    settings: OrientSettings,
    camera: CameraResult | None = None,
    progress: Progress = silent,
    *,
    try_mirror: bool = True,
) -> Orientation:
    """Every hypothesis relaxed, the best refined, all ranked; markers that fit no place left out.

    Parameters
    ----------
    try_mirror : where the answer contradicts the video, see what its mirror image costs
    """
    from markerscope.solver.fit.confidence import is_whole, judge, stillness

    used = replace(seen, markers=seen.markers[:, found.markers])
    guesses = tuple(
        Hypothesis(v, r, t, float(c), s, float(y))
        for v, r, t, c, s, y in zip(
            found.vertex, found.R_lab_cam, found.trans, found.cost_mm, found.start, found.yaw_deg, strict=True
        )
    )
    weights = replace(settings.weights(), free_bias=not _sees_landmarks(used))
    known = None
    if camera is not None:
        known = camera_of(camera, used.lab_centre)
        weights = replace(weights, free_camera=False)
    search = partial(
        relax,
        body,
        landmarks=landmarks,
        guesses=guesses,
        few=found.few,
        many=found.many,
        base=weights,
        keep=settings.refine,
        camera=known,
        progress=progress,
    )
    fits = search(used)
    far = np.zeros(len(found.markers), dtype=bool)
    for _ in range(_SIFTINGS if settings.leave_out_far else 0):
        shown = used.at(found.many)
        if not strays(body, fits[0], shown.markers).any():
            break
        # A fit that was not at its end yet leaves markers of the person behind: only the end tells whose they are.
        fits = settled_again(Problem(body, shown, landmarks), fits, weights)
        stray = strays(body, fits[0], shown.markers)
        nowhere = stray & without_place(Problem(body, shown, landmarks), fits[0], weights.offset)
        if not nowhere.any() or (far | nowhere).sum() > len(far) - _FEWEST:
            break
        far |= nowhere
        used = replace(used, markers=np.where(far[:, None], np.nan, used.markers))
        fits = search(used)
    index = {id(guess): i for i, guess in enumerate(guesses)}
    whole = Problem(body, used.at(found.many), landmarks)
    candidates = tuple(
        _candidate(body, fit, index[id(fit.start)], whole, _steps(fit.poses, found.few, found.many)) for fit in fits
    )
    ranked = replace(judge(candidates, ~far), far=found.markers[far])
    best = candidates[0]
    if try_mirror and camera is None and best.refined:
        joint = np.where(far, -1, best.bone)
        loose = loose_share(body, fits[0], used.at(found.many).markers) > _LOOSE_SHARE
        stands = is_whole(joint) and bool(stillness(best.rotations, joint))
        in_doubt = video_in_doubt(best.rotations, used.at(found.many), joint, best.camera.reprojection_px)
        unclear = ranked.margin < _CLEAR or bool(far.any()) or loose or stands
        if in_doubt or (both_sides(joint) and (unclear or _mirror_lies_nearer(body, used, found))):
            mirror = best.energy / _mirrored_energy(body, used, landmarks, found, settings)
            ranked = replace(judge(candidates, ~far, mirror), far=ranked.far)
    return ranked


def _laid_in_mirror(body: Body, used: Observations, found: Localization) -> tuple[Observations, Localization]:
    """The markers with the video's mirror image, and where on its body they sit."""
    seen = in_mirror(used)
    few, many = len(found.few), len(found.many)
    own = LocalizeSettings(few=few, many=many, leave_out_still=False, part_of_cloud=1)
    return seen, localize(body, seen, ~np.isfinite(seen.markers).all(axis=2).any(axis=0), own)


def _mirror_lies_nearer(body: Body, used: Observations, found: Localization) -> bool:
    """Whether the video's mirror image, laid over the markers, comes nearer to them than the video does."""
    return bool(_laid_in_mirror(body, used, found)[1].cost_mm[0] < _NEARER * found.cost_mm[0])


def _mirrored_energy(
    body: Body, used: Observations, landmarks: Points, found: Localization, settings: OrientSettings
) -> float:
    """What the best answer costs with the video's mirror image."""
    seen, again = _laid_in_mirror(body, used, found)
    ranked = orient(body, seen, landmarks, again, replace(settings, leave_out_far=False), try_mirror=False)
    return ranked.candidates[0].energy


def fit(
    body: Body,
    seen: Observations,
    landmarks: Points,
    found: Localization,
    ranked: Orientation,
    time: np.ndarray,
    settings: FitSettings,
    progress: Progress = silent,
    hold: Callable[[Problem, State, Surface, Weights], tuple[State, Surface]] | None = None,
) -> FittedMotion:
    """The chosen answer carried to every frame.

    Parameters
    ----------
    hold : what is known of the person put in the place of what the keyframes say
    """
    row = chosen_row(ranked, settings)
    chosen = ranked.candidates[row]
    used = in_use(seen, found, ranked)
    frames = found.many if chosen.refined else found.few
    state, surface, weights = _settled(body, used.at(frames), landmarks, chosen, settings)
    # Nobody's markers draw nothing: they count as lost, and as kept from every landmark.
    theirs = [int(m) for m in ranked.far]
    own = replace(settings, refused=(*settings.refused, *((m, "") for m in theirs)))
    lost = np.isin(np.arange(seen.markers.shape[1]), theirs)[:, None]
    kept = replace(seen, markers=np.where(lost, np.nan, seen.markers))
    drawn = to_landmarks(body, kept, landmarks, found.markers, frames, state, surface, weights, own)
    around = (body, used.at(frames), landmarks)
    searched = search_limbs(*around, drawn.state, drawn.surface, weights, drawn.by, settings.second)
    state, surface = searched.state, searched.surface
    if hold is not None:
        state, surface = hold(Problem(*around), state, surface, weights)
    pose = every_frame(body, used, landmarks, frames, state, surface, weights, progress)
    motion = fitted_motion(body, seen, found, ranked, settings, state, pose, time)
    solution = Solution(frames, state.placement, surface, state.bias, weights, drawn.by)
    return replace(motion, pull=drawn.pull, second=searched.others, solution=solution)


def in_use(seen: Observations, found: Localization, ranked: Orientation) -> Observations:
    """What is seen of the markers in use (U); those that belong to nobody count as lost."""
    nobody = np.isin(found.markers, ranked.far)
    return replace(seen, markers=np.where(nobody[:, None], np.nan, seen.markers[:, found.markers]))


def chosen_row(ranked: Orientation, settings: FitSettings) -> int:
    """Row of the candidate that goes on: the one that is pinned, else the best.

    Raises
    ------
    InputError : there is no such candidate
    """
    row = 0 if settings.candidate is None else settings.candidate
    if not 0 <= row < len(ranked.candidates):
        last = len(ranked.candidates) - 1
        raise InputError(
            f"is number {candidate_number(row)}, which is not there",
            "the pinned candidate",
            f"pin one of 1 to {candidate_number(last)} (in session.toml, candidate = 0 to {last})",
        )
    return row


def fitted_motion(
    body: Body,
    seen: Observations,
    found: Localization,
    ranked: Orientation,
    settings: FitSettings,
    state: State,
    pose: Pose | Settled,
    time: np.ndarray,
) -> FittedMotion:
    """What a fit leaves, of the poses of all frames.

    Parameters
    ----------
    state : of the keyframes: where the markers sit, and the camera
    """
    row = chosen_row(ranked, settings)
    camera = ranked.candidates[row].camera
    kept = ~np.isin(found.markers, ranked.far)
    bone, vertex = _sites(body, state)
    confidence, warnings = ranked.confidence, ranked.warnings
    if settings.candidate is not None:
        from markerscope.solver.fit.confidence import chosen_by_hand, steepness_of

        confidence, warnings = chosen_by_hand(ranked, row, steepness_of(bone[kept]))
    return motion_from(
        body,
        seen.markers,
        time,
        pose,
        found.markers[kept],
        state.placement.take(np.flatnonzero(kept)),
        (bone[kept], vertex[kept]),
        camera=_written(state.camera, camera.image_size, camera.reprojection_px),
        chosen=row,
        confidence=confidence,
        warnings=warnings,
    )


def _sees_landmarks(seen: Observations) -> bool:
    """Whether the video's landmarks are there: its pose was lifted from them then, and errs in depth, now so, now so.

    A reconstruction without them keeps much of its error from frame to frame.
    """
    return bool(np.isfinite(seen.image).any())


def _settled(
    body: Body, seen: Observations, landmarks: Points, chosen: Candidate, settings: FitSettings
) -> tuple[State, Surface, Weights]:
    """The keyframes once more, the video trusted as far as it turned out to be right."""
    problem, weights = Problem(body, seen, landmarks), settings.weights()
    state, surface = state_of(chosen, seen)
    if problem.in_image.any():
        return state, surface, weights
    weights = trusted(seen, state, believed(weights))
    state, surface, _ = descend(problem, state, surface, FINE[-1:], weights)
    return state, surface, weights


def state_of(chosen: Candidate, seen: Observations) -> tuple[State, Surface]:
    """A candidate as a fit goes on with it; ``seen`` are its keyframes."""
    state = State(
        Pose(chosen.rotations, chosen.trans, chosen.betas),
        Points(chosen.rest, chosen.dirs, chosen.weights),
        camera_of(chosen.camera, seen.lab_centre),
        chosen.bias,
    )
    return state, Surface(chosen.surface, chosen.normal)


def camera_of(camera: CameraResult, centre: np.ndarray) -> Camera:
    """The camera written about a lab point, as the fit wants it."""
    return Camera(camera.R_lab_cam, (centre - camera.position) @ camera.R_lab_cam, centre, camera.focal)


def _written(camera: Camera, image_size: tuple[int, int], reprojection_px: float) -> CameraResult:
    """The camera as results carry it: where it stands in the lab."""
    position = camera.centre - camera.R_lab_cam @ camera.shift
    return CameraResult(camera.R_lab_cam, position, camera.focal, image_size, reprojection_px)


def _sites(body: Body, state: State) -> tuple[np.ndarray, np.ndarray]:
    """The bone of each marker and its nearest vertex, (U,) each."""
    placement, betas = state.placement, state.pose.betas
    return placement.weights.argmax(axis=1), Skin(body, betas).nearest_vertex(placement.shaped(betas))


def _steps(poses: tuple[Pose, ...], few: np.ndarray, many: np.ndarray) -> Steps | None:
    """Poses after each step, solved on the few or on the many keyframes, in the few that they have in common."""
    if not poses:
        return None
    common = np.searchsorted(many, few)
    shown = [pose if len(pose.trans) == len(few) else pose.at(common) for pose in poses]
    vectors = log_so3(np.stack([pose.rotations for pose in shown])).astype(np.float32)
    trans = np.stack([pose.trans for pose in shown]).astype(np.float32)
    return Steps(vectors, trans, np.stack([pose.betas for pose in shown]))


def _candidate(body: Body, fitted: Fit, hypothesis: int, whole: Problem, steps: Steps | None) -> Candidate:
    state = fitted.state
    bone, vertex = _sites(body, state)
    view = state.camera.R_lab_cam[:, 2]
    reprojection = whole.reprojection(state) if fitted.refined else float("nan")
    return Candidate(
        hypothesis=hypothesis,
        refined=fitted.refined,
        energies=dict(fitted.energies.by_term),
        energy=fitted.energies.total,
        bone=bone,
        vertex=vertex,
        part=part_name(bone),
        heading_deg=float(np.degrees(np.arctan2(view[1], view[0]))),
        camera=_written(state.camera, whole.seen.image_size, reprojection),
        rest=state.placement.rest,
        dirs=state.placement.dirs,
        weights=state.placement.weights,
        surface=fitted.surface.point,
        normal=fitted.surface.normal,
        betas=state.pose.betas,
        rotations=state.pose.rotations,
        trans=state.pose.trans,
        trace=fitted.trace,
        bias=state.bias,
        steps=steps,
        behind=fitted.behind,
    )
