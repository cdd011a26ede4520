"""Fixtures shared by all tests."""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

from markerscope.solver.core.landmarks import Landmarks

if TYPE_CHECKING:
    from PySide6.QtWidgets import QApplication

# A slow machine is no failure: no test is timed.
settings.register_profile("markerscope", deadline=None)
settings.load_profile("markerscope")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of real recordings, or a skip where it is not there."""
    folder = Path(os.environ.get("MARKERSCOPE_DATA", Path(__file__).parents[2] / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"real recordings are not at {folder} (set MARKERSCOPE_DATA)")
    return folder


@pytest.fixture(scope="session")
def squat_landmarks(shared_data: Path) -> Landmarks:
    """Landmarks of the real squat video, ten a second, tracked once a test run."""
    from markerscope.solver.video.blazepose import track_pose

    return track_pose(shared_data / "squat_video" / "video.mp4", rate=10)


@pytest.fixture(scope="session")
def qapp() -> QApplication:
    """The one Qt application of a test run; it draws into memory, whatever display there is."""
    os.environ["QT_QPA_PLATFORM"] = "offscreen"
    if sys.platform == "linux":
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = "vtkEGLRenderWindow"
    from PySide6.QtWidgets import QApplication

    from markerscope.widgets import theme

    app = QApplication.instance() or QApplication([])
    assert isinstance(app, QApplication)
    theme.apply(app, "light")
    return app
