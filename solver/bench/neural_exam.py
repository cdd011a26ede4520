"""What networks are examined on: short recordings of bodies that none has seen, every joint known."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.neural.layout import HEIGHT_M, Layout
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Ready, solve_frames
from markerscope.solver.neural.metrics import joe, jpe
from markerscope.solver.neural.training.library import Clip
from markerscope.solver.synth.placement import MARKERS_PER_BONE, place_markers

FRAMES = 64
"""Of a recording."""
PLACE_M, JOINT_M = 2e-3, 2e-3
"""Standard deviation along each axis of what a network that asks for them is told of markers' and joints' places."""


@dataclass(frozen=True, eq=False)
class Recording:
    """A second of one body.

    Attributes
    ----------
    markers : (T, M, 3) m in the lab
    rotations, joints : (T, 24, 3, 3) and (T, 24, 3) m, the truth
    told : the body at rest as a solver believes it
    """

    markers: np.ndarray
    rotations: np.ndarray
    joints: np.ndarray
    told: Marked


@dataclass(frozen=True)
class Score:
    """JOE in degrees and JPE in cm over the 22 joints of the body, and frames per second of processor time."""

    joe_deg: float
    jpe_cm: float
    frames_per_s: float


Answer = Callable[[Recording], tuple[np.ndarray, np.ndarray]]
"""Rotations (T, 24, 3, 3) and joints (T, 24, 3) m of a recording."""


def recordings(body: Body, layout: Layout, clips: Sequence[Clip], count: int, seed: int) -> list[Recording]:
    """Each of another body outside of what the shape coefficients reach, and of another moment of the clips."""
    from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator

    bodies = body_pool(body, count, seed, plain=False)
    found = []
    for i in range(count):
        pool = replace(bodies, template=bodies.template[i : i + 1], joints=bodies.joints[i : i + 1])
        own = Sampler(clips, pool, ExampleSettings().plain())
        drawn = own.draw(layout, 1, generator(seed, i), FRAMES)
        rng = np.random.default_rng([seed, i])
        rest, joints = (array[0].numpy().astype(float) for array in (drawn.rest_markers, drawn.rest_joints))
        told = Marked(
            rest + rng.normal(0, PLACE_M, rest.shape),
            body.weights[layout.vertex],
            joints + rng.normal(0, JOINT_M, joints.shape),
        )
        markers, rotations, places = (
            array.numpy().astype(float) for array in (drawn.markers, drawn.rotations, drawn.joints)
        )
        found.append(Recording(markers, rotations, places, told))
    return found


def examined(answer: Answer, exam: Sequence[Recording]) -> Score:
    """How far off the answers are."""
    start = time.process_time()
    answers = [answer(recording) for recording in exam]
    seconds = time.process_time() - start
    turns = [joe(rotations, recording.rotations) for (rotations, _), recording in zip(answers, exam)]
    places = [jpe(joints, recording.joints) for (_, joints), recording in zip(answers, exam)]
    frames = sum(len(recording.markers) for recording in exam)
    return Score(float(np.mean(turns)), float(np.mean(places)), frames / max(seconds, 1e-9))


def agnostic_answer(ready: Ready, body: Body | None = None) -> Answer:
    """The layout-agnostic network's, told of the body; refined on the markers where a body model is given."""
    from markerscope.solver.neural.layout_free.agnostic_refine import refine

    def answer(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
        found = solve_frames(ready, recording.markers, recording.told)
        if body is not None:
            found = refine(body, recording.told, recording.markers, found)
        joints = chain(found.rotations, recording.told.joints, found.trans)[1]
        return found.rotations, joints

    return answer


def new_layout(body: Body, seed: int) -> Layout:
    """Forty markers, some on every bone, where a hasty hand puts them."""
    counts = MARKERS_PER_BONE | {"spine3": 4, "head": 2}
    placed = place_markers(body, np.zeros(body.shape_count), np.random.default_rng(seed), counts=counts)
    normal = body.normals(np.zeros(body.shape_count))[placed.vertex]
    labels = tuple(f"M{i + 1:02d}" for i in range(len(normal)))
    columns = np.arange(len(normal))
    return Layout(labels, placed.vertex, placed.joint, HEIGHT_M * normal, normal, columns, body.digest)
