"""The report of a solve: the stages' results turned into what a report shows."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.angles.angles import evidence
from markerscope.solver.body.bones import load_body
from markerscope.solver.clustering.segment import Segmentation
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.skeleton import BONES, JOINTS
from markerscope.solver.figures.svg import svg
from markerscope.solver.fit.pull.results import words_of
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.pipeline.doubts import doubts
from markerscope.solver.pipeline.names import ANGLES, CHECK, CLEAN, ERRORS, FIT, ORIENT, PRIOR, SEGMENT, SURFACE, SYNC
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.stage import GraphRun
from markerscope.solver.report.gait import gait_of
from markerscope.solver.report.headlines import headlines, said_pinned
from markerscope.solver.report.report import write_report
from markerscope.solver.report.report_data import (
    AngleCurve,
    Gaps,
    Groups,
    Hypothesis,
    InputFile,
    Picture,
    ReportData,
    Stage,
    marker_residuals,
)

_ROLES = {
    "marker_file": "markers",
    "video_file": "video",
    "prior_file": "pose prior",
    "camera_file": "camera",
    "body_file": "body",
    "neutral_file": "neutral pose",
    "known_file": "known person",
}
_LIBRARIES = ("numpy", "scipy", "open3d-cpu", "open3d", "ai-edge-litert", "av")


def report_of(
    path: Path,
    session: Session,
    graph: GraphRun,
    named: Markers,
    about: Mapping[str, Any],
    pictures: Sequence[Picture] = (),
) -> None:
    """Write the report of one solve.

    Parameters
    ----------
    named : the labelled markers, in the order of the file's
    about : provenance: program, inputs with digests, stages with settings
    pictures : views of the session, where somebody made them
    """
    write_report(path, replace(_data(session, graph, named, about), pictures=tuple(pictures)))


def _data(session: Session, graph: GraphRun, named: Markers, about: Mapping[str, Any]) -> ReportData:
    markers, motion, ranked = graph[CLEAN].measured, graph[FIT], graph[ORIENT]
    notes = {"marker_file": markers.notes, "prior_file": graph[PRIOR].notes}
    inputs = tuple(
        InputFile(_ROLES.get(name, name), row["file"], row["sha256"], tuple(notes.get(name, ())))
        for name, row in about["inputs"].items()
    )
    bones = tuple("" if j < 0 else BONES[JOINTS[j]].replace("_", " ") for j in motion.marker_joint)
    stages = tuple(
        Stage(
            name,
            {key: _said(value) for key, value in row["settings"].items()},
            graph.events[name].seconds if graph.events[name].computed else None,
        )
        for name, row in about["stages"].items()
    )
    marker_file = session.inputs["marker_file"].path
    pinned = about["stages"]["fit"]["settings"].get("candidate")
    stands_on = f", {said_pinned(pinned)}" if pinned is not None else ""
    part = ranked.candidates[motion.chosen].part
    body_file = session.inputs.get("body_file")
    gait = gait_of(motion, load_body(body_file.path if body_file else None), markers.rate, marker_file.stem)
    filled = np.zeros(markers.present.shape, bool) if named.filled is None else named.filled
    return ReportData(
        title=marker_file.stem,
        subtitle=f"{part}, {len(motion.time)} frames at {markers.rate:g} Hz{stands_on}",
        headlines=headlines(
            None if "known" in graph.keys else graph[SYNC], ranked, motion, graph[SURFACE], graph[CHECK], pinned
        ),
        warnings=doubts(graph),
        inputs=inputs,
        groups=_groups(markers, graph[SEGMENT]),
        hypotheses=_hypotheses(ranked, motion),
        margin=ranked.margin,
        angles=_curves(graph[ANGLES], graph[ERRORS], evidence(graph[ANGLES].convention, motion.marker_joint)),
        gait="" if gait is None else svg(gait.page),
        gait_notes=() if gait is None else gait.notes,
        zero_pose=graph[ANGLES].zero_pose,
        residuals=marker_residuals(
            named.labels,
            markers.labels,
            bones,
            motion.residual,
            markers.present,
            motion.time,
            None if motion.pull is None else words_of(motion.pull),
        ),
        gaps=Gaps(named.labels, motion.time, markers.present, filled),
        stages=stages,
        versions=_versions(about),
    )


def _groups(markers: Markers, found: Segmentation) -> Groups:
    return Groups(
        markers.labels,
        found.affinity,
        found.measured,
        found.linkage,
        found.leaves,
        found.order,
        found.cut,
        found.clusters,
    )


def _hypotheses(ranked: Orientation, motion: FittedMotion) -> tuple[Hypothesis, ...]:
    return tuple(
        Hypothesis(c.part, c.heading_deg, c.energy, c.energies, c.refined, i == motion.chosen, i == ranked.runner_up)
        for i, c in enumerate(ranked.candidates)
    )


def _curves(angles: JointAngles, errors: AngleErrors | None, grounds: Mapping[str, str]) -> tuple[AngleCurve, ...]:
    """One curve per angle, left and right together, with its standard errors and whether anything was measured."""
    columns: dict[str, dict[str, int]] = {}
    for i, name in enumerate(angles.names):
        title, side = title_and_side(name, angles.names)
        columns.setdefault(title, {})[side] = i
    curves = []
    for title, sides in columns.items():
        values = {side: np.where(angles.singular[:, i], np.nan, angles.degrees[:, i]) for side, i in sides.items()}
        if not any(np.isfinite(v).any() for v in values.values()):
            continue
        flagged = np.any([angles.singular[:, i] for i in sides.values()], axis=0)
        spread = {} if errors is None else {side: errors.total[:, i] for side, i in sides.items()}
        unmeasured = frozenset(side for side, i in sides.items() if grounds[angles.names[i]] == "video only")
        curves.append(AngleCurve(title, "degrees", angles.time, values, flagged, spread, unmeasured))
    return tuple(curves)


def title_and_side(name: str, names: tuple[str, ...]) -> tuple[str, str]:
    """What a column is of, and of which side: conventions put ``_r`` at the end or ``R`` at the start."""
    words = name.replace("_", " ")
    for end, side in (("_r", "right"), ("_l", "left")):
        if name.endswith(end):
            return words[:1].upper() + words[1:-2], side
    for start, other, side in (("R", "L", "right"), ("L", "R", "left")):
        if name.startswith(start) and other + name[1:] in names:
            return words[1:], side
    return words[:1].upper() + words[1:], ""


def _said(value: Any) -> str:
    return "as found" if value is None else str(value)


def _versions(about: Mapping[str, Any]) -> dict[str, str]:
    found = {"program": str(about["program"]).removeprefix("markerscope ")}
    for name in _LIBRARIES:
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue
    return found
