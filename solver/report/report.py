"""The report of a solve: one HTML file that needs nothing else, for the screen and for paper."""

from __future__ import annotations

import base64
import math
from pathlib import Path

from markerscope.resources import resource
from markerscope.solver.fit.counting import candidate_number
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.report.headlines import TIE
from markerscope.solver.report.report_data import ReportData
from markerscope.solver.report.report_svg import affinity_cap, affinity_legend, affinity_plot, angle_plot, gaps_plot


def write_report(path: str | Path, data: ReportData) -> None:
    """Write ``data`` as a self-contained HTML page.

    Raises
    ------
    InputError
        Where the file cannot be written; nothing is left behind then.
    """
    write_text_atomic(path, render(data))


def render(data: ReportData) -> str:
    """The page as text. Whatever comes from a file is escaped, and the page forbids scripts and outside resources."""
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
    terms = list(dict.fromkeys(name for h in data.hypotheses for name in h.energies))
    return environment.get_template("report.html.j2").render(
        data=data,
        pictures=[(p.caption, base64.b64encode(p.png).decode("ascii")) for p in data.pictures],
        terms=terms,
        number=candidate_number,
        best=min((h.energy for h in data.hypotheses if h.refined), default=math.nan),
        margin=_margin(data.margin) if data.hypotheses else "",
        affinity=Markup(affinity_plot(data.groups)) if data.groups and len(data.groups.order) else "",
        legend=Markup(affinity_legend(data.groups)) if data.groups else "",
        cap_mm=affinity_cap(data.groups) * 1000 if data.groups else 0,
        angles=[(curve, Markup(angle_plot(curve))) for curve in data.angles],
        gait=Markup(data.gait),
        has_errors=any(curve.errors for curve in data.angles),
        has_unmeasured=any(curve.unmeasured for curve in data.angles),
        gaps=Markup(gaps_plot(data.gaps)) if data.gaps is not None and data.gaps.present.size else "",
        drawn=any(r.landmark for r in data.residuals),
        worst=max((r.mean_mm for r in data.residuals if math.isfinite(r.mean_mm)), default=1.0),
    )


def figure(value: float, digits: int = 1) -> str:
    """A number for a table; a dash where there is none."""
    return f"{value:,.{digits}f}".replace(",", "\u202f") if math.isfinite(value) else "\u2013"


def _margin(margin: float) -> str:
    """The distance to the runner-up in words."""
    if not math.isfinite(margin):
        return "No different answer was found to compare with."
    excess = (margin - 1) * 100
    if margin < TIE:
        return f"The best different answer costs only {excess:.0f} % more: the two are close to a tie."
    if margin < 2:
        return f"The best different answer costs {excess:.0f} % more."
    return f"The best different answer costs {margin:.1f} times as much."
