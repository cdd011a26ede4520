"""Hand edits of tracks: proposals of the cleaning made true, samples kept that it would cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from markerscope.app.models.edits import Edit, decide
from markerscope.solver.cleaning.swaps import Proposal
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session


def accept(session: Session, proposal: Proposal) -> Edit:
    """Make an edit of tracks that the cleaning proposes."""
    frames = (proposal.frame,) if proposal.kind == "swap" else (proposal.frame, proposal.last)
    row = tuple(int(number) for number in (*proposal.markers, *frames))
    return Edit(proposal.sentence.rstrip("."), _add(session, "swaps" if proposal.kind == "swap" else "joins", row))


def keep_samples(session: Session, stretches: Mapping[int, tuple[int, int]], labels: Sequence[str]) -> Edit:
    """Keep samples of some markers, each from one frame to another, both included, whatever they look like."""
    after = session
    for marker, (first, last) in stretches.items():
        after = _add(after, "keep", (int(marker), int(first), int(last)))
    if len(stretches) == 1:
        ((marker, (first, last)),) = stretches.items()
        return Edit(f"{labels[marker]} kept as measured in frames {first} to {last}", after)
    first, last = min(first for first, _ in stretches.values()), max(last for _, last in stretches.values())
    return Edit(f"{len(stretches)} markers kept as measured between frames {first} and {last}", after)


def _add(session: Session, name: str, row: tuple[int, ...]) -> Session:
    rows = getattr(session.stage_settings(graph_of(session))["clean"], name)
    return decide(session, "clean", {name: [list(known) for known in dict.fromkeys((*rows, row))]})
