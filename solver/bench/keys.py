"""What a run's result depends on, as a digest: the case, the movement, the method, and the code of both."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

from markerscope.solver.bench.execute import Run
from markerscope.solver.body.model import EMBEDDED
from markerscope.solver.pipeline.digest import canonical, digest_of, file_digest

VERSION = 1
"""To be raised when the same code and settings are measured otherwise."""
_GENERATOR = ("synth",)
_SOLVER = Path(__file__).parents[1]


def key_of(run: Run) -> str:
    """The run's key: 32 hexadecimal digits."""
    variant = run.variant
    gaps = getattr(run.case.settings, "gap_statistics", None)
    settings = canonical(run.case.settings) | ({"gap_statistics": file_digest(gaps)} if gaps else {})
    return digest_of(
        {
            "version": VERSION,
            "session": settings,
            "motion": run.motion.digest,
            "seed": run.seed,
            "method": run.method,
            "body": file_digest(EMBEDDED),
            "settings": {name: [type(own).__name__, canonical(own)] for name, own in variant.settings.items()},
            "code": code_digest((*variant.sources, *_GENERATOR)),
        }
    )


@cache
def code_digest(sources: tuple[str, ...]) -> str:
    """Digest of what the named files and folders below ``solver`` do: comments and docstrings do not count."""
    paths: set[Path] = set()
    for source in sources:
        place = _SOLVER / source
        paths |= set(place.rglob("*.py")) if place.is_dir() else set(_SOLVER.glob(source))
    return digest_of({path.relative_to(_SOLVER).as_posix(): _meaning(path) for path in sorted(paths)})


def _meaning(path: Path) -> str:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list):
            node.body = [line for line in body if not _is_text(line)]  # type: ignore[attr-defined]
    return ast.dump(tree)


def _is_text(line: ast.stmt) -> bool:
    return isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant) and isinstance(line.value.value, str)
