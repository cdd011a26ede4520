"""How to cite is said once, and the publications' authors are theirs."""

from __future__ import annotations

import re
from pathlib import Path

from markerscope.solver import __version__

ROOT = Path(__file__).parents[1]


def test_the_citation_is_of_this_version() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.search(rf"^version: {re.escape(__version__)}$", text, re.M)
    assert "name: The Markerscope developers" in text


def test_pages_name_the_authors_that_the_citation_names() -> None:
    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    families = [re.findall(r"family-names: (\w+)", part) for part in text.split("  - type: conference-paper")[1:]]
    assert [len(names) for names in families] == [3, 11]
    page = " ".join((ROOT / "docs" / "cleaning.md").read_text(encoding="utf-8").split())
    *most, last = families[1]
    assert f"({', '.join(most)} and {last} 2023)" in page
