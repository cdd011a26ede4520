"""A small session as files: markers, a pose prior, and what the network would have seen in a video nobody rendered."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.commands.solve import session_of
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.markers import Markers, UpAxis, lab_rotation
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.fit.kinematics import forward, place_points
from markerscope.solver.fit.lift import landmark_points
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.pipeline.inputs import LandmarkSettings
from markerscope.solver.pipeline.session import Session, save_session
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import stage_keys
from markerscope.solver.pipeline.stages import GRAPH, SOURCES
from tests.fit.conftest import Scene

QUICK: Mapping[str, Mapping[str, Any]] = {
    "localize": {"yaws": 8, "few": 6, "many": 12, "keep": 6},
    "orient": {"refine": 2},
}
"""Settings of a solve that is good enough to be judged, and takes a second or two."""
EARLIER = 8
"""Frames by which the video starts before the markers."""


@dataclass(frozen=True)
class Recording:
    """What was simulated, and the files of it.

    Attributes
    ----------
    markers, video, prior : files; the video is a stand-in that no decoder could read
    joints : (T, 24, 3) m, true, on the frames of the markers
    hidden : (T, M, 3) m, where markers were while they were hidden from the file for a while; NaN elsewhere
    bones : (M,) true bone of each marker
    offset : s, true: marker time = video time + offset
    rate : Hz, of both
    """

    markers: Path
    video: Path
    prior: Path
    scene: Scene
    joints: np.ndarray
    hidden: np.ndarray
    bones: np.ndarray
    offset: float
    rate: float


def record(
    folder: Path, scene: Scene, suffix: str = ".c3d", up: UpAxis = "z", only: np.ndarray | None = None
) -> Recording:
    """Write a simulated scene (or only some of its markers, (M,) bool) as files."""
    frames = len(scene.joints)
    rate = (frames - 1) / 4
    seen = slice(EARLIER, frames - EARLIER)
    keep = np.ones(scene.seen.markers.shape[1], bool) if only is None else only
    positions = scene.seen.markers[seen][:, keep].copy()
    hidden = np.full_like(positions, np.nan)
    for m in range(0, positions.shape[1], 9):
        gap = slice(20 + m, 35 + m)
        hidden[gap, m] = positions[gap, m]
        positions[gap, m] = np.nan
    labels = tuple(f"M{i:02d}" for i in range(positions.shape[1]))
    markers = Markers(positions, rate, labels, R_lab_internal=lab_rotation(up))
    path = folder / f"trial{suffix}"
    if suffix == ".c3d":
        write_c3d(path, markers)
    else:
        write_trc(path, markers)
    video = folder / "video.mp4"
    video.write_bytes(b"no decoder reads this")
    prior = folder / "prior.npz"
    poses = _poor_video(scene)
    write_smpl_npz(prior, log_so3(poses).reshape(frames, -1), np.zeros((frames, 3)), np.zeros(10), rate)
    joints, bones = scene.joints[seen], scene.bones[keep]
    return Recording(path, video, prior, scene, joints, hidden, bones, -EARLIER / rate, rate)


def _poor_video(scene: Scene) -> np.ndarray:
    """(F, 24, 3, 3), every joint some degrees off all the time, root in the camera's axes."""
    wrong = exp_so3(np.radians(6) * np.random.default_rng(0).normal(0, 1, (24, 3)) / np.sqrt(3))
    poses = scene.pose.rotations @ wrong
    poses[:, 0] = scene.camera.R_lab_cam.T @ poses[:, 0]
    return poses


def watched(recording: Recording) -> Landmarks:
    """What the pose network would have seen."""
    scene = recording.scene
    points, column = landmark_points(scene.body)
    frames, count = len(scene.joints), len(LANDMARKS)
    lab = place_points(points, forward(scene.body, scene.pose), scene.pose.betas)
    hips = scene.joints[:, [1, 2]].mean(axis=1, keepdims=True)
    image, world = np.full((frames, count, 2), np.nan), np.full((frames, count, 3), np.nan)
    image[:, column] = scene.seen.image
    world[:, column] = (lab - hips) @ scene.camera.R_lab_cam
    visibility = np.isfinite(world[..., 0]).astype(float)
    return Landmarks(
        np.nan_to_num(image),
        np.nan_to_num(world),
        visibility,
        np.ones(frames, bool),
        np.arange(frames) / recording.rate,
        np.arange(frames),
        scene.seen.image_size,
    )


def session(out: Path, recording: Recording, settings: Mapping[str, Any] = QUICK, **given: Any) -> SolveRequest:
    """A session folder with these settings, ready to be solved; the video, where it is given, has been watched."""
    made = session_of(SolveRequest(recording.markers, out=out, **given))
    made = replace(made, settings={**made.settings, **{name: dict(table) for name, table in settings.items()}})
    save_session(made)
    if "video" in given:
        know(made, recording)
    return SolveRequest(out)


def know(made: Session, recording: Recording, seen: Landmarks | None = None) -> None:
    """Put landmarks into a session's store, as if the network had looked at its video."""
    sources = {name: Source.file(None) for name in SOURCES} | {"video_file": Source.file(recording.video)}
    key = stage_keys(GRAPH, sources, {"landmarks": LandmarkSettings()})["landmarks"]
    made.store.put("landmarks", key, seen or watched(recording), {"seconds": 0.0, "headline": "simulated"})
