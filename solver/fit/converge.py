"""Frames iterated each until its own pose stands still, with everything that frames share held."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Lock

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.parallel import spread
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.problem import Problem, person_height
from markerscope.solver.fit.state import FREE, Observations, State, Surface, Weights

TOLERANCE_DEG = 0.05
"""A frame is settled when a whole Gauss-Newton step would turn no joint further than this."""
MOST_STEPS = 40
FINAL = (0.01, 0.04)
"""m, spread and kernel of the markers with which every frame ends."""

_CHUNK = 128
_DAMPING = 1e-4
_PATIENCE = 20
"""After so many steps those that turn back on the one before are halved: such a frame goes to and fro."""
_FURTHEST, _BACK = 4.0, 0.3
"""The extrapolation goes on by so many steps at most, and takes back so much of one at most."""


@dataclass(frozen=True, eq=False)
class Settled:
    """Poses of all T frames, and (T,) True where the iteration came to its end."""

    pose: Pose
    settled: np.ndarray

    def notes(self) -> tuple[str, ...]:
        """What is to be said of frames that did not settle."""
        lost = int((~self.settled).sum())
        if not lost:
            return ()
        which = f"{lost} of {len(self.settled)} frames {'has' if lost == 1 else 'have'}"
        return (
            f"{which} not settled to {TOLERANCE_DEG:g} degrees in {MOST_STEPS} steps (the first is frame "
            f"{int(np.argmin(self.settled))}, counted from 0): several poses fit nearly alike there.",
        )


def settle(
    body: Body,
    seen: Observations,
    landmarks: Points,
    fitted: State,
    surface: Surface,
    base: Weights,
    start: Pose,
    widest: Sequence[tuple[float, float]] = (),
    progress: Progress = silent,
    person: float | None = None,
) -> Settled:
    """Gauss-Newton on every frame until a step turns no joint by more than ``TOLERANCE_DEG``.

    Frames that have settled drop out. The robust kernels make the steps shrink by an even factor, so they are
    extrapolated (Anderson 1965, depth 1). Whether a frame has settled is always told by the whole plain step.

    Parameters
    ----------
    seen : all T frames
    fitted : placement, camera and bias, which are held
    start : poses of all T frames to begin with
    widest : m, spread and kernel of each of the first steps; ``FINAL`` follows
    person : px, height of the person in the image; of these frames where not given
    """
    count = len(seen.markers)
    held = replace(base, free_shape=False, free_placement=False, free_camera=False, free_bias=False)
    person = person_height(seen) if person is None else person
    rotations, trans = start.rotations.copy(), start.trans.copy()
    settled = np.zeros(count, dtype=bool)
    done, lock = [0], Lock()

    def solve(first: int) -> None:
        part = np.arange(first, min(first + _CHUNK, count))
        with lock:
            progress(done[0] / count, "solving every frame")
        active, before = part, None
        for k in range(MOST_STEPS):
            late = k - len(widest)
            marker, kernel = widest[k] if late < 0 else FINAL
            weights = replace(held, marker=marker, marker_kernel=kernel)
            problem = Problem(body, seen.at(active), landmarks, person)
            state = replace(fitted, pose=Pose(rotations[active], trans[active], fitted.pose.betas))
            plain = problem.frame_step(state, weights, surface, _DAMPING)
            step = plain
            if before is not None and late >= (2 if widest else 1):
                step = _extrapolated(plain, *before)
                back = (k >= _PATIENCE) & ((plain * before[0]).sum(axis=1) < 0)
                step[back] = plain[back] / 2
            pose = problem.turned(state.pose, step)
            rotations[active], trans[active] = pose.rotations, pose.trans
            turn = np.linalg.norm(plain[:, :-3].reshape(len(plain), len(FREE), 3), axis=2).max(axis=1)
            going = (turn > np.radians(TOLERANCE_DEG)) | (late < 0)
            settled[active[~going]] = True
            active, before = active[going], (plain[going], step[going])
            if not len(active):
                break
        with lock:
            done[0] += len(part)

    spread(solve, range(0, count, _CHUNK))
    return Settled(Pose(rotations, trans, fitted.pose.betas), settled)


def _extrapolated(plain: np.ndarray, plain_before: np.ndarray, taken_before: np.ndarray) -> np.ndarray:
    """(F, 69) the step that would end at rest if plain steps went on changing as they did over the last one taken."""
    change = plain - plain_before
    share = (plain * change).sum(axis=1) / np.maximum((change**2).sum(axis=1), 1e-30)
    return plain - share.clip(-_FURTHEST, _BACK)[:, None] * (taken_before + change)
