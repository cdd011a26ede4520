"""Put a benchmark's table where it is shown, between its marks: nothing there is typed by hand.

    python -m benchmarks.insert OUT [--marks NAME] [--page FILE]

OUT is the folder of ``markerscope bench SUITE --out OUT``, or a file that holds what another benchmark printed. The
marks are ``<!-- bench:NAME begin -->`` and ``end``, where NAME is the suite's unless another is given; the page is the
one of the README and ``docs/benchmarks`` that has them.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.atomic import write_text_atomic

ROOT = Path(__file__).parents[1]
PAGES = (ROOT / "README.md", *sorted((ROOT / "docs" / "benchmarks").glob("*.md")))


def put(out: Path, pages: Sequence[Path], marks: str | None = None) -> tuple[str, Path]:
    """Replace what is between the named marks, or those of OUT's suite; returns their name and the page."""
    try:
        suite = marks or json.loads((out / "bench.json").read_text(encoding="utf-8"))["suite"]
        table = (out if out.is_file() else out / "bench.md").read_text(encoding="utf-8").strip()
    except (OSError, ValueError, KeyError) as error:
        raise InputError("holds no benchmark", out, "run markerscope bench SUITE --out there first") from error
    begin, end = (f"<!-- bench:{suite} {which} -->" for which in ("begin", "end"))
    for page in pages:
        head, found, rest = page.read_text(encoding="utf-8").partition(begin)
        _, closed, tail = rest.partition(end)
        if found and closed:
            write_text_atomic(page, f"{head}{begin}\n{table}\n{end}{tail}")
            return str(suite), page
    raise InputError(f"no page has marks {suite}", pages[0], f"add the lines {begin} and {end} to one")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--marks", metavar="NAME")
    parser.add_argument("--page", type=Path, help="instead of the README and docs/benchmarks")
    options = parser.parse_args()
    try:
        marks, page = put(options.out, [options.page] if options.page else PAGES, options.marks)
        print(f"The table of {marks} is in {page}.")
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
