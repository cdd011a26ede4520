"""What the user should know or doubt about a solve, one sentence each."""

from __future__ import annotations

import numpy as np

from solver.pipeline.cleaning import notes_of
from solver.pipeline.stage import GraphRun

_BAD_FIT_M = 0.03
"""A right answer leaves markers within a few millimetres of their places; beyond this it is no longer a body."""


def assumptions(graph: GraphRun) -> tuple[str, ...]:
    """What was assumed while the files were read."""
    return (*graph["markers"].notes, *notes_of(graph["clean"]), *graph["prior"].notes, *graph["neutral"].notes)


def doubts(graph: GraphRun) -> tuple[str, ...]:
    """What speaks against the result."""
    motion = graph["fit"]
    residual = float(np.nanmedian(motion.residual))
    misfit: tuple[str, ...] = ()
    if not residual < _BAD_FIT_M:
        misfit = (
            f"The markers are {1000 * residual:.0f} mm from where the body puts them (median): this is no fit to "
            "rely on; check units, vertical axis, and that markers and video are of the same movement.",
        )
    return (*misfit, *graph["sync"].notes, *motion.warnings)
