"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

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
