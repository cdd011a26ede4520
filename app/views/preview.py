"""What a marker file would become under the settings of the import dialog."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers, UpAxis, lab_rotation
from markerscope.solver.io.labels import prefix, subjects_of
from markerscope.solver.io.markers_in import markers_of, settled
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.units import cloud_size, settle_units
from markerscope.widgets.dialogs.import_data import ImportShown

_AXES: tuple[UpAxis, ...] = ("x", "y", "z")
_PLACEHOLDER_HZ = 100.0
_UNITS = {1.0: "m", 0.1: "dm", 0.01: "cm", 0.001: "mm", 1e-6: "µm", 0.0254: "in", 0.3048: "ft"}
"""Names of units by their metres."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ImportPreview(ImportShown):
    """A file as it would be read: what the dialog shows, and the markers themselves.

    Attributes
    ----------
    markers : metres, z up; with a made-up rate where ``problem`` asks for one
    frame : the one with most markers in sight, whose points are shown
    size : m, diagonal of the box around one frame's markers; NaN without any
    """

    markers: Markers
    frame: int
    size: float

    @property
    def seconds(self) -> float:
        """How long the recording lasts."""
        return self.frames / self.markers.rate


def preview_of(
    raw: RawMarkers,
    path: str | Path,
    *,
    up: UpAxis | None = None,
    units: str | None = None,
    subject: str | None = None,
    rate: float | None = None,
) -> ImportPreview:
    """What ``load_markers`` would return, and what it goes by; the file is not read again.

    Parameters
    ----------
    raw : what the file holds, by ``read_raw``
    up, units, subject, rate : as in ``load_markers``; None as the file says, else guessed

    Raises
    ------
    InputError : the file cannot be shown under any settings
    """
    problem = ""
    try:
        markers = settled(raw, path, up=up, units=units, subject=subject, rate=rate)
    except InputError as error:
        if raw.rate is not None or rate is not None:
            raise
        problem = str(error)
        markers = settled(raw, path, up=up, units=units, subject=subject, rate=_PLACEHOLDER_HZ)
    own = markers_of(raw, subject, path)
    present = markers.present
    frame = int(present.sum(axis=1).argmax())
    size = cloud_size(markers.positions)
    return ImportPreview(
        name=Path(path).name,
        labels=markers.labels,
        frames=len(markers.positions),
        markers=markers,
        subjects=subjects_of(raw.labels, raw.subjects, raw.assets),
        subject=_owner(own, subjects_of(raw.labels, raw.subjects, raw.assets)),
        rate=0.0 if problem else markers.rate,
        rate_known=not problem,
        units=_unit(settle_units(own.positions, own.units, units, str(path), own.labels)[0]),
        units_declared=raw.units,
        up=_up_of(markers),
        up_declared=raw.up,
        measured=present.mean(axis=0),
        frame=frame,
        points=markers.positions[frame],
        size=float("nan") if size is None else size,
        notes=markers.notes,
        problem=problem,
    )


def _owner(own: RawMarkers, subjects: tuple[str, ...]) -> str:
    """Whose markers these are, by what stands before their names."""
    return next((name for label in own.labels if (name := prefix(label)) in subjects), "")


def _unit(metres: float) -> str:
    return next((name for size, name in _UNITS.items() if np.isclose(size, metres)), f"{metres:g} m")


def _up_of(markers: Markers) -> UpAxis:
    return next(axis for axis in _AXES if np.array_equal(lab_rotation(axis), markers.R_lab_internal))
