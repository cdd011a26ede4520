"""Small drawings for the report: SVG text that follows the page's colours, and pixel images as PNG data."""

from __future__ import annotations

import base64
import struct
import zlib
from collections.abc import Sequence
from html import escape

import numpy as np

from markerscope.solver.report.report_data import AngleCurve, Gaps, Groups

_JUMP_DEG = 120.0
"""A larger step between two frames is one of the reading, which came in again at the other end of its range."""
_MOST_BUCKETS = 320
_BAND_POINTS = 200
_TEAL, _SLATE, _AMBER = (15, 138, 138), (120, 134, 150), (214, 98, 43)


def png(rgba: np.ndarray) -> str:
    """A data address of an image (H, W, 4) uint8."""
    height, width = rgba.shape[:2]
    rows = b"".join(b"\0" + rgba[y].tobytes() for y in range(height))

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    data = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")
    return "data:image/png;base64," + base64.b64encode(data).decode("ascii")


def nice_ticks(low: float, high: float, about: int) -> np.ndarray:
    """Round numbers between ``low`` and ``high``, some ``about`` of them."""
    span = max(high - low, 1e-9)
    raw = span / about
    base = 10.0 ** np.floor(np.log10(raw))
    step = base * next(s for s in (1, 2, 5, 10) if s * base >= raw * 0.999)
    return np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1) * step + 0.0  # no "-0"


def affinity_colours(values: np.ndarray, cut: float, cap: float) -> np.ndarray:
    """(..., 4) uint8: teal where a pair moves rigidly (up to ``cut``), slate fading out towards ``cap``.

    Transparency does the fading, so that the image suits a light and a dark page.
    """
    inside = np.clip(values / max(cut, 1e-12), 0, 1)
    beyond = np.clip((values - cut) / max(cap - cut, 1e-12), 0, 1)
    rigid = values <= cut
    colour = np.where(rigid[..., None], _TEAL, _SLATE)
    alpha = np.where(rigid, 1 - 0.4 * inside, 0.5 * (1 - beyond) ** 1.5 + 0.03)
    rgba = np.concatenate([colour, (255 * np.where(np.isfinite(values), alpha, 0))[..., None]], axis=-1)
    return rgba.round().astype(np.uint8)


def affinity_plot(groups: Groups) -> str:
    """Dendrogram, groups and affinity matrix in one drawing, columns aligned; 12 px a marker."""
    count = len(groups.order)
    cell, tree_height, strip, left, right = (12 if count <= 60 else 9), 120, 8, 44, 130
    top, size = tree_height + strip + 8, cell * count
    cap = affinity_cap(groups)
    matrix = groups.affinity[np.ix_(groups.order, groups.order)]
    width, height = left + size + right, top + size + 4
    parts = [
        f'<svg class="fixed" width="{width}" height="{height}" viewBox="0 0 {width} {height}" role="img" '
        f'aria-label="Affinity of {count} markers, ordered by the tree drawn above it">',
        _dendrogram(groups, cell, tree_height, left, cap),
    ]
    for i, marker in enumerate(groups.order):
        shade = "none" if groups.clusters[marker] < 0 else f"var(--group{groups.clusters[marker] % 2})"
        parts.append(
            f'<rect x="{left + i * cell}" y="{tree_height + 4}" width="{cell}" height="{strip}" fill="{shade}"/>'
        )
    parts.append(
        f'<image x="{left}" y="{top}" width="{size}" height="{size}" preserveAspectRatio="none" '
        f'href="{png(affinity_colours(matrix, groups.cut, cap))}"/>'
    )
    parts.append(f'<rect class="frame" x="{left}" y="{top}" width="{size}" height="{size}"/>')
    for i, marker in enumerate(groups.order):
        y = top + (i + 0.5) * cell
        parts.append(f'<text class="tiny" x="{left + size + 5}" y="{y + 3:.1f}">{escape(groups.labels[marker])}</text>')
    along = groups.clusters[groups.order]
    for change in np.flatnonzero(np.diff(along)) + 1:
        parts.append(
            f'<path class="rule" d="M{left + change * cell} {top}v{size}M{left} {top + change * cell}h{size}"/>'
        )
    return "".join([*parts, "</svg>"])


def affinity_cap(groups: Groups) -> float:
    """m, the affinity from which on the drawing no longer tells pairs apart."""
    return max(6 * groups.cut, 1e-3)


def _dendrogram(groups: Groups, cell: float, height: float, left: float, cap: float) -> str:
    """The tree, its heights on a root scale so that the joins below the cut can be seen."""
    count = len(groups.order)
    top = max(float(groups.linkage[-1, 2]) if len(groups.linkage) else cap, groups.cut * 1.5)
    column = {int(leaf): i for i, leaf in enumerate(np.searchsorted(groups.leaves, groups.order))}

    def y(value: float) -> float:
        return height * (1 - np.sqrt(max(value, 0) / top)) + 2

    place = {leaf: (left + (column[leaf] + 0.5) * cell, y(0.0)) for leaf in range(count)}
    lines: dict[str, list[str]] = {"tree": [], "tree loose": []}
    for row, (a, b, value, _) in enumerate(groups.linkage):
        (xa, ya), (xb, yb), yy = place[int(a)], place[int(b)], y(value)
        lines["tree" if value <= groups.cut else "tree loose"].append(f"M{xa:.1f} {ya:.1f}V{yy:.1f}H{xb:.1f}V{yb:.1f}")
        place[count + row] = ((xa + xb) / 2, yy)
    parts = [f'<path class="{kind}" d="{"".join(paths)}"/>' for kind, paths in lines.items() if paths]
    cut, end = y(groups.cut), left + count * cell
    parts.append(f'<path class="cut" d="M{left} {cut:.1f}H{end}"/>')
    parts.append(f'<text class="tiny" x="{end + 5}" y="{cut + 3:.1f}">cut at {groups.cut * 1000:.3g} mm</text>')
    ticks = [t for t in (0.0, 0.02, 0.1, 0.3) if t <= top and abs(y(t) - cut) > 8]
    for tick in ticks:
        parts.append(f'<text class="tiny end" x="{left - 5}" y="{y(tick) + 3:.1f}">{tick * 1000:g} mm</text>')
    return "".join(parts)


def affinity_legend(groups: Groups) -> str:
    """A bar of the colours used, from 0 to the cap."""
    cap = affinity_cap(groups)
    bar = affinity_colours(np.linspace(0, cap, 120)[None], groups.cut, cap)
    return f'<img class="legend" alt="" src="{png(bar)}">'


def angle_plot(curve: AngleCurve, limits: tuple[float, float] | None = None) -> str:
    """One angle over time; a gap where it is unknown, a grey band where it must not be read.

    Two standard errors each way are a band in the colour of the side; what was not measured is pale and dashed.

    Parameters
    ----------
    limits : of the vertical axis, where several plots share one; None fits the curve
    """
    width, height, left, bottom, top, right = 360, 170, 38, 22, 8, 8
    known = [v[np.isfinite(v)] for v in curve.sides.values()]
    values = np.concatenate(known) if known else np.zeros(0)
    if not len(values):
        return '<p class="quiet">No frame of this angle is known.</p>'
    low, high = float(values.min()), float(values.max())
    bands = {side: (line - 2 * curve.errors[side], line + 2 * curve.errors[side])
             for side, line in curve.sides.items() if side in curve.errors}  # fmt: skip
    for side, (under, over) in bands.items():
        if side in curve.unmeasured or not np.isfinite(under).any():
            continue  # else what is hardly known would flatten what is measured
        low, high = min(low, float(np.nanmin(under))), max(high, float(np.nanmax(over)))
    low, high = limits or (low, high)
    pad = max(0.06 * (high - low), 1.0)
    low, high = low - pad, high + pad
    start, end = float(curve.time[0]), float(max(curve.time[-1], curve.time[0] + 1e-6))

    def x(t: np.ndarray) -> np.ndarray:
        return left + (np.asarray(t) - start) / (end - start) * (width - left - right)

    def y(v: np.ndarray) -> np.ndarray:
        return top + (high - np.asarray(v)) / (high - low) * (height - top - bottom)

    label = escape(f"{curve.title}, {curve.unit}, {low:.0f} to {high:.0f}")
    parts = [f'<svg class="scaled" viewBox="0 0 {width} {height}" role="img" aria-label="{label}">']
    for tick in nice_ticks(low, high, 4):
        yy = float(y(tick))
        parts.append(f'<path class="grid{" zero" if abs(tick) < 1e-9 else ""}" d="M{left} {yy:.1f}H{width - right}"/>')
        parts.append(f'<text class="tick end" x="{left - 5}" y="{yy + 3.5:.1f}">{tick:g}</text>')
    for tick in nice_ticks(start, end, 6):
        parts.append(f'<text class="tick middle" x="{float(x(tick)):.1f}" y="{height - 6}">{tick:g}</text>')
    parts.append(f'<text class="tick end" x="{width - right}" y="{height - 6}">s</text>')
    if curve.singular is not None:
        for a, b in _runs(curve.singular):
            xa, wide = float(x(curve.time[a])), float(x(curve.time[b]) - x(curve.time[a]))
            size = f'width="{max(wide, 1.5):.1f}" height="{height - top - bottom}"'
            parts.append(f'<rect class="band" x="{xa:.1f}" y="{top}" {size}/>')
    for side, (under, over) in bands.items():
        kind = f"spread {side or 'both'}{' unmeasured' if side in curve.unmeasured else ''}"
        for a, b in _runs(np.isfinite(under)):
            at = np.unique(np.linspace(a, b, min(b - a + 1, _BAND_POINTS)).astype(int))
            xs, edges = x(curve.time[at]), [np.clip(y(v[at]), top, height - bottom) for v in (over, under)]
            outline = [*zip(xs, edges[0]), *zip(xs[::-1], edges[1][::-1])]
            parts.append(f'<path class="{kind}" d="M{"L".join(f"{u:.1f} {v:.1f}" for u, v in outline)}Z"/>')
    for side, line in curve.sides.items():
        keep = _thinned(line)
        path = _path(x(curve.time[keep]), y(line[keep]), np.abs(np.diff(line[keep])) > _JUMP_DEG)
        pale = " unmeasured" if side in curve.unmeasured else ""
        parts.append(f'<path class="line {side or "both"}{pale}" d="{path}"/>')
    return "".join([*parts, "</svg>"])


def gaps_plot(gaps: Gaps) -> str:
    """A row per marker, time to the right: faint where measured, teal where filled, amber where lost."""
    frames, count = gaps.present.shape
    buckets = min(frames, 700)
    edges = np.linspace(0, frames, buckets + 1).astype(int)[:-1]
    size = np.diff(np.append(edges, frames))[:, None]
    lost = np.add.reduceat(~gaps.present & ~gaps.filled, edges, axis=0) / size
    filled = np.add.reduceat(gaps.filled, edges, axis=0) / size
    colour = np.where((lost > 0)[..., None], _AMBER, np.where((filled > 0)[..., None], _TEAL, _SLATE))
    alpha = np.where(lost > 0, 0.45 + 0.55 * lost, np.where(filled > 0, 0.45 + 0.55 * filled, 0.14))
    rgba = np.concatenate([colour, 255 * alpha[..., None]], axis=-1).transpose(1, 0, 2).round().astype(np.uint8)
    row, left, width, bottom = 11, 130, 700, 22
    height = row * count
    start, end = float(gaps.time[0]), float(max(gaps.time[-1], gaps.time[0] + 1e-6))
    parts = [
        f'<svg class="fixed" width="{left + width + 10}" height="{height + bottom}" '
        f'viewBox="0 0 {left + width + 10} {height + bottom}" role="img" aria-label="When each marker was seen">',
        f'<image x="{left}" y="0" width="{width}" height="{height}" preserveAspectRatio="none" href="{png(rgba)}"/>',
    ]
    for m, name in enumerate(gaps.labels):
        parts.append(f'<text class="tiny end" x="{left - 6}" y="{(m + 0.5) * row + 3:.1f}">{escape(name)}</text>')
    for tick in nice_ticks(start, end, 10):
        xx = left + (tick - start) / (end - start) * width
        parts.append(f'<path class="grid" d="M{xx:.1f} {height}v4"/>')
        parts.append(f'<text class="tick middle" x="{xx:.1f}" y="{height + 16}">{tick:g} s</text>')
    return "".join([*parts, "</svg>"])


def _path(x: np.ndarray, y: np.ndarray, jumps: np.ndarray) -> str:
    """Path data with a break wherever a value is missing, or jumps (N - 1,) from the one before."""
    pieces, drawing = [], False
    for a, b, jumped in zip(x, y, [False, *jumps]):
        drawing = drawing and not jumped
        if not np.isfinite(b):
            drawing = False
            continue
        pieces.append(f"{'L' if drawing else 'M'}{a:.1f} {b:.1f}")
        drawing = True
    return "".join(pieces)


def _thinned(line: np.ndarray) -> np.ndarray:
    """Frames that keep every peak when drawn: the least and the greatest of each bucket, and where gaps begin."""
    if len(line) <= 2 * _MOST_BUCKETS:
        return np.arange(len(line))
    keep = []
    for bucket in np.array_split(np.arange(len(line)), _MOST_BUCKETS):
        values = line[bucket]
        finite = np.isfinite(values)
        if finite.any():
            keep += [bucket[np.nanargmin(values)], bucket[np.nanargmax(values)]]
        if not finite.all():
            keep.append(bucket[np.flatnonzero(~finite)[0]])
    return np.unique(keep)


def _runs(flags: np.ndarray) -> Sequence[tuple[int, int]]:
    """First and last index of every run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(int), [0]])))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2])]
