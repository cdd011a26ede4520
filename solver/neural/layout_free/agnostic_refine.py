"""A descent from the network's poses, where the body and the places of its markers are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.fit.kinematics import Points, Pose
from markerscope.solver.fit.refine import every_frame
from markerscope.solver.fit.state import Camera, Observations, State, Surface, Weights
from markerscope.solver.neural.layout_free.agnostic_solve import Marked, Solved


def refine(body: Body, person: Marked, markers: np.ndarray, start: Solved, network_deg: float = 8.0) -> Solved:
    """Every frame iterated until it has settled, held by the network's joint rotations.

    Parameters
    ----------
    body : of whatever shape; joints and markers are the person's
    markers : (T, M, 3) m, NaN = lost
    network_deg : degrees, spread of the network's joint rotations
    """
    shapes, frames = body.shape_count, len(markers)
    still = replace(body, joint_template=person.joints, joint_dirs=np.zeros_like(body.joint_dirs), _torch={})
    points = Points(person.rest, np.zeros((len(person.rest), 3, shapes)), person.weights)
    none = Points(np.zeros((0, 3)), np.zeros((0, 3, shapes)), np.zeros((0, 24)))
    empty = np.zeros((frames, 0))
    seen = Observations(markers, start.rotations, start.seen, empty[..., None].repeat(2, -1), empty, (0, 0))
    pose = Pose(start.rotations, start.trans, np.zeros(shapes))
    state = State(pose, points, Camera(np.eye(3), np.zeros(3), np.zeros(3), 1.0))
    weights = Weights(prior_deg=network_deg, root_deg=network_deg, anatomical=0.0)
    surface = Surface(person.rest, np.zeros_like(person.rest))
    found = every_frame(still, seen, none, np.arange(frames), state, surface, weights, start=pose).pose
    return Solved(found.rotations, found.trans, start.seen)
