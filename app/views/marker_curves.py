"""Markers over time as curves: from trajectories to what the plots draw."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from markerscope.app.models.gap_previews import Preview
from markerscope.app.models.working import Working
from markerscope.solver.cleaning.gaps import Fill, Gap
from markerscope.widgets import palette
from markerscope.widgets.plots.marker_curve_data import CurvePicture, CurvePlot, Line, ProposalRow, Shade, Way

MOST = 8
"""Markers that are drawn at most: more cannot be told apart."""
QUANTITIES = ("position", "velocity", "acceleration")
_UNITS = {"position": "", "velocity": "/s", "acceleration": "/s²"}
NOTHING = (
    "Select a marker, in the scene or the table, or press N for the next gap: its x, y and z over time are drawn here."
)
UNREAD = "The curves of the selected markers are drawn here as soon as a marker file has been read."


@dataclass(frozen=True, eq=False)
class Looks:
    """What is asked for.

    Attributes
    ----------
    components : indices of x, y, z
    quantities : of ``QUANTITIES``
    raw, filled, body : which curves besides the cleaned one
    metres : instead of millimetres
    """

    components: tuple[int, ...] = (0, 1, 2)
    quantities: tuple[str, ...] = ("position",)
    raw: bool = True
    filled: bool = True
    body: bool = True
    metres: bool = False


def derivative(track: np.ndarray, rate: float, quantity: str) -> np.ndarray:
    """(T, 3) of positions (T, 3) m: themselves, central differences m/s, or second differences m/s^2."""
    if quantity == "position":
        return track
    found = np.full_like(track, np.nan)
    if len(track) > 2:
        if quantity == "velocity":
            found[1:-1] = (track[2:] - track[:-2]) * (0.5 * rate)
        else:
            found[1:-1] = (track[2:] - 2 * track[1:-1] + track[:-2]) * rate**2
    return found


def fills_of(work: Working, pending: Sequence[tuple[Fill, np.ndarray]], marker: int) -> list[tuple[Fill, np.ndarray]]:
    """The filled stretches of a marker with their (L, 3) m: of the result in force, else those that will be."""
    if work.in_force and work.cleaned is not None:
        positions = work.cleaned.markers.positions
        own = [fill for fill in work.cleaned.fills if fill.marker == marker]
        return [(fill, positions[fill.first : fill.last + 1, marker]) for fill in own]
    return [(fill, values) for fill, values in pending if fill.marker == marker]


def curves_picture(
    work: Working,
    chosen: Collection[int],
    looks: Looks,
    *,
    pending: Sequence[tuple[Fill, np.ndarray]] = (),
    placed: np.ndarray | None = None,
    targets: Sequence[Gap] = (),
    previewed: Gap | None = None,
    previews: Sequence[Preview] = (),
    way: str = "",
) -> CurvePicture:
    """All that the plots show of some markers.

    Parameters
    ----------
    pending : fills that the next cleaning will make
    placed : (T, M, 3) m, where the fit has the markers; None without one
    targets : gaps that an edit would be made on
    previewed, previews : a gap, and what each way would fill it with
    way : the one that stands out
    """
    markers = work.measured
    everyone = sorted(chosen)
    drawn = everyone[:MOST]
    if not drawn:
        return CurvePicture(markers.time, note=NOTHING)
    inks = [_rgb(ink) for ink in palette.categorical(max(len(drawn), 1))]
    parts = {m: fills_of(work, pending, m) for m in drawn}
    names = tuple((markers.labels[m], ink) for m, ink in zip(drawn, inks))
    plots, kinds = [], set[str]()
    scale = 1.0 if looks.metres else 1000.0
    for quantity in (q for q in QUANTITIES if q in looks.quantities):
        lines: dict[int, list[Line]] = {c: [] for c in looks.components}
        for m, ink in zip(drawn, inks):
            fill = (previewed, previews, way)
            for kind, start, values, strong in _tracks(work, m, parts[m], placed, looks, quantity, *fill):
                for c in looks.components:
                    own = np.ascontiguousarray(scale * values[:, c])
                    lines[c].append(Line(kind, markers.labels[m], own, ink, start, strong))
                kinds.add(kind)
        unit = f"{'m' if looks.metres else 'mm'}{_UNITS[quantity]}"
        said = "" if quantity == "position" else f", {quantity}"
        plots += [CurvePlot(f"{'xyz'[c]}{said}", unit, _in_order(lines[c])) for c in looks.components]
    note = f"{len(drawn)} of {len(everyone)} selected markers are drawn." if len(everyone) > MOST else ""
    shades = tuple(s for m, ink in zip(drawn, inks) for s in _shades(work, m, ink, parts[m], targets))
    return CurvePicture(markers.time, tuple(plots), shades, names, note, frozenset(kinds))


_ORDER = ("raw", "body", "measured", "filled", "preview")


def _in_order(lines: list[Line]) -> tuple[Line, ...]:
    """What matters most is drawn last."""
    return tuple(sorted(lines, key=lambda line: (_ORDER.index(line.kind), line.strong)))


def _tracks(
    work: Working,
    m: int,
    parts: list[tuple[Fill, np.ndarray]],
    placed: np.ndarray | None,
    looks: Looks,
    quantity: str,
    previewed: Gap | None,
    previews: Sequence[Preview],
    way: str,
) -> list[Any]:
    """(kind, first frame, (n, 3), whether it stands out) of every curve of a marker."""
    rate, own = work.measured.rate, work.measured.positions[:, m]
    found: list[Any] = []
    if looks.raw and m < work.raw.positions.shape[1]:
        raw = work.raw.positions[:, m]
        other = _differs(raw, own)
        if other.any():
            found.append(("raw", 0, np.where(other[:, None], derivative(raw, rate, quantity), np.nan), False))
    if looks.body and placed is not None and m < placed.shape[1] and np.isfinite(placed[:, m]).any():
        found.append(("body", 0, derivative(placed[:, m], rate, quantity), False))
    found.append(("measured", 0, derivative(own, rate, quantity), False))
    if looks.filled and parts:
        whole, seen = own.copy(), np.zeros(len(own), dtype=bool)
        for fill, values in parts:
            whole[fill.first : fill.last + 1] = values
            seen[max(fill.first - 1, 0) : fill.last + 2] = True
        values = derivative(whole, rate, quantity).copy()
        values[~seen] = np.nan
        found.append(("filled", 0, values, False))
    if previewed is not None and previewed.marker == m:
        for one in previews:
            if one.values is not None:
                start, values = _about(own, previewed, one.values, rate, quantity)
                found.append(("preview", start, values, one.way == way))
    return found


def _differs(raw: np.ndarray, own: np.ndarray) -> np.ndarray:
    """(T,) True where the file's samples are not the cleaned ones, and a frame to either side, so that lines meet."""
    other = np.isfinite(raw).all(axis=1) & ~(raw == own).all(axis=1)
    wide = other.copy()
    wide[1:] |= other[:-1]
    wide[:-1] |= other[1:]
    return wide


def _about(own: np.ndarray, gap: Gap, values: np.ndarray, rate: float, quantity: str) -> tuple[int, np.ndarray]:
    """A filled gap and the frame on either side, so that it is seen whether it meets the ends."""
    start, stop = max(gap.first - 2, 0), min(gap.last + 3, len(own))
    part = own[start:stop].copy()
    part[gap.first - start : gap.last + 1 - start] = values
    part = derivative(part, rate, quantity)
    inner = max(gap.first - 1, 0)
    return inner, part[inner - start : gap.last + 2 - start]


def _shades(
    work: Working, m: int, ink: tuple[int, int, int], parts: list[tuple[Fill, np.ndarray]], targets: Sequence[Gap]
) -> list[Shade]:
    label = work.measured.labels[m]
    filled = {(fill.first, fill.last) for fill, _ in parts}
    found = [
        Shade(gap.first, gap.last, "filled" if (gap.first, gap.last) in filled else "gap", label, ink, gap in targets)
        for gap in work.of_marker.get(m, ())
    ]
    cut = [s for s in work.cut_stretches if s.marker == m]
    return [*found, *(Shade(s.first, s.last, "outlier", label, ink) for s in cut)]


def ways_of(previews: Sequence[Preview], titles: dict[str, str], helps: dict[str, str]) -> tuple[Way, ...]:
    """Every way to fill the gap, those that are known by their expected error first, then those that come."""
    known = {p.way: p for p in previews}
    order = sorted(titles, key=lambda way: (way not in known, known[way].error if way in known else 0.0))
    return tuple(
        Way(
            way,
            titles[way],
            _said(known[way].error) if way in known and known[way].values is not None else "",
            known[way].why_not if way in known else "",
            helps.get(way, ""),
        )
        for way in order
    )


def _said(error: float) -> str:
    return f"{1000 * error:.1f} mm" if np.isfinite(error) else "not known"


def fill_in(work: Working, pending: Sequence[tuple[Fill, np.ndarray]], gap: Gap) -> Fill | None:
    """What fills a gap, None where nothing does."""
    own = (fill for fill, _ in fills_of(work, pending, gap.marker))
    return next((fill for fill in own if fill.first <= gap.last and fill.last >= gap.first), None)


def heading_of(work: Working | None, chosen: Collection[int], targets: Sequence[Gap], done: Fill | None = None) -> str:
    """What an edit would be made on, in words; ``done`` is what fills the first target already."""
    if work is None:
        return "No marker file has been read yet."
    if not chosen:
        return "No marker is selected. N goes to the next gap and selects its marker."
    if not targets:
        count = sum(len(work.of_marker.get(m, ())) for m in chosen)
        gaps = f"{count} gap{'s' * (count != 1)}"
        if len(chosen) == 1:
            return f"Not in a gap. {work.edited.labels[min(chosen)]} has {gaps}: N and Shift+N go through them."
        return f"Not in a gap. The {len(chosen)} selected markers have {gaps}: N and Shift+N go through them."
    gap = targets[0]
    span = f"frame {gap.first}" if gap.length == 1 else f"frames {gap.first} to {gap.last}"
    seconds = gap.length / work.measured.rate
    said = f"{work.edited.labels[gap.marker]}, {span} ({seconds:.3g} s)"
    if done is not None:
        said += f", filled by {done.method}" if work.in_force else f", to be filled by {done.method}"
    more = len(targets) - 1
    return f"{said}, and {more} more gap{'s' * (more != 1)}, each filled by itself" if more else said


def proposal_rows(work: Working | None) -> tuple[ProposalRow, ...]:
    """Proposals by frame, then those that were rejected."""
    if work is None:
        return ()
    rows = [(p, "accepted" if work.accepted(p) else "proposed") for p in work.proposals]
    rows += [(p, "rejected") for p in work.rejected]
    return tuple(ProposalRow(p.sentence, f"{work.raw.time[p.frame]:.2f} s", state) for p, state in rows)


def _rgb(ink: np.ndarray) -> tuple[int, int, int]:
    return int(ink[0]), int(ink[1]), int(ink[2])
