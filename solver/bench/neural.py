"""Networks that solve motion, trained here and examined on bodies, layouts and movements that they have not seen."""

from __future__ import annotations

import datetime
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.bench.machine import machine
from markerscope.solver.bench.neural_exam import Recording, examined, recordings
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.bench.runner import write_tables
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.progress import Progress, part_of, silent
from markerscope.solver.core.request import Outcome
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.neural.training.library import KINDS, Clip, by_kind, load_library
from markerscope.solver.pipeline.digest import digest_of, file_digest

MINUTES = 8.0
"""Of training of each network, where nothing else is said."""
TUNING_MINUTES = 1.0
UNSEEN = ("bow", "dance-short", "kick", "slash")
"""Kinds of action held out, where a library has them."""
_MADE = 120
_BODIES = 24
_LEARNT = 0.85  # of each clip; the rest is what is examined of the kinds that are seen
VERSION = 2
"""To be raised where the networks, their training or the examination change: earlier records are not taken up then."""


@dataclass(frozen=True, eq=False)
class Ground:
    """What every row is trained and examined on.

    Attributes
    ----------
    body : whose vertices the layouts mean
    learnt, seen, unseen : clips to learn from, other parts of clips of the same kinds, and clips of kinds held out
    seed : of everything
    folder : for checkpoints and other intermediate results
    """

    body: Body
    learnt: tuple[Clip, ...]
    seen: tuple[Clip, ...]
    unseen: tuple[Clip, ...]
    seed: int
    folder: Path


@dataclass(frozen=True)
class Row:
    """One network.

    Attributes
    ----------
    network, markers : what, and on which layout
    seen_joe_deg, seen_jpe_cm, unseen_joe_deg, unseen_jpe_cm : on kinds of action that it has seen, and has not
    ompe_cm, start_cm : of a network that fills: of it, and of what it begins from, on the kinds that it has seen
    minutes, steps : of its training here
    frames_per_s : of processor time
    """

    network: str
    markers: str
    seen_joe_deg: float | None = None
    seen_jpe_cm: float | None = None
    unseen_joe_deg: float | None = None
    unseen_jpe_cm: float | None = None
    ompe_cm: float | None = None
    start_cm: float | None = None
    minutes: float = 0.0
    steps: int = 0
    frames_per_s: float | None = None


@dataclass(frozen=True)
class Entry:
    """A row that can be asked for.

    Attributes
    ----------
    name : on the command line
    about : in the table
    run : ``(ground, minutes, name, progress) -> rows``
    """

    name: str
    about: str
    run: Callable[[Ground, float, str, Progress], list[Row]]


def neural_suite(request: BenchRequest, progress: Progress = silent) -> Outcome:
    """What ``markerscope bench neural`` does; networks that were examined before are not trained again.

    Raises
    ------
    InputError : a folder or a row that there is not, or torch is not installed
    """
    from markerscope.solver.bench.neural_rows import ENTRIES
    from markerscope.solver.neural.layout_free.agnostic_solve import SHIPPED, require_torch

    require_torch()
    entries = [entry for entry in ENTRIES if not request.cases or entry.name in request.cases]
    for name in request.cases:
        if name not in {entry.name for entry in ENTRIES}:
            known = ", ".join(entry.name for entry in ENTRIES)
            raise InputError(f'suite neural has no row "{name}"', "--cases", f"use some of: {known}")
    minutes = MINUTES if request.minutes is None else request.minutes
    folder = make_folder(request.out / "runs")
    ground = ground_of(request, folder)
    rows: list[Row] = []
    shipped = file_digest(SHIPPED)
    for i, entry in enumerate(entries):
        key = digest_of([VERSION, entry.name, minutes, shipped, _digest(ground)])
        path = folder / f"{key}.json"
        try:
            found = [Row(**row) for row in json.loads(path.read_text(encoding="utf-8"))]
        except (OSError, ValueError, TypeError):
            part = part_of(progress, i / len(entries), (i + 1) / len(entries))
            found = entry.run(replace(ground, folder=folder), minutes, key, part)
            write_text_atomic(path, json.dumps([asdict(row) for row in found]) + "\n")
        rows += found
        _write(request, ground, minutes, rows)
    progress(1.0, "done")
    summary, text = _write(request, ground, minutes, rows)
    return Outcome(summary=summary, lines=(*text.splitlines(), f"Tables are in {request.out}."))


def ground_of(request: BenchRequest, folder: Path) -> Ground:
    """Clips split into what is learnt from and what is examined on."""
    from markerscope.solver.neural.training.library import motions_of

    if request.motions is not None and not request.motions.is_dir():
        raise InputError("there is no such folder", request.motions, "name a folder of BVH or AMC files")
    recorded = load_library([request.motions]) if request.motions else ()
    seed = request.seeds - 1
    known, unseen = by_kind(recorded, held_out(recorded))
    made = motions_of((), _MADE, seed)
    if not unseen:  # no recordings: gaits and the like are learnt, wandering through random poses is not
        made, unseen = by_kind(made, ("free",))
        unseen = unseen[:12]
    learnt = (*made, *(replace(clip.part(0, _LEARNT), kind=clip.name) for clip in known))
    seen = tuple(clip.part(_LEARNT, 1) for clip in (known or made))
    return Ground(Body.load(), learnt, seen, unseen, seed, folder)


def held_out(clips: Sequence[Clip]) -> tuple[str, ...]:
    """Kinds that nobody learns from; never those that the shipped network has learnt from."""
    kinds = sorted({clip.kind for clip in clips} - set(KINDS.values()) - {"walk", "run"})
    named = tuple(kind for kind in UNSEEN if kind in kinds)
    return named or tuple(kinds[::3])


def exams(ground: Ground, layout: Any) -> tuple[list[Recording], list[Recording]]:
    """Recordings of seen and of unseen kinds, of bodies that nobody learns from."""
    first = 5000 + 100 * ground.seed
    return (
        recordings(ground.body, layout, ground.seen, _BODIES, first),
        recordings(ground.body, layout, ground.unseen, _BODIES, first + 50),
    )


def scored(row: Row, answer: Any, both: tuple[list[Recording], list[Recording]]) -> Row:
    """The row with what an answer is worth."""
    seen, unseen = (examined(answer, exam) for exam in both)
    return replace(
        row,
        seen_joe_deg=seen.joe_deg,
        seen_jpe_cm=seen.jpe_cm,
        unseen_joe_deg=unseen.joe_deg,
        unseen_jpe_cm=unseen.jpe_cm,
        frames_per_s=seen.frames_per_s,
    )


def _digest(ground: Ground) -> list[object]:
    parts = [
        [clip.name, len(clip.trans), float(np.abs(clip.rotations).sum())] for clip in (*ground.learnt, *ground.unseen)
    ]
    return [parts, ground.seed, _MADE, _BODIES]


def _write(request: BenchRequest, ground: Ground, minutes: float, rows: Sequence[Row]) -> tuple[dict[str, Any], str]:
    on = machine()
    header = {
        "suite": "neural",
        "command": request.command,
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "version": __version__,
        "machine": on,
        "minutes": minutes,
        "seen": sorted({clip.kind for clip in ground.seen}),
        "unseen": sorted({clip.kind for clip in ground.unseen}),
        "bodies": _BODIES,
    }
    text = _said(header) + table_of(rows)
    summary = {**header, "rows": [asdict(row) for row in rows]}
    write_tables(request.out, {"bench.md": text, "bench.json": json_text(summary) + "\n"})
    return {**summary, "out": str(request.out)}, text


def _said(header: dict[str, Any]) -> str:
    on = header["machine"]
    return (
        f"`{header['command']}`\n\n"
        f"{header['date']}, Markerscope {header['version']}, {on['processor']}, {on['cores']} cores, {on['system']}, "
        f"Python {on['python']}; training on one thread, dense layers of 384, 96 examples a step. Where other work ran "
        "beside it a minute held few steps: compare by steps.\n\n"
        f"Synthetic: {header['bodies']} bodies outside of the shape basis that no network has seen, a second of each, "
        f"nothing lost. Kinds of action seen: other parts of {', '.join(header['seen'])}; unseen: "
        f"{', '.join(header['unseen'])}. The agnostic network is told where the markers and the joints are on the "
        "body, to 2 mm along each axis; the others are told nothing of the person. As it ships it has learnt from made "
        "motions and from the first nine tenths of recordings of CMU's subject 02, from no others. The published "
        "figures are on other data and cannot be compared.\n\n"
    )


def table_of(rows: Sequence[Row]) -> str:
    """In Markdown."""
    head = (
        "network",
        "markers",
        "JOE seen deg",
        "JPE seen cm",
        "JOE unseen deg",
        "JPE unseen cm",
        "OMPE cm (before)",
        "trained min",
        "steps",
        "frames/s",
    )
    lines = [f"| {' | '.join(head)} |", f"|{' --- |' * len(head)}"]
    for row in rows:
        ompe = "–" if row.ompe_cm is None else f"{row.ompe_cm:.2f} ({row.start_cm:.2f})"
        cells = (
            row.network,
            row.markers,
            _number(row.seen_joe_deg, 1),
            _number(row.seen_jpe_cm, 2),
            _number(row.unseen_joe_deg, 1),
            _number(row.unseen_jpe_cm, 2),
            ompe,
            f"{row.minutes:.1f}",
            str(row.steps) if row.steps else "–",
            _number(row.frames_per_s, 0),
        )
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def _number(value: float | None, digits: int) -> str:
    return "–" if value is None else f"{value:.{digits}f}"
