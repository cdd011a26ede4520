"""Gaps filled and outliers found on real recordings, with gaps and jumps made on purpose.

    python -m benchmarks.clean DATA [--seeds 3] [--out DIR]

DATA holds ``fullbody`` (recordings) and ``gaps`` (statistics of real gaps). Prints Markdown tables.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from markerscope.solver.bench.clean import run_clean_bench


def main() -> None:
    """Run and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    gaps = options.data / "gaps" / "gap_production.npz"
    print(run_clean_bench(options.data / "fullbody", gaps, options.out, options.seeds).markdown())


if __name__ == "__main__":
    main()
