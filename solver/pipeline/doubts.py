"""What the user should know or doubt about a solve, one sentence each."""

from __future__ import annotations

from markerscope.solver.fit.doubts.doubt import named, plural
from markerscope.solver.fit.doubts.far import SUSPECT_M
from markerscope.solver.pipeline.cleaning import notes_of
from markerscope.solver.pipeline.names import ANGLES, CHECK, CLEAN, FIT, MARKERS, NEUTRAL, PRIOR, SYNC
from markerscope.solver.pipeline.stage import GraphRun


def assumptions(graph: GraphRun) -> tuple[str, ...]:
    """What was assumed while the files were read, which markers deserve a look, and how to read more of an angle."""
    read = (*graph[MARKERS].notes, *notes_of(graph[CLEAN]), *graph[PRIOR].notes, *graph[NEUTRAL].notes)
    hint = graph[ANGLES].hint
    return (*read, *_suspects(graph), *((hint,) if hint else ()))


def doubts(graph: GraphRun) -> tuple[str, ...]:
    """What speaks against the result."""
    found = graph[CHECK].doubts
    return (*(doubt.sentence for doubt in found), *graph[SYNC].notes, *graph[FIT].warnings)


def _suspects(graph: GraphRun) -> tuple[str, ...]:
    suspect, labels = graph[CHECK].suspect, graph[CLEAN].markers.labels
    if not suspect:
        return ()
    return (
        f"{plural(len(suspect), 'marker')} stay over {1000 * SUSPECT_M:.0f} mm from their places "
        f"({named(labels, suspect)}): most of such sit on another bone than they were given to.",
    )
