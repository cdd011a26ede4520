"""What the worker tests run in a child process: importable by name, as a spawned process needs it."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Found, part_of, tell
from markerscope.solver.pipeline.inputs import LandmarkSettings
from markerscope.solver.pipeline.source import Source
from markerscope.solver.pipeline.stage import Event, NoSettings, Stage, run_graph
from markerscope.solver.pipeline.stages import GRAPH as SOLVE
from markerscope.solver.pipeline.store import Store
from markerscope.solver.video import watched

LANDMARKS = tuple(stage for stage in SOLVE if stage.name == "landmarks")
RARELY = {"landmarks": LandmarkSettings(rate=3.0)}


def add(a: int, b: int, *, progress: Any, on_event: Any) -> int:
    progress(0.5, "adding")
    on_event(Event("add", "running", "k"))
    progress(1.0, "added")
    return a + b


def refuse(*, progress: Any, on_event: Any) -> None:
    raise InputError("has no markers", "a.trc", "export it again")


def stumble(*, progress: Any, on_event: Any) -> None:
    raise ZeroDivisionError("of all things")


def die(*, progress: Any, on_event: Any) -> None:
    os._exit(9)


def unsendable(*, progress: Any, on_event: Any) -> Any:
    return lambda: None


def quick(settings: Any, progress: Any, *, file: Any) -> int:
    return 1


def endless(settings: Any, progress: Any, *, quick: int) -> int:
    while True:
        progress(0.5, "waiting to be ended")
        time.sleep(0.01)


GRAPH = (
    Stage("quick", 1, NoSettings, ("file",), quick, int),
    Stage("endless", 1, NoSettings, ("quick",), endless, int),
)


def graph_that_hangs(root: Path, *, progress: Any, on_event: Any) -> None:
    store = Store(root)
    run_graph(GRAPH, {"file": Source.file(None)}, {}, store, until=["quick"], on_event=on_event)
    half = store.root / "endless" / f".tmp-{os.getpid()}-half"
    half.mkdir(parents=True)
    (half / "arrays.npz").write_bytes(b"half")
    run_graph(GRAPH, {"file": Source.file(None)}, {}, store, progress=progress, on_event=on_event)


def seek(*, progress: Any, on_event: Any) -> None:
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda i: tell(part_of(progress, 0.0, 0.5), Found("chain", i, {"cost": float(i)})), range(40)))


def watch(root: Path, video: Path, *, progress: Any, on_event: Any) -> None:
    """The landmarks of a video, kept in small pieces."""
    watched.PIECE = 4
    run_graph(LANDMARKS, {"video_file": Source.file(video)}, RARELY, Store(root), progress=progress)
