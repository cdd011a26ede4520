"""What a solve leaves in its folder, written from the stages' results."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from solver import __version__
from solver.body.skeleton import BONES, JOINTS, PARENTS
from solver.filling import filled_by_body
from solver.io.atomic import write_text_atomic
from solver.io.camera import FILE_NAME as CAMERA
from solver.io.camera import write_camera
from solver.io.export_smpl import write_smpl_npz
from solver.markers import Markers
from solver.pipeline.session import Session
from solver.pipeline.stage import GraphRun
from solver.rotations import log_so3
from solver.solve.results import FittedMotion

_MADE = "results/outputs.json"
_FILES = (
    "angles.csv",
    "angles.json",
    "angles.mot",
    "motion.npz",
    "motion.bvh",
    CAMERA,
    "markers_labelled.c3d",
    "markers_labelled.trc",
    "report.html",
)


def write_outputs(session: Session, graph: GraphRun) -> None:
    """Write every output file, unless they are there already from the same results."""
    made = {"program": __version__, **graph.keys}
    stamp = session.folder / _MADE
    if all((session.folder / name).exists() for name in _FILES) and _read(stamp) == made:
        return
    stamp.unlink(missing_ok=True)
    _write(session.folder, session, graph)
    write_text_atomic(stamp, json.dumps(made, indent=1) + "\n")


def _read(path: Path) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def _write(folder: Path, session: Session, graph: GraphRun) -> None:
    from solver.body.bones import with_bone_lengths
    from solver.body.model import Body
    from solver.io.export_angles import write_angles
    from solver.io.export_bvh import write_bvh
    from solver.io.export_c3d import write_c3d
    from solver.io.export_mot import write_mot
    from solver.io.export_trc import write_trc
    from solver.report_of import report_of

    markers, motion, angles = graph["markers"], graph["fit"], graph["angles"]
    body_file = session.inputs.get("body_file")
    body = with_bone_lengths(Body.load(body_file.path if body_file else None))
    about = provenance(session, graph)
    write_angles(folder, angles, about)
    write_mot(folder / "angles.mot", angles.time, (angles.names, np.where(angles.singular, np.nan, angles.degrees)))
    write_motion(folder / "motion.npz", markers, motion, body.betas_count)
    write_camera(folder / CAMERA, motion.camera)
    named = labelled(markers, motion)
    write_c3d(folder / "markers_labelled.c3d", named)
    write_trc(folder / "markers_labelled.trc", named)
    rest = body.joints(motion.betas)
    offsets = np.concatenate([np.zeros((1, 3)), rest[1:] - rest[PARENTS[1:]]])
    write_bvh(
        folder / "motion.bvh", JOINTS, PARENTS, offsets, motion.rotations, motion.joints[:, 0], markers.rate
    )
    report_of(folder / "report.html", session, graph, named, about)


def write_motion(path: Path, markers: Markers, motion: FittedMotion, betas_count: int) -> None:
    """The fitted body in AMASS layout, with joints and marker places; arrays as DESIGN.md's contract names them."""
    arrays: dict[str, Any] = {
        "poses": log_so3(motion.rotations).reshape(len(motion.time), -1),
        "trans": motion.trans,
        "betas": motion.betas[:betas_count],
        "bone_lengths": motion.betas[betas_count:],
        "gender": np.array("neutral"),
        "joints": motion.joints,
        "joint_names": np.array(JOINTS),
        "R_lab_internal": markers.R_lab_internal,
        "marker_joint": motion.marker_joint,
        "marker_vertex": motion.marker_vertex,
        "marker_labels": np.array(markers.labels),
        "time": motion.time,
    }
    poses, trans, betas = (arrays.pop(name) for name in ("poses", "trans", "betas"))
    write_smpl_npz(path, poses, trans, betas, markers.rate, arrays)


def labelled(markers: Markers, motion: FittedMotion) -> Markers:
    """The markers named after their bones, gaps filled by the fitted body and flagged.

    Along a bone they are numbered from its joint outwards, so that the same layout gets the same names in every trial.
    """
    filled = filled_by_body(markers, motion.placed)
    middle = np.nanmedian(
        np.linalg.norm(motion.placed - motion.joints[:, np.clip(motion.marker_joint, 0, None)], axis=2), 0
    )
    names = [f"unassigned_{label}" for label in markers.labels]
    for j, joint in enumerate(JOINTS):
        on_bone = np.flatnonzero(motion.marker_joint == j)
        for number, m in enumerate(on_bone[np.argsort(middle[on_bone], kind="stable")], start=1):
            names[m] = f"{BONES[joint]}_{number}"
    return replace(filled, labels=tuple(names))


def provenance(session: Session, graph: GraphRun) -> dict[str, Any]:
    """What was computed from what: program, inputs with digests, every stage's settings and key."""
    from solver.pipeline.digest import canonical
    from solver.pipeline.stages import GRAPH

    settings = session.stage_settings(GRAPH)
    inputs: Mapping[str, Any] = {
        name: {"file": file.path.name, "sha256": file.digest} for name, file in session.inputs.items()
    }
    return {
        "program": f"markerscope {__version__}",
        "inputs": inputs,
        "stages": {
            stage.name: {
                "key": graph.keys[stage.name],
                "version": stage.version,
                "settings": canonical(settings[stage.name]),
            }
            for stage in GRAPH
        },
        "edits": {name: dict(table) for name, table in session.edits.items()},
    }
