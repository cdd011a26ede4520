"""The report of a subject: its trials, what became of them, and the same angles over all."""

from __future__ import annotations

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import quote

import numpy as np

from markerscope.resources import resource
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.report.report import figure
from markerscope.solver.report.report_data import AngleCurve
from markerscope.solver.report.report_of import title_and_side
from markerscope.solver.report.report_svg import angle_plot


@dataclass(frozen=True)
class TrialRow:
    """One trial.

    Attributes
    ----------
    name, state : and in a word what became of it
    confidence : 0..1, NaN where there is no result
    residual_mm : median distance of its markers from their places
    frames : how many
    doubts : one sentence each
    angles : its angles.csv, None where there is no result
    """

    name: str
    state: str
    confidence: float
    residual_mm: float
    frames: int
    doubts: tuple[str, ...]
    angles: Path | None


@dataclass(frozen=True)
class SubjectReport:
    """What the report shows: the person, the trials, what angles are counted from, how the body was found."""

    name: str
    trials: tuple[TrialRow, ...]
    zero: str
    body: tuple[str, ...] = ()


@dataclass(frozen=True)
class AngleRow:
    """One angle in all trials: (name of the trial, its plot, range in words)."""

    title: str
    plots: tuple[tuple[str, str, str], ...]


def write_subject_report(path: Path, data: SubjectReport) -> None:
    """Write the page.

    Raises
    ------
    InputError : the file system refuses
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(resource("report")),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure"] = figure
    environment.filters["link"] = quote
    rows = angle_rows({row.name: curves_of(row.angles) for row in data.trials if row.angles is not None})
    shown = [(row.title, [(name, Markup(plot), said) for name, plot, said in row.plots]) for row in rows]
    write_text_atomic(path, environment.get_template("subject.html.j2").render(data=data, angles=shown, nan=math.nan))


def curves_of(table: Path) -> dict[str, AngleCurve]:
    """The angles of a trial by title, left and right together, as ``angles.csv`` has them."""
    with open(table, newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    names, values = tuple(rows[0][1:]), np.array([[float(cell or "nan") for cell in row] for row in rows[1:]])
    sides: dict[str, dict[str, np.ndarray]] = {}
    for i, name in enumerate(names):
        title, side = title_and_side(name, names)
        sides.setdefault(title, {})[side] = values[:, i + 1]
    return {title: AngleCurve(title, "degrees", values[:, 0], own) for title, own in sides.items()}


def angle_rows(trials: dict[str, dict[str, AngleCurve]]) -> list[AngleRow]:
    """Each angle in every trial, all on one scale."""
    rows = []
    for title in dict.fromkeys(title for curves in trials.values() for title in curves):
        own = {name: curves[title] for name, curves in trials.items() if title in curves}
        values = np.concatenate([v[np.isfinite(v)] for curve in own.values() for v in curve.sides.values()])
        if not len(values):
            continue
        limits = float(values.min()), float(values.max())
        rows.append(
            AngleRow(title, tuple((name, angle_plot(curve, limits), _range(curve)) for name, curve in own.items()))
        )
    return rows


def _range(curve: AngleCurve) -> str:
    """What an angle goes through, in words: ``left 3 to 61, right 2 to 64``."""
    said = []
    for side, values in curve.sides.items():
        known = values[np.isfinite(values)]
        if len(known):
            said.append(f"{side} {known.min():.0f} to {known.max():.0f}".strip())
    return ", ".join(said)
