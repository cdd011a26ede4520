"""Standard errors of every angle in every frame: the fit's Gauss-Newton matrices carried over to the angles.

With H the fit's matrix and M the same sum of terms, each times the variance that its residuals show over the one that
its weight assumes, the estimate errs by ``H^-1 M H^-1`` (the sandwich of Huber 1967): true where a weight was chosen
for robustness and not for truth. Frames are eliminated as in the fit (Schur complement), and priors that hold once are
counted once.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.angles.angles import AngleSettings, evidence, world_rotations
from markerscope.solver.angles.slopes import angle_slopes
from markerscope.solver.body.anatomy import SEGMENT_JOINT
from markerscope.solver.body.model import Body
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.skeleton import INDEX, descendants
from markerscope.solver.fit.converge import FINAL
from markerscope.solver.fit.kinematics import Points, Pose, forward
from markerscope.solver.fit.method import camera_of
from markerscope.solver.fit.normal import NormalEquations
from markerscope.solver.fit.problem import Problem, person_height
from markerscope.solver.fit.results import FittedMotion, Solution
from markerscope.solver.fit.standard_errors.calibrated import factors
from markerscope.solver.fit.standard_errors.frames import SegmentFrames, frames_and_slopes
from markerscope.solver.fit.standard_errors.noise import Noise, found_noise
from markerscope.solver.fit.state import FREE, POSE_SIZE, Observations, State, Weights
from markerscope.solver.fit.terms.term import Estimate

_CHUNK = 128
_UNKNOWN_DEG = 104.0
"""An angle of which nothing is known: the standard deviation of a whole turn."""


def standard_errors(
    body: Body,
    seen: Observations,
    landmarks: Points,
    motion: FittedMotion,
    settings: AngleSettings,
    neutral: np.ndarray | None = None,
    singular: np.ndarray | None = None,
    progress: Progress = silent,
) -> AngleErrors:
    """Standard errors of the angles of a fitted motion.

    Parameters
    ----------
    seen : all T frames, of the U markers that the fit uses
    motion : with its ``solution``
    settings : the convention of the angles
    neutral : (24, 3, 3) pose that angles are counted from; its level is then taken off theirs
    singular : (T, A) True where an angle is not defined
    """
    solution = motion.solution
    if solution is None:
        raise ValueError("the fit left nothing to compute standard errors from")
    at = _Solved(body, seen, landmarks, motion, solution)
    noise, shared = at.shared()
    frames = frames_and_slopes(body, motion.betas, settings)
    zero = None
    if neutral is not None:
        close = np.einsum("tjab,jab->t", motion.rotations[:, 1:], neutral[1:])
        zero = at.rows(np.array([int(close.argmax())]), noise, shared, frames, settings)
    parts = []
    for some in _chunks(len(motion.time)):
        progress(float(some[0]) / len(motion.time), "standard errors")
        parts.append(_Variances.of(at.rows(some, noise, shared, frames, settings), zero))
    shape, level, definition = (
        np.concatenate([getattr(part, name) for part in parts]) for name in ("shape", "level", "definition")
    )
    names = tuple(evidence(settings.convention, motion.marker_joint).items())
    factor = np.array([factors(ground, noise.video_deg, 1000 * noise.marker_m) for _, ground in names])
    shape, level = np.sqrt(shape) * factor[:, 0], np.sqrt(level) * factor[:, 1]
    shape, level = (np.minimum(np.degrees(value), _UNKNOWN_DEG) for value in (shape, np.hypot(level, definition)))
    known = np.ones(shape.shape, bool) if singular is None else ~singular
    counted = np.maximum(known.sum(axis=0), 1)
    return AngleErrors(
        names=tuple(name for name, _ in names),
        shape=np.where(known, shape, np.nan).astype(np.float32),
        level=np.where(known, level, np.nan).astype(np.float32),
        definition=np.degrees(np.sqrt((np.where(known, definition, 0.0) ** 2).sum(axis=0) / counted)),
        marker_mm=1000 * noise.marker_m,
        video_deg=noise.video_deg,
        image_share=noise.image_share,
    )


def _chunks(count: int) -> Iterator[np.ndarray]:
    for first in range(0, count, _CHUNK):
        yield np.arange(first, min(first + _CHUNK, count))


@dataclass(frozen=True, eq=False)
class _Rows:
    """What turns errors of unit size into those of angles, rad: (F, A, any) each; ``shape`` is a variance (F, A)."""

    shape: np.ndarray
    shared: np.ndarray
    constant: np.ndarray
    anatomy: np.ndarray
    definition: np.ndarray


@dataclass(frozen=True, eq=False)
class _Variances:
    """(F, A) rad^2 of shape and of level without the definition, and rad of the definition."""

    shape: np.ndarray
    level: np.ndarray
    definition: np.ndarray

    @classmethod
    def of(cls, rows: _Rows, zero: _Rows | None) -> _Variances:
        """The sums of squares, of the differences from a neutral pose where there is one."""
        squares = []
        for name in ("shared", "constant", "anatomy", "definition"):
            value = getattr(rows, name)
            squares.append(((value if zero is None else value - getattr(zero, name)) ** 2).sum(axis=2))
        level = squares[0] + squares[1] + squares[2]
        return cls(rows.shape, level if zero is None else level + zero.shape, np.sqrt(squares[3]))


class _Solved:
    """The fit at its solution, linearised wherever it is asked to be."""

    def __init__(
        self, body: Body, seen: Observations, landmarks: Points, motion: FittedMotion, solution: Solution
    ) -> None:
        self.body, self.landmarks, self.motion, self.solution = body, landmarks, motion, solution
        further = seen.further if solution.pull is None else (*seen.further, solution.pull)
        self.seen = replace(seen, further=further)
        self.person = person_height(seen)
        turned = bool(np.abs(solution.bias - np.eye(3)).max() > 1e-9)
        marker, kernel = FINAL
        self.weights: Weights = replace(
            solution.weights,
            marker=marker,
            marker_kernel=kernel,
            free_shape=True,
            free_camera=True,
            free_placement=True,
            free_bias=turned,
        )
        self.free = self.problem(solution.frames).free(self.weights)

    def problem(self, frames: np.ndarray) -> Problem:
        return Problem(self.body, self.seen.at(frames), self.landmarks, self.person)

    def estimate(self, problem: Problem, frames: np.ndarray) -> Estimate:
        motion, solution = self.motion, self.solution
        state = State(
            Pose(motion.rotations[frames], motion.trans[frames], motion.betas),
            solution.placement,
            camera_of(motion.camera, self.seen.lab_centre),
            solution.bias,
        )
        links = forward(self.body, state.pose)
        return Estimate(self.body, state, links, solution.surface, self.weights, problem.unknowns)

    def parts(self, problem: Problem, at: Estimate) -> dict[str, NormalEquations]:
        """The normal equations of each term by itself."""
        found: dict[str, NormalEquations] = {}
        for term in problem.terms:
            sums = found.setdefault(term.name, NormalEquations(at.frames, problem.unknowns.size))
            term.add_to(sums, at)
        return {name: sums.gathered() for name, sums in found.items()}

    def shared(self) -> tuple[Noise, np.ndarray]:
        """The noise of the session, and a root (P, P) of the covariance of what is free of the shared unknowns."""
        problem = self.problem(self.solution.frames)
        at = self.estimate(problem, self.solution.frames)
        parts = self.parts(problem, at)
        whole = _added(parts)
        noise = found_noise(problem, at, whole, parts)
        if self.weights.free_bias:
            noise = replace(noise, video_deg=float(np.hypot(noise.video_deg, self.weights.bias_deg)))
        free, bias = self.free, problem.unknowns.bias
        once = np.zeros_like(whole.h_ss)
        if self.weights.free_bias:  # the video's bias is believed small once, beside what every frame says of it
            own = np.radians(self.weights.bias_deg) ** -2 * np.eye(bias.stop - bias.start)
            parts["prior"].h_ss[bias, bias] -= own
            once[bias, bias] += own
        back = np.linalg.solve(whole.h_ff, whole.h_fs[..., free])
        flat = back.reshape(-1, len(free))
        schur = whole.h_ss[np.ix_(free, free)] - flat.T @ whole.h_fs[..., free].reshape(flat.shape)
        score = once[np.ix_(free, free)]
        for name, part in parts.items():
            cross = flat.T @ part.h_fs[..., free].reshape(flat.shape)
            own = flat.T @ (part.h_ff @ back).reshape(flat.shape)
            score = score + noise.shared[name] * (part.h_ss[np.ix_(free, free)] + own - cross - cross.T)
        root = _root(score)
        scale = 1 / np.sqrt(np.maximum(np.diag(schur), 1e-12))
        held = schur * scale[:, None] * scale + 1e-9 * np.eye(len(free))
        return noise, scale[:, None] * np.linalg.solve(held, scale[:, None] * root)

    def rows(
        self,
        some: np.ndarray,
        noise: Noise,
        shared: np.ndarray,
        frames: SegmentFrames,
        settings: AngleSettings,
    ) -> _Rows:
        """What some frames' angles make of each kind of error."""
        problem = self.problem(some)
        at = self.estimate(problem, some)
        whole, moving = NormalEquations(len(some), problem.unknowns.size), np.zeros((len(some), POSE_SIZE, POSE_SIZE))
        constant = np.zeros_like(moving)
        for name, part in self.parts(problem, at).items():
            whole.h_ff += part.h_ff
            whole.h_fs += part.h_fs
            moving += noise.shape[name] * part.h_ff
            constant += noise.level[name] * part.h_ff
        turn = world_rotations(self.motion.rotations[some])
        bones = {name: turn[:, INDEX[SEGMENT_JOINT[name]]] for name in frames.frames}
        slopes, near, far = angle_slopes({name: bones[name] @ frames.frames[name] for name in bones}, settings)

        def by(slope: dict[str, np.ndarray]) -> np.ndarray:
            """(F, A, any) by turns (3, any) of the segments' frames on their bones."""
            moved = {name: bones[name] @ slope[name] for name in {*near, *far} - {""}}
            between = [moved[b] - moved[a] if a else moved[b] for a, b in zip(near, far, strict=True)]
            return np.einsum("fai,afik->fak", slopes, np.stack(between))

        by_pose = np.zeros((*slopes.shape[:2], POSE_SIZE))
        below = descendants()[FREE]
        for i, (a, b) in enumerate(zip(near, far, strict=True)):
            moves = below[:, INDEX[SEGMENT_JOINT[b]]].astype(float)
            if a:
                moves = moves - below[:, INDEX[SEGMENT_JOINT[a]]]
            turned = np.einsum("fi,fkij->fkj", slopes[:, i], turn[:, FREE]) * moves[:, None]
            by_pose[:, i, :-3] = turned.reshape(len(some), -1)
        answer = np.linalg.solve(whole.h_ff + 1e-9 * np.eye(POSE_SIZE), np.swapaxes(by_pose, 1, 2))
        by_shared = -np.swapaxes(answer, 1, 2) @ whole.h_fs
        by_shared[..., problem.unknowns.shape] += by(dict(frames.by_shape))
        return _Rows(
            shape=np.einsum("fia,fij,fja->fa", answer, moving, answer, optimize=True),
            shared=by_shared[..., self.free] @ shared,
            constant=np.swapaxes(answer, 1, 2) @ _root(constant),
            anatomy=by(dict(frames.by_anatomy)),
            definition=by(dict(frames.by_definition)),
        )


def _added(parts: dict[str, NormalEquations]) -> NormalEquations:
    first = next(iter(parts.values()))
    whole = NormalEquations(*first.h_fs.shape[::2])
    for part in parts.values():
        for name in ("h_ff", "h_fs", "h_ss"):
            setattr(whole, name, getattr(whole, name) + getattr(part, name))
    return whole


def _root(matrix: np.ndarray) -> np.ndarray:
    """R with R R^T = a positive semidefinite matrix (..., n, n); what is negative by rounding counts as nothing."""
    values, vectors = np.linalg.eigh((matrix + np.swapaxes(matrix, -1, -2)) / 2)
    if matrix.ndim == 2:
        return np.asarray(vectors * np.sqrt(np.maximum(values, 0)))
    # The symmetric root, which changes little from frame to frame: roots of two frames can be subtracted.
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0))[..., None, :]) @ np.swapaxes(vectors, -1, -2))
