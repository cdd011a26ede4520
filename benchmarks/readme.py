"""Put a benchmark's table into the README, between its marks: nothing there is typed by hand.

    python -m benchmarks.readme OUT [--marks NAME] [--readme FILE]

OUT is the folder of ``markerscope bench SUITE --out OUT``, or a file that holds what another benchmark printed. The
marks are ``<!-- bench:NAME begin -->`` and ``end``, where NAME is the suite's unless another is given.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from solver.errors import InputError
from solver.io.atomic import write_text_atomic

README = Path(__file__).parents[1] / "README.md"


def put(out: Path, readme: Path, marks: str | None = None) -> str:
    """Replace what is between the named marks, or those of OUT's suite; returns their name."""
    try:
        suite = marks or json.loads((out / "bench.json").read_text(encoding="utf-8"))["suite"]
        table = (out if out.is_file() else out / "bench.md").read_text(encoding="utf-8").strip()
    except (OSError, ValueError, KeyError) as error:
        raise InputError("holds no benchmark", out, "run markerscope bench SUITE --out there first") from error
    begin, end = (f"<!-- bench:{suite} {which} -->" for which in ("begin", "end"))
    text = readme.read_text(encoding="utf-8")
    head, found, rest = text.partition(begin)
    _, closed, tail = rest.partition(end)
    if not (found and closed):
        raise InputError(f"has no marks {suite}", readme, f"add the lines {begin} and {end}")
    write_text_atomic(readme, f"{head}{begin}\n{table}\n{end}{tail}")
    return str(suite)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--marks", metavar="NAME")
    parser.add_argument("--readme", type=Path, default=README)
    options = parser.parse_args()
    try:
        print(f"The table of {put(options.out, options.readme, options.marks)} is in {options.readme}.")
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
