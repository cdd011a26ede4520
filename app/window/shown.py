"""What there is to draw of each stage, and what is prepared once from it for every view."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.app.models.results import Ref
from markerscope.app.models.signal import Signal
from markerscope.app.models.workbench import Workbench
from markerscope.app.views import bodies
from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.skin import signed_distance
from markerscope.app.views.tracks import MarkerTracks, tracks_of

if TYPE_CHECKING:
    from markerscope.solver.body.model import Body
    from markerscope.solver.core.markers import Markers
    from markerscope.solver.fit.results import FittedMotion

WANTED = (
    "markers", "clean", "landmarks", "prior", "sync", "segment", "localize", "solve", "orient", "fit", "neutral",
    "angles", "errors", "surface", "check",
)  # fmt: skip


_ON_THE_BODY = ("localize", "solve", "orient", "fit")


class Shown:
    """What there is to draw of every stage, in force or out of date, as soon as it is in memory.

    Attributes
    ----------
    changed : emitted with the names of the stages whose result is another, and "compared" where that list is
    dated : emitted with the names of the stages whose result is the same, but has gone out of date or is in force again
    """

    def __init__(self, bench: Workbench) -> None:
        self.changed: Signal[[frozenset[str]]] = Signal()
        self.dated: Signal[[frozenset[str]]] = Signal()
        self.bench = bench
        self._old: frozenset[str] = frozenset()
        self._refs: dict[str, Ref] = {}
        self._values: dict[str, Any] = {}
        self._compared: dict[Ref, Any] = {}
        self._made: dict[str, tuple[Any, Any]] = {}
        self._bodies: dict[Path | None, Body] = {}
        self._coming: threading.Thread | None = None
        self._spoilt: tuple[Path, str] | None = None
        self._posed: tuple[FittedMotion, BodyTrack] | None = None
        self._skin: tuple[BodyTrack, MarkerTracks, int, np.ndarray] | None = None
        bench.board.prepare = self._prepare
        bench.board.changed.connect(self.follow)
        bench.document.changed.connect(self._begin_anew)

    def _begin_anew(self, another: bool) -> None:
        if another:
            gone = frozenset(self._refs)
            self._refs, self._values, self._compared, self._made = {}, {}, {}, {}
            self._posed, self._old = None, frozenset()
            self.changed.emit(gone)
            if self.bench.document.is_open:
                self._load_body_ahead()
            self.follow()

    def follow(self) -> None:
        """Take what is in memory, have the rest loaded, and tell what is another."""
        board, changed = self.bench.board, set[str]()
        for stage in WANTED:
            latest = board.latest(stage) if self.bench.document.is_open else None
            ref = None if latest is None else Ref(stage, latest[0])
            if ref is None:
                if self._refs.pop(stage, None) is not None:
                    self._values.pop(stage, None)
                    changed.add(stage)
            elif self._refs.get(stage) != ref:
                before = self._refs.get(stage)
                if self._has(ref):
                    self._refs[stage], self._values[stage] = ref, board.results.get(stage, ref.key)
                    changed.add(stage)
                elif before is not None and not board.was_in_force(stage, before.key):
                    # Of a decision that was undone: not even for the moment that the other takes to be loaded.
                    del self._refs[stage], self._values[stage]
                    changed.add(stage)
        fits = {ref for ref in board.compared if ref.stage in ("fit", "angles")}
        for gone in self._compared.keys() - fits:
            del self._compared[gone]
            changed.add("compared")
        for ref in sorted(fits - self._compared.keys(), key=lambda ref: ref.key):
            if self._has(ref):
                self._compared[ref] = board.results.get(ref.stage, ref.key)
                changed.add("compared")
        old = frozenset(stage for stage in self._refs if self.stale(stage))
        turned, self._old = (old ^ self._old) - changed, old
        if changed & {"markers", "clean"} and (markers := self.markers) is not None:
            self.bench.selection.keep_within(len(markers.labels))
        if changed:
            self.changed.emit(frozenset(changed))
        if turned:
            self.dated.emit(turned)

    def _has(self, ref: Ref) -> bool:
        results = self.bench.board.results
        if results.is_loaded(ref.stage, ref.key):
            return True
        results.loaded.connect(self._loaded)
        results.load_ahead(ref.stage, ref.key)
        return False

    def _loaded(self, ref: Ref) -> None:
        self.follow()

    def get(self, stage: str) -> Any:
        """What is shown of a stage, None where there is nothing (yet), or only of other markers than there are now."""
        value = self._values.get(stage)
        if value is None or not self._of_these_markers(stage, value):
            return None
        return value if stage not in _ON_THE_BODY or self._has_body() else None

    def _has_body(self) -> bool:
        """Whether the body can be read; where it cannot, that is said once, and nothing that stands on it is drawn."""
        path = self._body_file() if self.bench.document.is_open else None
        if path is None or path in self._bodies:
            return True
        source = self.bench.board.sources.get("body_file")
        own = path, "" if source is None else source.digest
        if own != self._spoilt:
            self._spoilt = own
            return self.bench.attempt(lambda: self.body)
        return False

    def _of_these_markers(self, stage: str, value: Any) -> bool:
        """Whether a result speaks of no marker, and no keyframe, that is not there: the file may have changed."""
        if stage not in ("localize", "fit") or (markers := self.markers) is None:
            return True
        frames, count = markers.positions.shape[:2]
        if stage == "fit":
            return bool(value.residual.shape[1] == count)
        keyframes = value.many if hasattr(value, "many") else value.frames
        return bool(value.markers.max(initial=-1) < count and keyframes.max(initial=-1) < frames)

    def stale(self, stage: str) -> bool:
        """Whether what is shown of a stage is not what the settings ask for."""
        ref = self._refs.get(stage)
        return ref is not None and self.bench.board.keys.get(stage) != ref.key

    def key(self, stage: str) -> str | None:
        """Key of what is shown of a stage."""
        ref = self._refs.get(stage)
        return None if ref is None else ref.key

    def made_from(self, stage: str, other: str) -> bool:
        """Whether what is shown of a stage was computed from what is shown of another."""
        own, given = self._refs.get(stage), self._refs.get(other)
        if own is None or given is None:
            return False
        entry = self.bench.board.results.entry(own.stage, own.key)
        return entry is not None and entry.about.get("inputs", {}).get(other) == given.key

    def out_of_date(self, stages: Iterable[str]) -> tuple[str, ...]:
        """Those of some stages that are shown, and are not what the settings ask for."""
        return tuple(stage for stage in stages if self.stale(stage) and self.get(stage) is not None)

    def compared(self, stage: str) -> dict[Ref, Any]:
        """Results that are shown beside the one in force."""
        own = self._refs.get(stage)
        return {ref: value for ref, value in self._compared.items() if ref.stage == stage and ref != own}

    def once(self, name: str, stands_on: tuple[Any, ...], make: Callable[[], Any]) -> Any:
        """What ``make`` makes, made again only when one of the objects it stands on is another."""
        known = self._made.get(name)
        if known is None or len(known[0]) != len(stands_on) or any(a is not b for a, b in zip(known[0], stands_on)):
            known = stands_on, make()
            self._made[name] = known
        return known[1]

    @property
    def markers(self) -> Markers | None:
        """The trajectories, cleaned where they have been; None before they are read."""
        raw, cleaned = self.get("markers"), self.get("clean")
        if cleaned is None or raw is None:
            return raw if cleaned is None else cleaned.markers
        # Trajectories that were cut in two come behind those of the file, so there may be more of them.
        alike = cleaned.markers.positions.shape == raw.positions.shape
        return cleaned.markers if alike or self.made_from("clean", "markers") else raw

    @property
    def fit(self) -> FittedMotion | None:
        """The fit, where it is of these markers and frames."""
        motion, markers = self.get("fit"), self.markers
        if motion is None or markers is None or motion.residual.shape != markers.positions.shape[:2]:
            return None
        return motion

    @property
    def tracks(self) -> MarkerTracks | None:
        """What there is of every marker in every frame."""
        markers, motion, cleaned = self.markers, self.fit, self.get("clean")
        if markers is None:
            return None
        cut = cleaned.outliers if cleaned is not None and cleaned.markers is markers else None
        return self.once("tracks", (markers, motion, cut), lambda: tracks_of(markers, motion, cut))

    @property
    def body(self) -> Body:
        """The session's body, with free bone lengths."""
        if self._bodies and not self.bench.document.is_open:  # views clear themselves one after the other
            return next(iter(self._bodies.values()))
        path = self._body_file()
        if self._coming is not None and path not in self._bodies:
            self._coming.join()
        if path not in self._bodies:
            self._load_body(path)  # again where it could not be had, so that whoever asks hears why
        return self._bodies[path]

    def _body_file(self) -> Path | None:
        given = self.bench.document.session.inputs.get("body_file")
        return None if given is None else given.path

    def _load_body(self, path: Path | None) -> None:
        from markerscope.solver.body.bones import load_body

        self._bodies = {path: load_body(path)}

    def _load_body_ahead(self) -> None:
        """Have the body at hand before the first fit is to be drawn: reading it takes longer than a picture may."""

        def load(path: Path | None) -> None:
            with suppress(Exception):
                self._load_body(path)

        path = self._body_file()
        if path not in self._bodies and (self._coming is None or not self._coming.is_alive()):
            self._coming = threading.Thread(target=load, args=(path,), name="body", daemon=True)
            self._coming.start()

    @property
    def track(self) -> BodyTrack | None:
        """The fitted body over time."""
        motion = self.get("fit")
        if motion is None:
            return None
        return self.once("track", (motion,), lambda: self._track_of(motion))

    def _track_of(self, motion: FittedMotion) -> BodyTrack:
        posed = self._posed
        return posed[1] if posed is not None and posed[0] is motion else bodies.of_motion(self.body, motion)

    def _prepare(self, ref: Ref, value: Any) -> None:
        """In the background: the skins of a fit, whose making takes as long as a picture may."""
        if ref.stage == "fit":
            with suppress(Exception):  # whoever draws it hears why
                self._posed = value, bodies.of_motion(self.body, value).ready()

    def skin(self, frame: int) -> np.ndarray | None:
        """(M,) m, signed distance of the markers to the skin in a frame, where they are coloured by it; else None."""
        tracks, track, motion = self.tracks, self.track, self.fit
        if self.bench.display.colour_by != "skin" or tracks is None or track is None or motion is None:
            return None
        known = self._skin
        if known is None or known[0] is not track or known[1] is not tracks or known[2] != frame:
            vertices = track.vertices(tracks.time(frame))
            self._skin = track, tracks, frame, signed_distance(tracks.seen(frame), vertices, track.faces())
        assert self._skin is not None
        return self._skin[3]

    @property
    def clusters(self) -> Any:
        """(M,) group of each marker, None before they are grouped."""
        found, markers = self.get("segment"), self.markers
        return found.clusters if found is not None and markers is not None and _same(found, markers) else None

    @property
    def segmentation(self) -> Any:
        """The grouping of these markers, None before there is one."""
        return None if self.clusters is None else self.get("segment")


def _same(found: Any, markers: Markers) -> bool:
    return len(found.clusters) == len(markers.labels)
