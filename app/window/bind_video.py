"""The video: the clock's frame, the landmarks in it, markers and body as the fitted camera sees them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from markerscope.app.models.fields import title
from markerscope.app.models.frames import VideoFrame
from markerscope.app.models.workbench import Said, Workbench
from markerscope.app.views import scene, video
from markerscope.app.views.posing import BONE_EDGES
from markerscope.app.window.bind_scene import TROUBLE_REMEDY
from markerscope.app.window.keys import how
from markerscope.app.window.once import Once
from markerscope.app.window.shown import Shown
from markerscope.solver.sync.offset import Sync
from markerscope.widgets.video import VideoView

_BODY, _BONES, _OLD = (86, 180, 233), (255, 255, 255), (150, 150, 150)
"""Colours of the projected body and its bones, and of both where the fit is out of date."""
_OLD_SHARE = 0.4
"""How strong landmarks are drawn that are out of date."""


class VideoBinder:
    """Draws the video's frame and what belongs over it."""

    def __init__(self, widget: VideoView, bench: Workbench, shown: Shown) -> None:
        self.widget, self.bench, self.shown = widget, bench, shown
        self.drawing = Once(widget, self.draw)
        for signal in (bench.clock.moved, bench.clock.changed, bench.video_changed):
            signal.connect(self.drawing.ask)
        for told in (bench.display.changed, bench.selection.changed, shown.changed, shown.dated):
            told.connect(self.drawing.ask)
        bench.opened.connect(self._opened)
        widget.marker_clicked.connect(lambda marker, held: bench.selection.select_markers([marker], how(held)))
        widget.trouble.connect(lambda text: bench.say(Said("error", text, remedy=TROUBLE_REMEDY)))

    def draw(self) -> None:
        """Show the clock's moment, at once."""
        self.drawing.done()
        frames, clock = self.bench.frames, self.bench.clock
        if frames is None:
            self.widget.set_frame(None, "No video" if self.bench.document.is_open else "")
            self._overlays(None)
            return
        number = clock.video_frame
        if number is None and len(frames.times):
            side = "begins later" if clock.video_time < frames.times[0] else "has ended"
            self.widget.set_frame(None, f"The video {side}")
            self._overlays(None)
            return
        frame = frames.at(clock.video_time)
        if frame is None:
            if not frames.done and frames.part < 1:
                self.widget.set_frame(None, f"Reading the video: {100 * frames.part:.0f} %")
            return
        count = len(frames.times)
        which = "" if frame.number is None else f"frame {frame.number} / {count - 1}   "
        old = ", ".join(title(stage) for stage in self._old())
        self.widget.set_frame(frame.picture, f"{which}{frame.time:.3f} s{f'   out of date: {old}' if old else ''}")
        self._overlays(frame)

    def _old(self) -> tuple[str, ...]:
        """The stages that are drawn over the picture and are out of date."""
        layers = self.bench.display.layers
        drawn = [*(["landmarks"] if layers["landmarks"] else [])]
        if layers["projected"] and self.shown.get("fit") is not None:
            drawn += ["markers", "clean", "sync", "fit"]
        return self.shown.out_of_date(drawn)

    def _overlays(self, frame: VideoFrame | None) -> None:
        self._landmarks(frame)
        self._projected(frame)

    def _landmarks(self, frame: VideoFrame | None) -> None:
        seen = self.shown.get("landmarks")
        if frame is None or seen is None or not self.bench.display.layers["landmarks"]:
            self.widget.set_landmarks(None)
            return
        number = frame.number
        if number is None:
            number = int(self.bench.clock.video_frame or 0)
        found = video.landmarks_at(seen, number, frame.time)
        scale = frame.picture.shape[1] / seen.image_size[0] if seen.image_size[0] else 1.0
        sure = (_OLD_SHARE if self.shown.stale("landmarks") else 1.0) * found.visibility
        self.widget.set_landmarks(found.px * scale, video.LANDMARK_EDGES, sure)

    def _projected(self, frame: VideoFrame | None) -> None:
        motion, sync, tracks = self.shown.get("fit"), self.shown.get("sync"), self.shown.tracks
        on = self.bench.display.layers["projected"]
        camera = None if motion is None else motion.camera
        if frame is None or camera is None or sync is None or tracks is None or not on or not camera.image_size[0]:
            self.widget.set_markers(None)
            self.widget.set_body(None, np.zeros((0, 3), int))
            self.widget.set_skeleton(None, BONE_EDGES)
            return
        sync = self._in_force(sync)
        track = self.shown.track
        found = video.projection_at(camera, sync, frame.time, tracks, track)
        scale = frame.picture.shape[1] / camera.image_size[0]
        at = tracks.nearest(self.bench.clock.time)
        coloured = scene.markers_at(
            tracks, at, self.bench.display.colour_by, segmentation=self.shown.segmentation, motion=self.shown.fit,
            selected=self.bench.selection.markers, skin=self.shown.skin(at),
        ).coloured  # fmt: skip
        layers = self.bench.display.layers
        self.widget.set_markers(found.markers * scale if layers["markers"] else None, coloured.colours)
        self.widget.set_selected(self.bench.selection.markers)
        body, bones = (_OLD, _OLD) if self.shown.stale("fit") else (_BODY, _BONES)
        self.widget.set_body(found.body * scale if layers["body"] else None, found.faces, body)
        self.widget.set_skeleton(found.joints * scale if layers["skeleton"] else None, found.bones, bones)

    def _in_force(self, sync: Sync) -> Sync:
        """The sync that the clock goes by: the user's offset while it is dragged."""
        timing = self.bench.clock.timing
        return replace(sync, offset=timing.offset, rate_ratio=timing.rate_ratio)

    def _opened(self) -> None:
        state = self.bench.document.view.get("video") if self.bench.document.is_open else None
        if isinstance(state, dict):
            self.widget.restore(state)
        else:
            self.widget.fit()
        self.draw()
