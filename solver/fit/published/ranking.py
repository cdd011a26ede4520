"""The published method's answers as ranked candidates, as every method gives them."""

from __future__ import annotations

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.confidence import UNRIVALLED, same_answer, stillness
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.parts import part_name
from markerscope.solver.fit.placement import Skin
from markerscope.solver.fit.published.motion import camera_of, full_shape
from markerscope.solver.fit.published.results import BodyState, PaperLocalization, PaperSolve
from markerscope.solver.fit.published.sequence import chain_vertices, mesh_vertices, sequence_of, turned_video
from markerscope.solver.fit.published.settings import PAPER_ITERATIONS, STEEPNESS
from markerscope.solver.fit.published.solve import nearest_on_average
from markerscope.solver.fit.results import Candidate, Orientation
from markerscope.solver.fit.state import Observations

_CHAINS_SHOWN = 5
_MM2 = 1e6


def orientation_of(
    body: Body, seen: Observations, landmarks: Points, found: PaperLocalization, solved: PaperSolve
) -> Orientation:
    """The yaws, best first, then the best chains of the part search, as candidates.

    A yaw's energy is what it was chosen by: the one-way Chamfer distance after stage 4, mm^2; its pose is stage 4's,
    or stage 5's for the best. A chain's is its two-way Chamfer distance, mm^2. The method itself gives no confidence:
    the figure here, 0.5 for a tie and more the further the best different yaw is, is not calibrated.

    Parameters
    ----------
    seen, landmarks : all T frames, and the (L) body points that the video's landmarks show
    """
    used = seen.at(found.frames)
    order = np.argsort([yaw.one_way for yaw in solved.yaws], kind="stable")
    candidates = []
    for i in order:
        yaw = solved.yaws[i]
        state, vertex = yaw.markers.body, yaw.vertex
        if i == solved.chosen:
            state, vertex = solved.refined.body, solved.vertex
        energies = {"markers": _MM2 * yaw.one_way}
        trace = (*yaw.pose.descent.trace.energy.tolist(), *yaw.markers.descent.trace.energy.tolist())
        candidates.append(_candidate(body, used, landmarks, state, vertex, int(i), energies, trace, solved))
    for row in np.argsort([chain.chamfer for chain in found.candidates])[:_CHAINS_SHOWN]:
        candidates.append(_of_chain(body, seen, landmarks, found, int(row), solved))
    return _judged(tuple(candidates), solved)


def _candidate(
    body: Body,
    used: Observations,
    landmarks: Points,
    state: BodyState,
    vertex: np.ndarray,
    hypothesis: int,
    energies: dict[str, float],
    trace: tuple[float, ...],
    solved: PaperSolve,
    *,
    refined: bool = True,
) -> Candidate:
    betas = full_shape(body, state.betas)
    placement, surface = Skin(body, betas).on_vertices(vertex, solved.settings.offset)
    camera = camera_of(body, used, landmarks, state)
    view = camera.R_lab_cam[:, 2]
    bone = body.weights[vertex].argmax(axis=1)
    return Candidate(
        hypothesis=hypothesis,
        refined=refined,
        energies=energies,
        energy=sum(energies.values()),
        bone=bone,
        vertex=vertex,
        part=part_name(bone),
        heading_deg=float(np.degrees(np.arctan2(view[1], view[0]))),
        camera=camera,
        rest=placement.rest,
        dirs=placement.dirs,
        weights=placement.weights,
        surface=surface.point,
        normal=surface.normal,
        betas=betas,
        rotations=state.rotations,
        trans=state.trans,
        trace=trace,
    )


def _of_chain(
    body: Body, seen: Observations, landmarks: Points, found: PaperLocalization, row: int, solved: PaperSolve
) -> Candidate:
    chain = found.candidates[row]
    sequence = sequence_of(body, seen, found.frames, found.markers, len(chain.betas))
    state = BodyState(turned_video(sequence.rotations.numpy(), chain.yaw_deg), chain.trans, chain.betas)
    among = chain_vertices(body, mesh_vertices(body, solved.settings.mesh), chain.bones)
    vertex = nearest_on_average(sequence, state, among)
    energies = {"markers": _MM2 * chain.one_way, "vertices": _MM2 * (chain.chamfer - chain.one_way)}
    trace = tuple(chain.descent.trace.energy.tolist())
    used = seen.at(found.frames)
    return _candidate(body, used, landmarks, state, vertex, row, energies, trace, solved, refined=False)


def _judged(candidates: tuple[Candidate, ...], solved: PaperSolve) -> Orientation:
    """The margin of the first candidate over the best different yaw, and what there is to doubt."""
    rivals = [i for i, c in enumerate(candidates) if c.refined and i and not same_answer(candidates[0], c)]
    margin = candidates[rivals[0]].energy / max(candidates[0].energy, 1e-9) if rivals else float("inf")
    warnings = list(stillness(candidates[0].rotations, candidates[0].bone))
    descents = [stage.descent for yaw in solved.yaws for stage in (yaw.pose, yaw.markers)] + [solved.refined.descent]
    capped = sum(not descent.converged for descent in descents)
    if capped:
        warnings.append(
            f"{capped} of {len(descents)} optimisations were stopped at {solved.settings.iterations} iterations, "
            f"before they had converged; the paper allows {PAPER_ITERATIONS}."
        )
    confidence = 1 / (1 + margin**-STEEPNESS) if rivals else UNRIVALLED
    return Orientation(candidates, float(margin), rivals[0] if rivals else -1, float(confidence), tuple(warnings))
