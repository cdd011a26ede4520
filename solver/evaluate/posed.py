"""A motion on its body, whoever made it: what results and references are compared as."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.core import metrics
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io.motion_in import MOTION, MotionFile, read_motion

_MARKERS = "markers_labelled.c3d"


@dataclass(frozen=True, eq=False)
class Posed:
    """A motion on its body, on the clock of the comparison.

    Attributes
    ----------
    body : with as many shape coefficients as ``betas``
    betas : (S,)
    time : (T,) s
    rotations, trans : pose of each frame
    joints : (T, 24, 3) m
    """

    body: Body
    betas: np.ndarray
    time: np.ndarray
    rotations: np.ndarray
    trans: np.ndarray
    joints: np.ndarray

    def at(self, time: np.ndarray) -> Posed:
        """The motion at other times: joints and places linear between frames, rotations by slerp, NaN outside."""
        return replace(
            self,
            time=time,
            rotations=metrics.rotations_at(self.time, self.rotations, time),
            trans=metrics.points_at(self.time, self.trans, time),
            joints=metrics.points_at(self.time, self.joints, time),
        )

    def vertices(self, frames: np.ndarray) -> np.ndarray:
        """(n, V, 3) m."""
        mesh: np.ndarray = self.body.pose(self.rotations[frames], self.betas, self.trans[frames])[0]
        return mesh


def imported_result(
    path: str | Path, *, body: str | Path | None = None, first_time: float = 0.0
) -> tuple[Posed, tuple[str, ...]]:
    """Any program's result on its body: ours, AMASS layout, MoSh++ or SOMA; and what was assumed.

    Parameters
    ----------
    body : the SMPL model file that it was made with; by default a result's own, else the embedded one
    first_time : s, of its first frame where the file has no times
    """
    motion = read_motion(path)
    own = Path(body) if body else body_of(path)
    time = first_time + times_of(motion) if motion.time is None else motion.time
    return posed(motion, time, load_body(own), known=own is not None)


def body_of(path: str | Path) -> Path | None:
    """The user's body that a result was solved with; None is the embedded one.

    Raises
    ------
    InputError : the file holds another body now
    """
    from markerscope.solver.pipeline.digest import file_digest
    from markerscope.solver.pipeline.session import load_session, session_folder

    folder = session_folder(Path(path).parent if Path(path).name == MOTION else path)
    if folder is None:
        return None
    file = load_session(folder).inputs.get("body_file")
    if file is not None and file.digest and file_digest(file.path) != file.digest:
        raise InputError("is not the body any more that the result was solved with", file.path, "solve again")
    return None if file is None else Path(file.path)


def posed(motion: MotionFile, time: np.ndarray, body: Body, *, known: bool) -> tuple[Posed, tuple[str, ...]]:
    """The motion on ``body``, which is ``known`` to be its own or only taken to be."""
    betas = np.zeros(body.shape_count)
    foreign = not known and (motion.model or len(motion.betas) > body.betas_count)
    own = 0 if foreign else min(len(motion.betas), body.betas_count)
    betas[:own] = motion.betas[:own]
    if len(motion.bone_lengths) == body.shape_count - body.betas_count:
        betas[body.betas_count :] = motion.bone_lengths
    joints = motion.joints
    notes: tuple[str, ...] = ()
    if joints is None:
        _, joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)
        if not known:
            name = Path(motion.source).name
            notes = (f"{name} names no joints; its shape is taken to be that of the embedded body (else give --body).",)
        if foreign:
            notes = (
                f"The shape in {name} belongs to another body model and is left out; its joints and skin are those of "
                "the embedded body's mean shape (else give --body).",
            )
    return Posed(body, betas, time, motion.rotations, motion.trans, joints), notes


def times_of(motion: MotionFile) -> np.ndarray:
    """(T,) s; counted from 0 where the file has no times."""
    return np.arange(len(motion.rotations)) / motion.rate if motion.time is None else motion.time


def measured_markers(result: str | Path) -> Markers | None:
    """The markers that the result was solved from, what was filled in left out; None where they are not at hand."""
    from markerscope.solver.io.markers_in import load_markers

    folder = Path(result) if Path(result).is_dir() else Path(result).parent
    if not (folder / _MARKERS).is_file():
        return None
    markers = load_markers(folder / _MARKERS)
    if markers.filled is None:
        return markers
    return replace(markers, positions=np.where(markers.filled[..., None], np.nan, markers.positions))


def angles_of(motion: Posed) -> dict[str, np.ndarray]:
    """(T,) rad by name, on the motion's own body's landmarks; NaN where an angle is singular."""
    from markerscope.solver.angles.angles import AngleSettings, joint_angles

    found = joint_angles(
        motion.time,
        motion.rotations,
        motion.body.landmarks(motion.betas),
        motion.body.joints(motion.betas),
        AngleSettings(),
    )
    values = np.radians(np.where(found.singular, np.nan, found.degrees))
    return dict(zip(found.names, values.T, strict=True))
