"""The manual says what there is: links lead somewhere, settings, files and arrays have the names they have."""

from __future__ import annotations

import dataclasses
import re
from pathlib import Path

import pytest

from markerscope.solver.body.bones import MODES
from markerscope.solver.fit.labelled.anchored import Anchors
from markerscope.solver.fit.pull.term import Pull
from markerscope.solver.fit.terms.height import Height
from markerscope.solver.fit.terms.image import ImageLandmarks
from markerscope.solver.fit.terms.markers import Markers
from markerscope.solver.fit.terms.posture import Posture
from markerscope.solver.fit.terms.shape import Shape
from markerscope.solver.fit.terms.video_pose import VideoPose
from markerscope.solver.pipeline.stages import GRAPH, SOURCES
from markerscope.solver.report.outputs import FILES, SOMETIMES

DOCS = Path(__file__).parents[1] / "docs"
PAGES = sorted(DOCS.glob("*.md"))
TABLES = sorted((DOCS / "benchmarks").glob("*.md"))


def anchors(page: Path) -> set[str]:
    """What a heading can be linked by."""
    titles = re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


@pytest.mark.parametrize("page", [*PAGES, *TABLES, DOCS.parent / "README.md"], ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\((?!https?:)([^)]+)\)", page.read_text(encoding="utf-8")):
        path, _, anchor = target.partition("#")
        place = page if not path else page.parent / path
        assert place.exists(), f"{page.name} links to {target}"
        assert not anchor or anchor in anchors(place), f"{page.name} links to {target}"


def test_every_page_can_be_found_from_the_first() -> None:
    first = (DOCS / "index.md").read_text(encoding="utf-8")
    assert {page.name for page in PAGES} == {"index.md"} | set(re.findall(r"\]\((\w[\w-]*\.md)\)", first))


def test_every_table_can_be_found_from_the_first() -> None:
    first = (DOCS / "benchmarks" / "index.md").read_text(encoding="utf-8")
    assert {page.name for page in TABLES} == {"index.md"} | set(re.findall(r"\]\((\w[\w-]*\.md)\)", first))


def said(default: object) -> str | None:
    """A default as the manual writes it."""
    if default is None or isinstance(default, str):
        return default
    return str(default).lower() if isinstance(default, bool) else f"{default:g}"


def test_every_setting_is_described_with_its_default() -> None:
    chapter = (DOCS / "sessions.md").read_text(encoding="utf-8").split("## Settings")[1].split("## Deciding by hand")
    settings, by_hand = chapter
    rows = re.findall(r"^\|([^|]*)\|([^|]*)\|", settings, re.M)
    told: dict[str, dict[str, str | None]] = {}
    stage = ""
    for first, second in rows:
        stage = first.strip().strip("`") or stage
        found = re.findall(r"`(\w+)`(?: \(`?([\w.]+)`?\))?", second)
        told.setdefault(stage, {}).update({name: default or None for name, default in found})
    for step in GRAPH:
        for field in dataclasses.fields(step.settings):
            edit = step.name in ("segment", "clean", "fit") and isinstance(field.default, tuple)
            if edit or (step.name, field.name) == ("fit", "candidate"):
                assert f"`{field.name} = " in by_hand, f"{step.name}.{field.name}"
                continue
            assert field.name in told[step.name], f"{step.name}.{field.name}"
            default = told[step.name][field.name]
            assert default == said(field.default), f"{step.name}.{field.name} is {field.default}, not {default}"
    for name in SOURCES:
        assert f"`{name}`" in (DOCS / "sessions.md").read_text(encoding="utf-8")


def test_every_stage_and_kind_of_evidence_is_described() -> None:
    text = (DOCS / "how-it-works.md").read_text(encoding="utf-8")
    kinds = (Markers, ImageLandmarks, VideoPose, Posture, Shape, Height, Pull, Anchors)
    for name in [stage.name for stage in GRAPH] + [kind.name for kind in kinds]:
        assert f"| `{name}` |" in text, name


def test_every_file_is_described() -> None:
    text = (DOCS / "solve.md").read_text(encoding="utf-8")
    for name in (*FILES, *SOMETIMES):
        assert f"`{name}`" in text, name
    assert f"({len(MODES)},)" in text
