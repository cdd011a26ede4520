"""The methods that are compared. Each is given what a user has, and never sees the truth.

A further method is one more line in ``METHODS``.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress, silent
from markerscope.solver.core.request import Method
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.published.results import PaperSolve
from markerscope.solver.fit.published.settings import PaperLocalizeSettings, PaperSolveSettings
from markerscope.solver.fit.results import FittedMotion, Orientation
from markerscope.solver.fit.state import Observations
from markerscope.solver.pipeline.inputs import SyncSettings
from markerscope.solver.pipeline.methods import GRAPHS

_UNSURE = 0.5
"""Below this confidence in the offset a solve asks its user for it."""
SHARED_CODE = ("core", "body", "cleaning", "sync", "clustering", "fit/*.py", "solve/pull",
           "pipeline/fitting.py", "pipeline/stages.py", "pipeline/inputs.py", "pipeline/cleaning.py")  # fmt: skip
NEURAL_CODE = (*SHARED_CODE, "neural", "pipeline/stages_neural.py")
PAPER_CODE = (*SHARED_CODE, "fit/published", "pipeline/stages_paper.py")


@dataclass(frozen=True)
class Labels:
    """What a labelled method is told of each marker: its vertex and its bone, (M,), -1 where it belongs to nobody."""

    vertex: np.ndarray
    joint: np.ndarray


@dataclass(frozen=True)
class Given:
    """What a user has.

    Attributes
    ----------
    markers, prior : the recording, and what another program made of its video
    nominal_offset : s, marker time less video time as the user believes it to be
    body : the user's own body model, None for the embedded one
    labels : for methods that declare that they need them, else None
    """

    markers: Markers
    prior: PosePrior
    nominal_offset: float = 0.0
    body: Path | None = None
    labels: Labels | None = None


@dataclass(frozen=True)
class Alternative:
    """An answer that was named beside the first.

    Attributes
    ----------
    marker_joint : (M,) bone of each marker, -1 if unused
    frames : (N,) frame numbers
    root : (N, 3, 3) the pelvis' rotation there
    """

    marker_joint: np.ndarray
    frames: np.ndarray
    root: np.ndarray


@dataclass(frozen=True)
class Solved:
    """What a method answers.

    Attributes
    ----------
    motion : the body at every frame of the markers
    body : that it is of
    offset : s, marker time = video time + offset, as used
    seconds : by stage
    info : plain values worth keeping: margin, iterations, confidence in the offset
    alternatives : answers that it names as possible, its own among them
    steps : the answer after earlier steps of the method, by name; computed when called
    """

    motion: FittedMotion
    body: Body
    offset: float
    seconds: Mapping[str, float]
    info: Mapping[str, Any] = field(default_factory=dict)
    alternatives: tuple[Alternative, ...] = ()
    steps: Callable[[], Mapping[str, FittedMotion]] = dict


Solve = Callable[[Given, Mapping[str, Any], Progress], Solved]


@dataclass(frozen=True)
class Variant:
    """A method with its settings.

    Attributes
    ----------
    name : on the command line and in the tables
    about : what it is, for the table's foot
    solve : ``(given, settings by stage, progress) -> Solved``
    settings : of the stages that do not keep their defaults
    sources : files and folders below ``solver`` whose code it runs: a result of other code is computed again
    needs_labels : whether it is told where each marker sits
    """

    name: str
    about: str
    solve: Solve
    settings: Mapping[str, Any] = field(default_factory=dict)
    sources: tuple[str, ...] = SHARED_CODE
    needs_labels: bool = False

    def capped(self, iterations: int | None) -> Variant:
        """With at most so many iterations of each optimisation, where it has any."""
        if iterations is None:
            return self
        settings = {
            stage: replace(own, iterations=iterations) if "iterations" in {f.name for f in fields(own)} else own
            for stage, own in self.settings.items()
        }
        return replace(self, settings=settings)


def bundle(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """What ``solve`` does with a prior and no video."""
    return outcome("bundle", *run_stages("bundle", given, settings, "fit", progress))


def paper(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """The published method."""
    return outcome("paper", *run_stages("paper", given, settings, "fit", progress))


def neural(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """The network's poses beside the default fit, refined."""
    return outcome("neural", *run_stages("neural", given, settings, "fit", progress))


def registration(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """The video's pose, set rigidly on the markers: the paper's baseline."""
    from markerscope.solver.fit.published.registration import register

    results, seconds = run_stages("paper", given, settings, "localize", progress)
    start = time.perf_counter()
    body, seen, points = scene_of(results)
    motion = register(
        body, seen, points, given.markers.time, results["localize"], settings["localize"], given.prior.betas, progress
    )
    return Solved(motion, body, results["sync"].offset, {**seconds, "fit": time.perf_counter() - start})


def labelled(given: Given, settings: Mapping[str, Any], progress: Progress = silent) -> Solved:
    """A fit that is told the vertex below every marker, as MoSh++ is; it looks at no video."""
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.labelled.solve import solve_labelled

    if given.labels is None:
        raise ValueError("a labelled method needs labels")
    start = time.perf_counter()
    body = load_body(given.body)
    known = {label: int(v) for label, v in zip(given.markers.labels, given.labels.vertex, strict=True) if v >= 0}
    motion = solve_labelled(body, given.markers, known, settings.get("labelled"), progress)
    return Solved(motion, body, float("nan"), {"fit": time.perf_counter() - start})


def run_stages(
    name: Method,
    given: Given,
    settings: Mapping[str, Any],
    wanted: str,
    progress: Progress,
    known: Mapping[str, Any] | None = None,
) -> tuple[dict[str, Any], dict[str, float]]:
    """The results and times, s, of all stages of a method's graph that lead to ``wanted``: the very ones of a solve.

    Parameters
    ----------
    known : results of stages that are not to be run
    """
    stages = {stage.name: stage for stage in GRAPHS[name]}
    results: dict[str, Any] = {
        "markers": given.markers,
        "prior": given.prior,
        "landmarks": None,
        "body_file": given.body,
        "camera_file": None,
        "weights_file": None,
        "known_file": None,
        **(known or {}),
    }
    seconds: dict[str, float] = {}

    def ensure(name: str) -> None:
        if name in results:
            return
        stage = stages[name]
        for needed in stage.inputs:
            ensure(needed)
        inputs = {needed: results[needed] for needed in stage.inputs}
        start = time.perf_counter()
        if name == "sync":
            results[name] = _clock(stage.run, inputs, given.nominal_offset)
        else:
            own = settings[name] if name in settings else stage.settings()
            results[name] = stage.run(own, progress, **inputs)
        seconds[name] = time.perf_counter() - start

    ensure(wanted)
    return results, seconds


def _clock(run: Callable[..., Any], inputs: Mapping[str, Any], nominal: float) -> Any:
    """The offset found from the motion; where a solve would ask its user for it, what the user believes."""
    try:
        found = run(SyncSettings(), silent, **inputs)
    except InputError:
        found = None
    if found is not None and found.confidence >= _UNSURE:
        return found
    return run(SyncSettings(offset=nominal), silent, **inputs)


def scene_of(results: Mapping[str, Any]) -> tuple[Body, Observations, Points]:
    """What the stages of the fit look at, from the results of those before them."""
    from markerscope.solver.pipeline.fitting import FittedTo, scene

    given = FittedTo(
        clean=results["clean"],
        prior=results["prior"],
        landmarks=results["landmarks"],
        sync=results["sync"],
        body_file=results["body_file"],
    )
    return scene(**given)


def outcome(name: Method, results: Mapping[str, Any], seconds: Mapping[str, float]) -> Solved:
    """The answer of a method whose stages have all run."""
    ranked: Orientation = results["orient"]
    found, motion, sync = results["localize"], results["fit"], results["sync"]
    frames = found.frames if name == "paper" else found.many
    body = scene_of(results)[0]
    alternatives = []
    for candidate in ranked.candidates:
        if candidate.refined and len(candidate.rotations) == len(frames):
            joint = np.full(len(motion.marker_joint), -1)
            joint[found.markers] = candidate.bone
            alternatives.append(Alternative(joint, frames, candidate.rotations[:, 0]))
    told = {
        "margin": ranked.margin if np.isfinite(ranked.margin) else None,
        "sync_confidence": sync.confidence,
        "sync_method": sync.method,
        **(_iterations(results["solve"]) if name == "paper" else {}),
    }
    return Solved(motion, body, sync.offset, dict(seconds), told, tuple(alternatives))


def _iterations(solved: PaperSolve) -> dict[str, Any]:
    best = solved.yaws[solved.chosen]
    stages = {"stage 2": best.pose, "stage 4": best.markers, "stage 5": solved.refined}
    return {
        "iterations": {name: stage.descent.iterations for name, stage in stages.items()},
        "converged": {name: stage.descent.converged for name, stage in stages.items()},
    }


METHODS = (
    Variant("bundle", "the default method, as solve runs it", bundle),
    Variant(
        "paper",
        "Milef et al. (2024), five stages",
        paper,
        {"localize": PaperLocalizeSettings(), "solve": PaperSolveSettings()},
        PAPER_CODE,
    ),
    Variant("neural", "a trained network beside the default fit, then refined", neural, sources=NEURAL_CODE),
    Variant(
        "registration",
        "the video's pose set rigidly on the markers (HMR2.0+RR of the paper)",
        registration,
        {"localize": PaperLocalizeSettings()},
        PAPER_CODE,
    ),
    Variant(
        "labelled",
        "told the vertex below every marker: two stages as in MoSh++, without the video",
        labelled,
        sources=(*SHARED_CODE, "fit/labelled"),
        needs_labels=True,
    ),
)
"""What a user would choose among; ``ablations`` are beside them."""
