"""A new session from what was chosen when its files were opened."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

from markerscope.solver.core.request import Units, Up
from markerscope.solver.pipeline.inputs import MarkerSettings
from markerscope.solver.pipeline.settings import to_table


def new_session(
    markers: Path,
    *,
    video: Path | None = None,
    prior: Path | None = None,
    up: Up | None = None,
    units: Units | None = None,
    subject: str | None = None,
    rate: float | None = None,
    left_out: Collection[int] = (),
) -> dict[str, Any]:
    """Arguments of ``Document.new``.

    Parameters
    ----------
    markers, video, prior : files
    up, units, subject, rate : how the marker file is read, rate in Hz; None as the file says
    left_out : columns of points that are no markers of the person, or are not wanted; they can be taken in again
    """
    files = {"marker_file": markers, "video_file": video, "prior_file": prior}
    settings = MarkerSettings(up=up, units=units, subject=subject, rate=rate)
    unwanted = sorted(int(column) for column in left_out)
    return {
        "inputs": {name: path for name, path in files.items() if path is not None},
        "settings": {"markers": to_table(settings)},
        "edits": {"segment": {"left_out": unwanted}} if unwanted else {},
    }
