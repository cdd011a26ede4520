"""A session's stages run as far as wanted, and found again, without writing any output file."""

from __future__ import annotations

from collections.abc import Collection

from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.session import Session
from markerscope.solver.pipeline.stage import GraphRun, OnEvent, ignore, run_graph, stage_keys
from markerscope.solver.pipeline.stages import SOURCES


def keys_of(session: Session) -> dict[str, str]:
    """Key of every stage, for the session's inputs, settings and edits as they are now.

    Raises
    ------
    InputError : an input is not there any more, or a setting cannot be used
    """
    stages = graph_of(session)
    return stage_keys(stages, session.sources(SOURCES), session.stage_settings(stages))


def run_stages(
    session: Session,
    until: Collection[str] | None = None,
    progress: Progress = silent,
    on_event: OnEvent = ignore,
    again: Collection[str] = (),
) -> GraphRun:
    """Have the results of some stages, and of all that lead to them, in the session's store.

    Parameters
    ----------
    until : the stages that are wanted, None for all
    progress : told the fraction done, and what is found on the way
    on_event : told when a stage begins, ends, fails, or was in the store
    again : the wanted stages that are computed although they are there
    """
    stages = graph_of(session)
    return run_graph(
        stages,
        session.sources(SOURCES),
        session.stage_settings(stages),
        session.store,
        until,
        progress=progress,
        on_event=on_event,
        again=again,
    )


def run_session(
    session: Session,
    until: Collection[str] | None = None,
    progress: Progress = silent,
    on_event: OnEvent = ignore,
    again: Collection[str] = (),
) -> dict[str, str]:
    """``run_stages`` for a worker process: the keys come back, the results stay in the store."""
    return dict(run_stages(session, until, progress, on_event, again).keys)
