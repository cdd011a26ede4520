"""What is drawn over a video frame: landmarks, and the markers and the body as the fitted camera sees them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.posing import BONE_EDGES
from markerscope.app.views.tracks import MarkerTracks
from markerscope.solver.core.camera import CameraResult
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.sync.offset import Sync

_NEAR_S = 0.1
"""Landmarks further apart than this are not interpolated between."""
_CLOSEST_M = 0.05
"""Nothing nearer to the camera's plane than this can be projected."""

_CHAINS = (
    "left_ear left_eye_outer left_eye left_eye_inner nose right_eye_inner right_eye right_eye_outer right_ear",
    "mouth_left mouth_right",
    "left_shoulder right_shoulder right_hip left_hip left_shoulder",
    *(
        chain.replace("*", side)
        for side in ("left", "right")
        for chain in (
            "*_shoulder *_elbow *_wrist *_pinky *_index *_wrist *_thumb",
            "*_hip *_knee *_ankle *_heel *_foot_index *_ankle",
        )
    ),
)
LANDMARK_EDGES = np.array(
    [(LANDMARKS.index(a), LANDMARKS.index(b)) for chain in _CHAINS for a, b in zip(chain.split(), chain.split()[1:])]
)
"""(35, 2) landmarks that a line joins."""


@dataclass(frozen=True, eq=False)
class SeenLandmarks:
    """Landmarks of one video frame.

    Attributes
    ----------
    px : (33, 2) px, NaN where the person was not tracked
    visibility : (33,) 0..1
    tracked : whether the person was found here
    interpolated : True where this frame was not watched, but those beside it were
    """

    px: np.ndarray
    visibility: np.ndarray
    tracked: bool
    interpolated: bool


@dataclass(frozen=True, eq=False)
class Projection:
    """Markers and body as the fitted camera sees them at one moment.

    Attributes
    ----------
    markers : (M, 2) px, NaN where lost or behind the camera
    joints : (24, 2) px, and bones (23, 2), which of them a line joins
    body : (V, 2) px, the body's coarse mesh, and faces (F, 3), its triangles
    """

    markers: np.ndarray
    joints: np.ndarray
    bones: np.ndarray
    body: np.ndarray
    faces: np.ndarray


def landmarks_at(landmarks: Landmarks, frame: int, time: float) -> SeenLandmarks:
    """The landmarks of a decoded video frame.

    Parameters
    ----------
    frame, time : of the video: number of the decoded frame, and its presentation time in s
    """
    right = int(np.searchsorted(landmarks.frame, frame))
    if right < len(landmarks.frame) and landmarks.frame[right] == frame:
        found = bool(landmarks.tracked[right])
        return SeenLandmarks(landmarks.image[right], landmarks.visibility[right], found, False)
    left = right - 1
    bridged = left >= 0 and right < len(landmarks.frame)
    if bridged:
        span = landmarks.time[right] - landmarks.time[left]
        bridged = bool(landmarks.tracked[left] and landmarks.tracked[right] and 0 < span <= 2 * _NEAR_S)
    if not bridged:
        nothing = np.full((len(LANDMARKS), 2), np.nan)
        return SeenLandmarks(nothing, np.zeros(len(LANDMARKS)), False, False)
    share = float(np.clip((time - landmarks.time[left]) / span, 0, 1))
    between = [(1 - share) * v[left] + share * v[right] for v in (landmarks.image, landmarks.visibility)]
    return SeenLandmarks(between[0], between[1], True, True)


def projected(camera: CameraResult, points: np.ndarray) -> np.ndarray:
    """(..., 2) px of points (..., 3) m in the lab; NaN for what lies behind the camera, or where there was no video."""
    if camera.image_size == (0, 0):
        return np.full((*points.shape[:-1], 2), np.nan)
    seen = (points - camera.position) @ camera.R_lab_cam
    depth = np.where(seen[..., 2:] > _CLOSEST_M, seen[..., 2:], np.nan)
    px: np.ndarray = camera.focal * seen[..., :2] / depth + np.array(camera.image_size) / 2
    return px


def projection_at(
    camera: CameraResult, sync: Sync, video_time: float, tracks: MarkerTracks, body: BodyTrack | None = None
) -> Projection:
    """What belongs over the video frame shown at ``video_time``, s of the video's clock.

    Markers and body are taken at that frame's own moment, which lies between two marker frames as a rule: drawn at the
    nearest they would run ahead of the person by up to half a marker frame.
    """
    time = float(sync.marker_time(np.array(video_time)))
    markers = projected(camera, tracks.at(time))
    inside = tracks.markers.first_time - 1e-6 <= time <= tracks.time(len(tracks.state) - 1) + 1e-6
    if body is None or not inside:
        nothing = np.zeros((0, 2))
        return Projection(markers, nothing, BONE_EDGES[:0], nothing, np.zeros((0, 3), dtype=np.intp))
    pose = body.pose(time)
    skin, joints = projected(camera, body.coarse.at(pose)), projected(camera, body.coarse.joints(pose))
    return Projection(markers, joints, BONE_EDGES, skin, body.coarse.faces)
