"""A solve whose markers are named by a marker set first, breaks joined and exchanges mended."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from markerscope.solver.commands.label import label_into
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.markerset.request import LabelRequest
from markerscope.solver.pipeline.session import session_folder
from markerscope.solver.report.outputs import NAMED_MARKERS

POSES = "marker_set_poses.npz"
"""Written beside the results: the poses that the named trajectories led to."""


def named_first(request: SolveRequest, progress: Progress = silent) -> tuple[SolveRequest, tuple[str, ...]]:
    """The same solve of the named trajectories, and what was said of the names.

    Raises
    ------
    InputError : the markers are a session's, or nobody with the set's markers is found
    """
    if session_folder(request.markers) is not None:
        raise InputError(
            "is a session, whose markers are what they are",
            request.markers,
            "name the marker file itself with --marker-set, and --out DIR",
        )
    if request.out is None:
        raise InputError("no folder for the results was named", remedy="add --out DIR")
    assert request.marker_set is not None
    is_c3d = request.markers.suffix.lower() == ".c3d"
    out = request.out / f"{NAMED_MARKERS}{'.c3d' if is_c3d else '.trc'}"
    outcome, markers, found = label_into(
        LabelRequest(
            request.markers, out, request.marker_set, request.up, request.units, request.subject, request.marker_rate
        ),
        progress,
    )
    named = replace(request, markers=out, marker_set=None, marker_rate=None, subject=None)
    if not is_c3d:
        named = replace(named, up="y", units="m")
    said = outcome.lines
    if request.video is None and request.prior is None:
        poses: Path = request.out / POSES
        write_smpl_npz(
            poses,
            poses=log_so3(found.pose.rotations).reshape(len(found.pose.trans), -1),
            trans=found.pose.trans,
            betas=np.zeros(10),
            rate=markers.rate,
        )
        named = replace(named, prior=poses, offset=markers.first_time, rate_ratio=1.0)
        said = (*said, "There is no video: the pose that the marker set led to took its place.")
    return named, said
