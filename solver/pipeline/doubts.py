"""What the user should know or doubt about a solve, one sentence each."""

from __future__ import annotations

from markerscope.solver.fit.doubts.doubt import named, plural
from markerscope.solver.fit.doubts.far import SUSPECT_M
from markerscope.solver.pipeline.cleaning import notes_of
from markerscope.solver.pipeline.stage import GraphRun


def assumptions(graph: GraphRun) -> tuple[str, ...]:
    """What was assumed while the files were read, and which markers deserve a look."""
    read = (*graph["markers"].notes, *notes_of(graph["clean"]), *graph["prior"].notes, *graph["neutral"].notes)
    return (*read, *_suspects(graph))


def doubts(graph: GraphRun) -> tuple[str, ...]:
    """What speaks against the result."""
    found = graph["check"].doubts
    return (*(doubt.sentence for doubt in found), *graph["sync"].notes, *graph["fit"].warnings)


def _suspects(graph: GraphRun) -> tuple[str, ...]:
    suspect, labels = graph["check"].suspect, graph["markers"].labels
    if not suspect:
        return ()
    return (
        f"{plural(len(suspect), 'marker')} stay over {1000 * SUSPECT_M:.0f} mm from their places "
        f"({named(labels, suspect)}): most of such sit on another bone than they were given to.",
    )
