"""Landmarks of the real videos, computed once a test run."""

from __future__ import annotations

from pathlib import Path

import pytest

from solver.video.blazepose import track_pose
from solver.video.landmarks import Landmarks


@pytest.fixture(scope="session")
def squat_landmarks(shared_data: Path) -> Landmarks:
    return track_pose(shared_data / "squat_video" / "video.mp4", rate=10)
