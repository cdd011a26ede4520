"""Files that ship with Markerscope: the body, the pose networks, the example session."""

from __future__ import annotations

from pathlib import Path


def resource(*parts: str) -> Path:
    """Path of a shipped file."""
    return Path(__file__).parent.joinpath(*parts)
