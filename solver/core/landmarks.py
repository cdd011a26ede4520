"""What a pose network sees of the person in each video frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

LANDMARKS = (
    "nose left_eye_inner left_eye left_eye_outer right_eye_inner right_eye right_eye_outer left_ear right_ear "
    "mouth_left mouth_right left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist "
    "left_pinky right_pinky left_index right_index left_thumb right_thumb left_hip right_hip left_knee right_knee "
    "left_ankle right_ankle left_heel right_heel left_foot_index right_foot_index"
).split()
"""The 33 landmarks of BlazePose, in its order."""


@dataclass(frozen=True)
class Landmarks:
    """BlazePose landmarks of one person along a video.

    Attributes
    ----------
    image : (F, 33, 2) px in the full upright video frame, x right, y down; NaN where not tracked
    world : (F, 33, 3) m about the hip centre, x right, y down, z away from the camera; NaN where not tracked
    visibility : (F, 33) 0..1, how likely the landmark is in sight; 0 where not tracked
    tracked : (F,) True where a person was found
    time : (F,) s, presentation time in the video's clock
    frame : (F,) index of the decoded video frame
    image_size : (width, height) px
    source : path of the video
    """

    image: np.ndarray
    world: np.ndarray
    visibility: np.ndarray
    tracked: np.ndarray
    time: np.ndarray
    frame: np.ndarray
    image_size: tuple[int, int]
    source: str = ""
