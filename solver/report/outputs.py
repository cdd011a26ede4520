"""What a solve leaves in its folder, written from the stages' results."""

from __future__ import annotations

import json
import os
import secrets
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.angles.angles import world_rotations
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import BONES, JOINTS, PARENTS
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.c3d_keep import Original
from markerscope.solver.io.camera import FILE_NAME as CAMERA
from markerscope.solver.io.camera import write_camera
from markerscope.solver.io.export_angles import AS_RECORDED
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.together import together
from markerscope.solver.pipeline.digest import canonical, file_digest
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.names import ANGLES, CLEAN, ERRORS, FIT
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.source import changed
from markerscope.solver.pipeline.stage import GraphRun
from markerscope.solver.report.filling import filled_by_body
from markerscope.solver.report.report_data import Picture

FILES = (
    "angles.csv",
    "angles.json",
    "angles.mot",
    "motion.npz",
    "motion.bvh",
    "markers_labelled.c3d",
    "markers_labelled.trc",
    "report.html",
)
"""Written by every solve."""
SOMETIMES = (CAMERA, "markers_labelled.filled.csv", AS_RECORDED)
"""Written where there was a video, where gaps were filled, and where angles are relative to a neutral pose."""
FORMATS = {
    "angles": ("angles.csv", "angles.json", AS_RECORDED),
    "angles_long": ("angles_long.csv", "angles.json"),
    "mot": ("angles.mot",),
    "c3d": ("markers_labelled.c3d",),
    "trc": ("markers_labelled.trc", "markers_labelled.filled.csv"),
    "bvh": ("motion.bvh",),
    "motion": ("motion.npz",),
    "camera": (CAMERA,),
    "report": ("report.html",),
}
"""The files of each format; a camera and filled points are not always there."""
STANDARD = tuple(name for name in FORMATS if name != "angles_long")
"""What a solve writes."""
NAMED_MARKERS = "named_markers"
"""The trajectories as a marker set named them, where a solve began with that; ending as the marker file's."""
_STAMP = "outputs.json"


def write_outputs(session: Session, graph: GraphRun) -> tuple[str, ...]:
    """Write every output file, unless they are there as they were written from the same results.

    Returns what of the marker file's other sections could not be kept in a C3D, one sentence each.

    They are made in a folder of their own first: where that fails, none of them is touched.

    Raises
    ------
    InputError : the file system refuses
    """
    about = provenance(session, graph)
    stamp = session.store.root / _STAMP
    known = _read(stamp)
    if known.get("from") == about and _as_written(session.folder, known.get("files")):
        return tuple(known.get("notes", ()))
    # A name that the store clears away, whatever ends this process.
    staging = session.store.root / "outputs" / f".tmp-{os.getpid()}-{secrets.token_hex(4)}"
    with together(session.folder, (*FILES, *SOMETIMES), staging) as place:
        notes = _write(place, session, graph, about)
        made = {path.name: file_digest(path) for path in sorted(place.iterdir())}
        stamp.unlink(missing_ok=True)
    with suppress(OSError):
        staging.parent.rmdir()
    write_text_atomic(stamp, json.dumps({"from": about, "files": made, "notes": notes}, indent=1) + "\n")
    return notes


def _read(stamp: Path) -> dict[str, Any]:
    try:
        content = json.loads(stamp.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}


def _as_written(folder: Path, files: Any) -> bool:
    """Whether all files are there and hold what was written."""
    if not isinstance(files, dict) or not set(FILES) <= set(files):
        return False
    return all((folder / name).is_file() and file_digest(folder / name) == digest for name, digest in files.items())


def write_formats(
    folder: Path,
    session: Session,
    graph: GraphRun,
    formats: Collection[str],
    pictures: Sequence[Picture] = (),
) -> tuple[Path, ...]:
    """Write some of the formats into any folder, all or none, and say which files these are.

    Parameters
    ----------
    formats : names out of ``FORMATS``
    pictures : for the report

    Raises
    ------
    InputError : the file system refuses
    """
    with together(folder) as place:
        _write(place, session, graph, provenance(session, graph), formats, pictures)
        names = sorted(path.name for path in place.iterdir())
    return tuple(folder / name for name in names)


def _write(
    folder: Path,
    session: Session,
    graph: GraphRun,
    about: Mapping[str, Any],
    formats: Collection[str] = STANDARD,
    pictures: Sequence[Picture] = (),
) -> tuple[str, ...]:
    """Write the formats into a folder of their own, and say what of the marker file's C3D could not be kept."""
    from markerscope.solver.angles.angles import evidence
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.io.c3d_keep import kept_or_plain
    from markerscope.solver.io.export_angles import angles_long_csv, write_angles
    from markerscope.solver.io.export_bvh import write_bvh
    from markerscope.solver.io.export_mot import write_mot
    from markerscope.solver.io.export_trc import write_trc
    from markerscope.solver.report.report_of import report_of

    markers, motion, angles = graph[CLEAN].measured, graph[FIT], graph[ANGLES]
    body_file = session.inputs.get("body_file")
    body = load_body(body_file.path if body_file else None)
    if body_file is not None and body_file.digest and file_digest(body_file.path) != body_file.digest:
        raise changed(body_file.path)
    named = labelled(graph[CLEAN].decided, motion)
    if named_by_set(session):
        named = replace(named, labels=markers.labels)
    not_kept: tuple[str, ...] = ()
    if "angles" in formats or "angles_long" in formats:  # the long form, too, has its convention beside it
        columns = session.stage_settings(graph_of(session))["errors"].columns
        grounds = evidence(angles.convention, motion.marker_joint)
        write_angles(folder, angles, about, grounds, graph[ERRORS], columns)
    if "angles_long" in formats:
        write_text_atomic(folder / "angles_long.csv", angles_long_csv(angles))
    if "mot" in formats:
        # A model is posed by coordinates as its convention counts them, whatever the neutral pose.
        told = angles.as_recorded
        write_mot(folder / "angles.mot", told.time, (told.names, np.where(told.singular, np.nan, told.degrees)))
    if "motion" in formats:
        write_motion(folder / "motion.npz", markers, motion, body.betas_count)
    if "camera" in formats and motion.camera.image_size != (0, 0):
        write_camera(folder / CAMERA, motion.camera)
    if "c3d" in formats:
        not_kept = kept_or_plain(folder / "markers_labelled.c3d", named, _original(session), named.labels)
    if "trc" in formats:
        write_trc(folder / "markers_labelled.trc", named)
    if "bvh" in formats:
        rest = body.joints(motion.betas)
        offsets = np.concatenate([np.zeros((1, 3)), rest[1:] - rest[PARENTS[1:]]])
        write_bvh(folder / "motion.bvh", JOINTS, PARENTS, offsets, motion.rotations, motion.joints[:, 0], markers.rate)
    if "report" in formats:
        report_of(folder / "report.html", session, graph, named, about, pictures)
    return not_kept


def named_by_set(session: Session) -> bool:
    """Whether the markers were named by a marker set before the solve, so that their names are to stay."""
    file = session.inputs.get("marker_file")
    return (
        file is not None
        and file.path.stem == NAMED_MARKERS
        and file.path.with_name(f"{NAMED_MARKERS}.labels.json").is_file()
    )


def _original(session: Session) -> Original | None:
    """The marker file, whose other sections a C3D keeps; None where it is not there as it was read."""
    file = session.inputs.get("marker_file")
    if file is None or not file.path.is_file() or file_digest(file.path) != file.digest:
        return None
    settings = session.stage_settings(graph_of(session))["markers"]
    return Original(file.path, settings.units, settings.subject)


def write_motion(path: Path, markers: Markers, motion: FittedMotion, betas_count: int) -> None:
    """The fitted body in AMASS layout, with joints and marker places."""
    write_smpl_npz(
        path,
        poses=log_so3(motion.rotations).reshape(len(motion.time), -1),
        trans=motion.trans,
        betas=motion.betas[:betas_count],
        rate=markers.rate,
        extra={
            "bone_lengths": motion.betas[betas_count:],
            "joints": motion.joints,
            "joint_names": np.array(JOINTS),
            "R_lab_internal": markers.R_lab_internal,
            "marker_joint": motion.marker_joint,
            "marker_vertex": motion.marker_vertex,
            "marker_labels": np.array(markers.labels),
            "time": motion.time,
        }
        | ({} if motion.settled is None else {"settled": motion.settled, "settled_deg": motion.settled_deg}),
    )


def labelled(markers: Markers, motion: FittedMotion) -> Markers:
    """The markers named after their bones, gaps filled by the fitted body and flagged.

    Along a bone they are numbered from its joint outwards, so that the same layout gets the same names in every trial.
    """
    bones = world_rotations(motion.rotations)[:, np.clip(motion.marker_joint, 0, None)]
    filled = filled_by_body(markers, motion.placed, bones)
    names = [f"unassigned_{label}" for label in markers.labels]
    for j, joint in enumerate(JOINTS):
        on_bone = np.flatnonzero(motion.marker_joint == j)
        reach = np.linalg.norm(motion.placed[:, on_bone] - motion.joints[:, [j]], axis=2)
        for number, m in enumerate(on_bone[np.argsort(np.median(reach, axis=0), kind="stable")], start=1):
            names[m] = f"{BONES[joint]}_{number}"
    return replace(filled, labels=tuple(names))


def provenance(session: Session, graph: GraphRun) -> dict[str, Any]:
    """What was computed from what: program, inputs with digests, every stage's settings and key."""
    stages = graph_of(session)
    settings = session.stage_settings(stages)
    inputs: Mapping[str, Any] = {
        name: {"file": file.path.name, "sha256": file.digest} for name, file in session.inputs.items()
    }
    return {
        "program": f"markerscope {__version__}",
        **asdict(session.run),
        "inputs": inputs,
        "stages": {
            stage.name: {
                "key": graph.keys[stage.name],
                "version": stage.version,
                "settings": canonical(settings[stage.name]),
            }
            for stage in stages
        },
        "edits": canonical(session.edits),
    }
