"""The stages of a trial of a known person without a video: those of the default method, but for where the poses come
from and what is held.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.clustering.segment import Segmentation
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.progress import Progress
from markerscope.solver.fit.known.method import KnownFitSettings, KnownSettings
from markerscope.solver.fit.known.track import Tracked
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.pipeline.stage import NoSettings, Stage
from markerscope.solver.pipeline.stages import BODY, GRAPH, said_fit, said_localization, said_orientation
from markerscope.solver.sync.offset import Sync

if TYPE_CHECKING:
    from markerscope.solver.body.model import Body
    from markerscope.solver.fit.known.body import KnownBody


def _person(known_file: Path | None, body_file: Path | None) -> tuple[Body, KnownBody]:
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.known.person_file import read_person

    if known_file is None:
        raise InputError("no known person is named", "method known", "give a person.npz with --known")
    body = load_body(body_file)
    return body, read_person(known_file, body)


def track_person(
    settings: NoSettings,
    progress: Progress,
    *,
    clean: Cleaned,
    segment: Segmentation,
    known_file: Path | None,
    body_file: Path | None,
) -> Tracked:
    """The known person found in some frames and followed from there."""
    from markerscope.solver.fit.known.track import follow

    body, known = _person(known_file, body_file)
    markers = clean.measured.positions.copy()
    markers[:, segment.clusters < 0] = np.nan
    return follow(body, known, markers, progress=progress)


def pose_by_markers(settings: NoSettings, progress: Progress, *, clean: Cleaned, known: Tracked) -> PosePrior:
    """The tracked poses in the place of a video's."""
    from markerscope.solver.fit.known.method import pose_of

    return pose_of(known, clean.markers)


def no_sync(settings: NoSettings, progress: Progress, *, clean: Cleaned) -> Sync:
    """There is no other clock."""
    return Sync(0.0, 1.0, 1.0, np.zeros(1), np.full(1, np.nan), method="given")


def place_known(
    settings: NoSettings,
    progress: Progress,
    *,
    clean: Cleaned,
    known: Tracked,
    known_file: Path | None,
    body_file: Path | None,
) -> Localization:
    """The different answers as ways to put the markers on the body."""
    from markerscope.solver.fit.known.method import located

    body, person = _person(known_file, body_file)
    return located(body, person, known, clean.measured.positions)


def rank_known(
    settings: KnownSettings,
    progress: Progress,
    *,
    clean: Cleaned,
    prior: PosePrior,
    known: Tracked,
    localize: Localization,
    known_file: Path | None,
    body_file: Path | None,
) -> Orientation:
    """The answers with what each costs, and what speaks against the person."""
    from markerscope.solver.fit.kinematics import Pose
    from markerscope.solver.fit.known.method import ranked
    from markerscope.solver.fit.labelled.solve import observed

    body, person = _person(known_file, body_file)
    markers = clean.measured.positions
    start = Pose(prior.rotations, np.zeros((len(markers), 3)), person.betas)
    return ranked(body, person, known, observed(markers, start), localize, settings, progress)


def fit_known(
    settings: KnownFitSettings,
    progress: Progress,
    *,
    clean: Cleaned,
    prior: PosePrior,
    localize: Localization,
    orient: Orientation,
    body_file: Path | None,
) -> FittedMotion:
    """The chosen answer carried to every frame."""
    from markerscope.solver.body.bones import load_body
    from markerscope.solver.fit.kinematics import Pose
    from markerscope.solver.fit.known.method import fitted
    from markerscope.solver.fit.labelled.solve import observed

    body, markers = load_body(body_file), clean.measured.positions
    start = Pose(prior.rotations, np.zeros((len(markers), 3)), orient.candidates[0].betas)
    return fitted(body, observed(markers, start), localize, orient, clean.markers.time, settings, progress)


def _said_tracked(found: Tracked) -> str:
    best = found.tracks[0]
    count, pieces = len(set(best.place[best.place >= 0].tolist())), int((best.place >= 0).sum())
    said = f"{count} of the person's markers found in {pieces} of the trial's {len(best.place)}"
    said += f", {1000 * best.cost:.1f} mm from their places; {best.looks} of {found.looked} frames say so alone"
    if len(found.tracks) > 1:
        said += f"; next different answer {1000 * found.tracks[1].cost:.1f} mm"
    return said


def _said_no_sync(sync: Sync) -> str:
    return "no video"


_OWN = (
    Stage(
        "known",
        1,
        NoSettings,
        ("clean", "segment", "known_file", "body_file"),
        track_person,
        Tracked,
        _said_tracked,
        cost=3,
        shipped=BODY,
    ),
    Stage("prior", 1, NoSettings, ("clean", "known"), pose_by_markers, PosePrior, cost=0.1),
    Stage("sync", 1, NoSettings, ("clean",), no_sync, Sync, _said_no_sync, cost=0.1),
    Stage(
        "localize",
        1,
        NoSettings,
        ("clean", "known", "known_file", "body_file"),
        place_known,
        Localization,
        said_localization,
        cost=0.1,
        shipped=BODY,
    ),
    Stage(
        "orient",
        1,
        KnownSettings,
        ("clean", "prior", "known", "localize", "known_file", "body_file"),
        rank_known,
        Orientation,
        said_orientation,
        cost=1,
        shipped=BODY,
    ),
    Stage(
        "fit",
        1,
        KnownFitSettings,
        ("clean", "prior", "localize", "orient", "body_file"),
        fit_known,
        FittedMotion,
        said_fit,
        cost=2,
        shipped=BODY,
    ),
)

GRAPH_KNOWN = (*(stage for stage in GRAPH if stage.name not in {own.name for own in _OWN}), *_OWN)
"""Every stage of a trial of a known person; those that neither pose nor place are the default method's."""
