"""A solved trial, read from its folder: each part when it is first asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar, overload

import numpy as np

from markerscope.solver.api.tables import AngleTable, Points
from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.solver.fit.doubts.doubt import Doubt
from markerscope.solver.fit.results import Candidate
from markerscope.solver.pipeline.doubts import assumptions, doubts
from markerscope.solver.pipeline.in_force import read_answers
from markerscope.solver.pipeline.methods import graph_of, result_type
from markerscope.solver.pipeline.names import ANGLES, CHECK, CLEAN, FIT, ORIENT
from markerscope.solver.pipeline.session import Session, load_session, session_folder
from markerscope.solver.pipeline.stage import GraphRun, StageName
from markerscope.solver.pipeline.store import Absent

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class PosedBody:
    """The fitted body in every frame.

    Attributes
    ----------
    time : (T,) s, the marker file's clock
    rotations : (T, 24, 3, 3), the root's in the lab (z up), the others relative to their parents
    translation : (T, 3) m, SMPL's convention: added to the posed body, whose root turns about the resting root joint
    betas : (S,) shape coefficients, bone lengths last
    joints : (T, 24, 3) m, joint centres
    joint_names : their names
    faces : (F, 3) vertex indices of the mesh
    """

    time: np.ndarray
    rotations: np.ndarray
    translation: np.ndarray
    betas: np.ndarray
    joints: np.ndarray
    joint_names: tuple[str, ...]
    faces: np.ndarray
    _model: Body = field(repr=False)

    def vertices(self, frames: slice | np.ndarray | int = slice(None)) -> np.ndarray:
        """(n, V, 3) m, the skin in some frames; all of a long trial take much memory."""
        at = np.atleast_1d(np.arange(len(self.time))[frames])
        posed: np.ndarray = self._model.pose(self.rotations[at], self.betas, self.translation[at])[0]
        return posed

    def __repr__(self) -> str:
        return f"<PosedBody: {len(self.time)} frames, {len(self.joint_names)} joints, {len(self.faces)} faces>"


@dataclass(frozen=True, eq=False)
class Result:
    """A solved trial.

    Attributes
    ----------
    folder : where its files and every stage's result lie
    """

    folder: Path
    _session: Session = field(repr=False)
    _graph: GraphRun = field(repr=False)
    _temporary: TemporaryDirectory[str] | None = field(default=None, repr=False)

    @classmethod
    def open(cls, folder: str | Path) -> Result:
        """A trial that was solved before, by the window, the command line or a script.

        Raises
        ------
        InputError : the folder holds no solved session
        """
        path = session_folder(Path(folder))
        if path is None:
            raise InputError("holds no session", folder, "name a folder that a solve wrote")
        session = load_session(path)
        keys = read_answers(path)
        if "angles" not in keys:
            raise InputError("holds a session that was not solved", folder, "solve it first")
        return cls(path, session, GraphRun(keys, {}, _reader(session, keys)))

    @property
    def stages(self) -> tuple[str, ...]:
        """Names of the stages whose results can be asked for, in their order."""
        return tuple(stage.name for stage in graph_of(self._session) if stage.name in self._graph.keys)

    @overload
    def stage(self, name: StageName[T]) -> T: ...
    @overload
    def stage(self, name: str) -> Any: ...
    def stage(self, name: str) -> Any:
        """What a stage left, as its own frozen dataclass: ``result.stage("segment").affinity``.

        Raises
        ------
        InputError : there is no such stage, or its result was deleted
        """
        if name not in self.stages:
            raise InputError(f"has no result of a stage {name!r}", self.folder, f"ask for {', '.join(self.stages)}")
        return self._graph[name]

    @cached_property
    def angles(self) -> AngleTable:
        """Joint angles over time, as ``angles.csv`` has them."""
        return AngleTable.of(self.stage(ANGLES))

    @cached_property
    def markers(self) -> Points:
        """The markers under the file's own names, cleaned and filled, with the bone that each sits on."""
        markers, motion = self.stage(CLEAN).markers, self.stage(FIT)
        joints = motion.marker_joint.tolist()
        bones = tuple(BONES[JOINTS[j]] if j >= 0 else "" for j in joints)
        filled = np.zeros(markers.present.shape, dtype=bool) if markers.filled is None else markers.filled
        return Points(markers.time, markers.labels, markers.positions, markers.rate, filled, bones)

    @cached_property
    def joints(self) -> Points:
        """The 24 joint centres of the fitted body."""
        motion = self.stage(FIT)
        none = np.zeros(motion.joints.shape[:2], dtype=bool)
        bones = tuple(BONES[joint] for joint in JOINTS)
        return Points(motion.time, tuple(JOINTS), motion.joints, self.stage(CLEAN).markers.rate, none, bones)

    @cached_property
    def body(self) -> PosedBody:
        """The fitted body in every frame."""
        motion, file = self.stage(FIT), self._session.inputs.get("body_file")
        model = load_body(file.path if file else None)
        return PosedBody(
            motion.time, motion.rotations, motion.trans, motion.betas, motion.joints, tuple(JOINTS), model.faces, model
        )

    @property
    def confidence(self) -> float:
        """0..1, how likely the markers are on the right bones and the body faces the right way."""
        return float(self.stage(CHECK).confidence)

    @property
    def doubts(self) -> tuple[Doubt, ...]:
        """What the rules have against the result, each with its sentence, its markers, its figure and its limit."""
        return self.stage(CHECK).doubts

    @property
    def warnings(self) -> tuple[str, ...]:
        """All that speaks against the result, one sentence each: the doubts, and what stages warn of."""
        return doubts(self._graph)

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed while the files were read, one sentence each."""
        return assumptions(self._graph)

    @property
    def hypotheses(self) -> tuple[Candidate, ...]:
        """The answers that were compared, best first; the one that was taken is number ``stage("fit").chosen``."""
        return self.stage(ORIENT).candidates

    @property
    def settings(self) -> Mapping[str, Any]:
        """Settings of every stage by its name, frozen dataclasses."""
        return self._session.stage_settings(graph_of(self._session))

    def __repr__(self) -> str:
        return f"<Result: {self.folder}>"


def _reader(session: Session, keys: Mapping[str, str]) -> Any:
    """What reads a stage's result from the session's store, once."""
    known: dict[str, Any] = {}

    def read(stage: str) -> Any:
        if stage not in known:
            try:
                known[stage] = session.store.get(stage, keys[stage], result_type(stage))
            except Absent as error:
                raise InputError(
                    f"has lost its result of the stage {stage}", session.folder, "solve it again"
                ) from error
        return known[stage]

    return read
