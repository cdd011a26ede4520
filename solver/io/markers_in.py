"""Marker files in: one call for every format, into metres with z up."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.file_kinds import refuse_other_kind
from markerscope.solver.core.markers import Markers, UpAxis
from markerscope.solver.io.c3d import read_c3d
from markerscope.solver.io.c3d_format import looks_like_c3d
from markerscope.solver.io.filled_list import apply_filled_list
from markerscope.solver.io.labels import computed_by_name, prefix, subjects_of, unique, without_prefix
from markerscope.solver.io.raw import RawMarkers
from markerscope.solver.io.table import read_table
from markerscope.solver.io.text import decode, read_bytes
from markerscope.solver.io.trc import looks_like_trc, read_trc
from markerscope.solver.io.units import settle_units
from markerscope.solver.io.up_axis import settle_up

_LEAST_HZ, _MOST_HZ = 1.0, 2000.0
_LONGEST_S = 4 * 3600.0
_NO_VALUE = 9999999.0  # what some programs write where there is none


@np.errstate(all="ignore")  # a damaged number becomes a lost position, not a warning
def load_markers(
    path: str | Path,
    *,
    up: UpAxis | None = None,
    units: str | None = None,
    subject: str | None = None,
    rate: float | None = None,
) -> Markers:
    """Read marker trajectories from C3D, TRC, CSV or TSV, whatever the file is called.

    Parameters
    ----------
    path : the file
    up : its vertical axis, where it does not say or says it wrongly
    units : its unit of length (``m``, ``cm``, ``mm``, ...), where it does not say or says it wrongly
    subject : whose markers to take where it holds several people's (see ``list_subjects``)
    rate : frames a second, Hz, where it does not say or says it wrongly

    Returns
    -------
    Markers
        In metres, z up. Everything assumed or left out is said in its ``notes``. Markers never seen are kept,
        results of models (joint centres, angles, forces) are not.

    Raises
    ------
    InputError : the file cannot be read or does not say enough
    """
    return settled(read_raw(path), path, up=up, units=units, subject=subject, rate=rate)


@np.errstate(all="ignore")
def settled(
    raw: RawMarkers,
    path: str | Path,
    *,
    up: UpAxis | None = None,
    units: str | None = None,
    subject: str | None = None,
    rate: float | None = None,
) -> Markers:
    """What a file holds, as metres with z up: ``load_markers`` of a file that was read before."""
    if up is not None and up not in ("x", "y", "z"):
        raise InputError(f"{up!r} is not a vertical axis", "up", "say x, y or z")
    if rate is not None and not (np.isfinite(rate) and rate > 0):
        raise InputError(f"{rate!r} is not a frame rate", "rate", "give it in Hz, for instance 100")
    people = subjects_of(raw.labels, raw.subjects, raw.assets)
    raw = markers_of(raw, subject, path)
    positions = raw.positions
    rate, rate_notes = _settle_rate(raw.rate, rate, len(positions), path)
    factor, unit_notes = settle_units(positions, raw.units, units, str(path), raw.labels)
    metres = positions * factor
    R_lab_internal, up_notes = settle_up(metres, raw, up)
    metres = _lost_as_nan(metres @ R_lab_internal)
    labels = unique([without_prefix(label, people) for label in raw.labels])
    present = np.isfinite(metres).all(axis=2)
    unseen = [labels[m] for m in np.flatnonzero(~present.any(axis=0))]
    seen_notes = (f"Never seen: {_some(unseen)}.",) if unseen else ()
    return Markers(
        positions=metres,
        rate=rate,
        labels=labels,
        first_time=raw.first_frame / rate if raw.first_time is None else raw.first_time,
        R_lab_internal=R_lab_internal,
        filled=None if raw.filled is None else raw.filled & present,
        source=str(path),
        notes=(*raw.notes, *rate_notes, *unit_notes, *up_notes, *seen_notes),
    )


@np.errstate(all="ignore")
def markers_of(raw: RawMarkers, subject: str | None, path: str | Path) -> RawMarkers:
    """The markers of one subject (of the one with most data where none is named), without what is no marker."""
    raw = _markers_only(_one_subject(raw, subject, path), path)
    if raw.positions.shape[0] == 0:
        raise InputError("has no frames", path, "export the marker trajectories again")
    return replace(raw, positions=_lost_as_nan(raw.positions))


def list_subjects(path: str | Path) -> tuple[str, ...]:
    """Subjects in the file that ``load_markers`` can tell apart, in the file's order; empty where it names none."""
    raw = read_raw(path)
    return subjects_of(raw.labels, raw.subjects, raw.assets)


@np.errstate(all="ignore")
def read_raw(path: str | Path) -> RawMarkers:
    """What a file holds, as it stands there: before units, axes, rate and subject are settled."""
    data = read_bytes(path)
    if not looks_like_c3d(data):
        refuse_other_kind(data, path, "a marker file (C3D, TRC or a table)")
    if is_c3d(data, path):
        return read_c3d(path, data)
    text = decode(data, path)
    if looks_like_trc(text) or Path(path).suffix.lower() == ".trc":
        return apply_filled_list(read_trc(path, text), path)
    return read_table(path, text)


def is_c3d(data: bytes, path: str | Path) -> bool:
    """Whether a file is a C3D, by what it holds; one that is damaged at its very start, by its name."""
    return looks_like_c3d(data) or (Path(path).suffix.lower() == ".c3d" and b"\0" in data[:512])


def _one_subject(raw: RawMarkers, wanted: str | None, path: str | Path) -> RawMarkers:
    """The markers of one subject, and those that belong to nobody."""
    choices = subjects_of(raw.labels, raw.subjects, raw.assets)
    if wanted is not None and wanted not in choices:
        remedy = f"choose one of: {', '.join(choices)}" if choices else "leave the subject out, the file names none"
        raise InputError(f"holds no subject {wanted!r}", path, remedy)
    owners = np.array([head if (head := prefix(label)) in choices else "" for label in raw.labels], dtype=object)
    if len(choices) < 2:
        if len(raw.subjects) > 1 and not choices:
            note = f"The file lists {_some(raw.subjects)} but not whose each marker is; all were taken."
            return replace(raw, notes=(*raw.notes, note))
        things = tuple(dict.fromkeys(head for label in raw.labels if (head := prefix(label)) and head not in choices))
        if len(things) > 1 and not raw.assets:
            note = f"What stands before the colons ({_some(things)}) was not taken for people; all markers were kept."
            return replace(raw, notes=(*raw.notes, note))
        return raw
    seen = (np.isfinite(raw.positions).all(axis=2) & (raw.positions != 0).any(axis=2)).sum(axis=0)
    if wanted is None:
        wanted = max(choices, key=lambda name: int(seen[owners == name].sum()))
        others = [name for name in choices if name != wanted]
        note = f"Subject {wanted} was taken, who has most data (others in the file: {_some(others)})."
        raw = replace(raw, notes=(*raw.notes, note))
    return _select(raw, (owners == wanted) | (owners == ""))


def _markers_only(raw: RawMarkers, path: str | Path) -> RawMarkers:
    """Leave out what is no marker: model outputs that the file lists or whose names give them away."""
    computed = computed_by_name(raw.labels)
    if raw.virtual is not None:
        computed |= raw.virtual
    if computed.all():
        raise InputError("holds no markers, only results of models", path, "export it with its marker trajectories")
    if not computed.any():
        return raw
    names = [label for label, out in zip(raw.labels, computed, strict=True) if out]
    raw = _select(raw, ~computed)
    return replace(raw, notes=(*raw.notes, f"Left out as computed, not measured: {_some(names)}."))


def _select(raw: RawMarkers, keep: np.ndarray) -> RawMarkers:
    return replace(
        raw,
        positions=raw.positions[:, keep],
        labels=tuple(label for label, kept in zip(raw.labels, keep, strict=True) if kept),
        filled=None if raw.filled is None else raw.filled[:, keep],
        virtual=None if raw.virtual is None else raw.virtual[keep],
        points=None if raw.points is None else raw.points[keep],
    )


def _lost_as_nan(positions: np.ndarray) -> np.ndarray:
    """A position is whole or lost: exact zeros, infinities and the customary 9999999 are lost."""
    odd = ~np.isfinite(positions).all(axis=2) | (np.abs(positions) >= _NO_VALUE).any(axis=2)
    return np.where((odd | (positions == 0).all(axis=2))[..., None], np.nan, positions)


def _settle_rate(
    found: float | None, wanted: float | None, frames: int, path: str | Path
) -> tuple[float, tuple[str, ...]]:
    found = found if found is not None and np.isfinite(found) and 0 < found < 1e6 else None
    if wanted is None and found is None:
        raise InputError("does not say its frame rate", path, "give the rate in Hz")
    if wanted is not None and found is not None and wanted != found:
        rate, notes = wanted, [f"The file says {found:g} Hz; {wanted:g} Hz was taken as asked."]
    else:
        rate, notes = wanted or found or 0.0, []
    if not _LEAST_HZ < rate <= _MOST_HZ:
        notes.append(f"A rate of {rate:g} Hz is no motion capture's (1 to 2000 Hz); check it, or give the rate in Hz.")
    if frames / rate > _LONGEST_S:
        notes.append(
            f"By its rate of {rate:g} Hz the recording lasts {frames / rate / 3600:.3g} hours; check the rate."
        )
    return rate, tuple(notes)


def _some(names: list[str] | tuple[str, ...], most: int = 8) -> str:
    """The first few names, and how many more."""
    return ", ".join(names[:most]) + (f" and {len(names) - most} more" if len(names) > most else "")
