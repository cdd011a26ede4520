"""The 3D scene: markers, body and skeleton at the clock's time, coloured and selected as everywhere."""

from __future__ import annotations

from typing import Any

import numpy as np
from PySide6.QtCore import Qt

from markerscope.app.models.fields import title
from markerscope.app.models.workbench import Said, Workbench
from markerscope.app.views import neighbours, scene
from markerscope.app.views.bodies import BodyTrack
from markerscope.app.views.colours import RGB, Legend
from markerscope.app.views.posing import BONE_EDGES
from markerscope.app.views.tracks import MarkerTracks
from markerscope.app.window.ghosts import Ghost, Ghosts
from markerscope.app.window.keys import how
from markerscope.app.window.once import Once
from markerscope.app.window.shown import Shown
from markerscope.widgets import palette, theme
from markerscope.widgets.colour_bar import ColourBar
from markerscope.widgets.scene import Legend as Drawn
from markerscope.widgets.scene import Scene3D

_NONE = np.zeros((0, 3))
_IVORY = (238, 230, 210)
TROUBLE_REMEDY = "all else works on; save the session, and open it again if it does not come back by itself"
"""What to do where a view cannot be drawn."""
OUT_OF_DATE = "Out of date"
_OLD_BONE: RGB = (128, 128, 128)
_COLOURED = {"cluster": "segment", "bone": "fit", "residual": "fit", "skin": "fit"}
"""The stage that the colours of the markers come from."""


class SceneBinder:
    """Draws the scene, and takes what is clicked in it for the selection.

    Attributes
    ----------
    clusters : (M,) groups while a cut is being dragged, else None
    """

    def __init__(self, widget: Scene3D, bench: Workbench, shown: Shown, ghosts: Ghosts) -> None:
        self.widget, self.bench, self.shown, self.ghosts = widget, bench, shown, ghosts
        self.clusters: np.ndarray | None = None
        self._framed = False
        self._own_view: dict[str, Any] | None = None
        self._body: tuple[object, ...] | None = None
        self._bones: tuple[BodyTrack, float, bool] | None = None
        self._legend: tuple[object, ...] | None = None
        self._ghost_layers: set[str] = set()
        self.drawing = Once(widget, self.draw)
        bench.clock.moved.connect(self.drawing.ask)
        bench.clock.changed.connect(self.drawing.ask)
        bench.display.changed.connect(self._display)
        bench.selection.changed.connect(self.drawing.ask)
        bench.opened.connect(self._opened)
        shown.changed.connect(self._changed)
        shown.dated.connect(self.drawing.ask)
        ghosts.changed.connect(self.drawing.ask)
        widget.marker_clicked.connect(lambda marker, held: bench.selection.select_markers([marker], how(held)))
        widget.markers_boxed.connect(lambda markers, held: bench.selection.select_markers(markers, _box_how(held)))
        widget.bone_clicked.connect(lambda layer, bone, held: self._bone(bone, held))
        widget.trouble.connect(lambda text: bench.say(Said("error", text, remedy=TROUBLE_REMEDY)))
        widget.background_clicked.connect(lambda held: None if _held(held) else bench.selection.clear())
        self._display(frozenset({"follow"}))

    def drag(self, clusters: np.ndarray | None) -> None:
        """Show these groups while a cut is dragged; None shows those of the result."""
        self.clusters = clusters
        self.drawing.ask()

    def draw(self) -> None:
        """Show the clock's moment, at once."""
        self.drawing.done()
        tracks = self.shown.tracks
        if tracks is None:
            self._clear()
            return
        bench, display = self.bench, self.bench.display
        layers, time = display.layers, bench.clock.time
        frame = tracks.nearest(time)
        drawn = scene.markers_at(
            tracks, frame, display.colour_by, segmentation=self.shown.segmentation, clusters=self.clusters,
            motion=self.shown.fit, selected=bench.selection.markers, skin=self.shown.skin(frame),
        )  # fmt: skip
        widget = self.widget
        widget.set_markers(drawn.positions if layers["markers"] else drawn.positions * np.nan, drawn.coloured.colours)
        widget.set_selected(bench.selection.markers)
        widget.set_trails(scene.trails(tracks, frame, display.trail_s) if layers["trails"] else None)
        self._say(drawn.coloured.legend, self._old())
        self._draw_neighbours(tracks, frame)
        self._draw_body(frame, time)
        self._draw_ghosts(time)
        widget.follow_point(scene.middle(tracks, frame))

    def _draw_neighbours(self, tracks: MarkerTracks, frame: int) -> None:
        found = self.shown.segmentation
        if found is None or not self.bench.display.layers["neighbours"]:
            self.widget.set_lines("neighbours", None, None)
            return
        graph = self.shown.once("neighbours", (found,), lambda: neighbours.graph_of(found))
        self.widget.set_lines("neighbours", *neighbours.graph_at(tracks, graph, frame))

    def _draw_body(self, frame: int, time: float) -> None:
        widget, track, display = self.widget, self.shown.track, self.bench.display
        tracks = self.shown.tracks
        assert tracks is not None
        hidden = track is None or self.ghosts.replaces_body
        if hidden or not display.layers["body"]:
            self._clear_body()
        else:
            assert track is not None
            self._show_body(track, time, display.opacity, self.shown.stale("fit"))
        if hidden or not display.layers["bones"]:
            self._clear_bones()
        else:
            assert track is not None
            self._show_bones(track, time)
        joints = None if hidden or not display.layers["skeleton"] else track.joints(time)  # type: ignore[union-attr]
        widget.set_bones("skeleton", joints, BONE_EDGES, self._bone_colours())
        if hidden or not display.layers["links"]:
            widget.set_lines("links", None, None)
        else:
            assert track is not None
            lines = scene.ties(tracks, track, frame)
            widget.set_lines("links", lines.start, lines.end)

    def _show_body(self, track: BodyTrack, time: float, opacity: float, old: bool) -> None:
        """The coarse mesh, and every vertex as soon as the clock rests; as it is where it is this body already.

        One that is out of date is striped.
        """
        wanted = track, time, opacity, theme.colours(), old
        if self._body is None or any(a is not b and a != b for a, b in zip(wanted, self._body)):
            self._body = wanted
            self.widget.set_mesh(
                "body", track.vertices(time, "coarse"), track.faces("coarse"),
                _striped(track.coarse_bands) if old else None, opacity,
                finer=lambda: (
                    track.vertices(time, "full"), track.faces("full"),
                    _striped(track.full_bands) if old else np.array(theme.colours().body),
                ),
            )  # fmt: skip

    def _show_bones(self, track: BodyTrack, time: float) -> None:
        """The bones inside the body; as they are where they are these already."""
        wanted = track, time, self.shown.stale("fit")
        if self._bones is None or self._bones[0] is not track or self._bones[1:] != wanted[1:]:
            self._bones = wanted
            colour = _OLD_BONE if wanted[2] else _IVORY
            self.widget.set_mesh("bones", track.bones.at(track.pose(time)), track.bones.faces, colour)

    def _clear_bones(self) -> None:
        self._bones = None
        self.widget.set_mesh("bones", None, _NONE)

    def _clear_body(self) -> None:
        self._body = None
        self.widget.set_mesh("body", None, _NONE)

    def _bone_colours(self) -> Any:
        """As the bones where these are shown, among which the lines then hide; grey where they are out of date."""
        bone, old, among_bones = self.bench.selection.bone, self.shown.stale("fit"), self.bench.display.layers["bones"]
        if bone is None and not old:
            return _IVORY if among_bones else None
        plain = _OLD_BONE if old else _IVORY if among_bones else theme.colours().bone
        colours = np.tile(np.array(plain, dtype=np.uint8), (len(BONE_EDGES), 1))
        if bone is not None:
            colours[BONE_EDGES[:, 0] == bone] = palette.SELECTED
        return colours

    def _old(self) -> tuple[tuple[str, RGB], ...]:
        """What is drawn of results that are out of date, in words with a colour, for the legend."""
        layers, found = self.bench.display.layers, []
        body = any(layers[name] for name in ("body", "skeleton", "links")) and not self.ghosts.replaces_body
        if body and self.shown.out_of_date(("fit",)):
            found.append(("Body, striped", theme.colours().warning))
        stage = _COLOURED.get(self.bench.display.colour_by, "")
        if layers["markers"] and self.clusters is None and self.shown.out_of_date((stage,)):
            found.append((f"Colours: {title(stage)}", _OLD_BONE))
        if layers["markers"] and (old := self.shown.out_of_date(("markers", "clean"))):
            found.append((f"Markers: {title(old[-1])}", _OLD_BONE))
        return tuple(found)

    def _draw_ghosts(self, time: float) -> None:
        here = {f"ghost {ghost.name}": ghost for ghost in self.ghosts.all} if self._ghosts_on() else {}
        for name in self._ghost_layers - here.keys():
            self.widget.set_mesh(name, None, _NONE)
            self.widget.set_bones(f"{name} bones", None, BONE_EDGES)
        for name, ghost in here.items():
            vertices = ghost.track.vertices(time, "coarse")
            self.widget.set_mesh(name, vertices, ghost.track.faces("coarse"), ghost.colour, ghost.opacity)
            self.widget.set_bones(f"{name} bones", ghost.track.joints(time), BONE_EDGES, _standing_out(ghost))
        self._ghost_layers = set(here)

    def _ghosts_on(self) -> bool:
        return self.bench.display.layers["ghosts"] or self.ghosts.replaces_body

    def _say(self, legend: Legend, old: tuple[tuple[str, RGB], ...]) -> None:
        ghosts = tuple((ghost.title, ghost.colour) for ghost in self.ghosts.all) if self._ghosts_on() else ()
        said = legend, ghosts, old, self.bench.display.layers["neighbours"], self.shown.segmentation is None
        if said == self._legend:
            return
        self._legend = said
        others = Drawn("Ghosts", ghosts) if ghosts else None
        if self.shown.segmentation is not None and self.bench.display.layers["neighbours"]:
            others = Drawn("Distance varies by", ColourBar(0.0, 1000 * neighbours.LIMIT_M, "mm"), others)
        self.widget.set_legend(
            legend.title,
            legend.entries,
            Drawn(OUT_OF_DATE, old, others) if old else others,
        )

    def _clear(self) -> None:
        self.widget.set_markers(_NONE, np.zeros((0, 3), np.uint8))
        self._clear_body()
        self._clear_bones()
        self.widget.set_bones("skeleton", None, BONE_EDGES)
        self.widget.set_lines("links", None, None)
        self.widget.set_lines("neighbours", None, None)
        self.widget.set_legend("", None)
        self.widget.set_trails(None)
        self._legend = None
        for name in self._ghost_layers:
            self.widget.set_mesh(name, None, _NONE)
            self.widget.set_bones(f"{name} bones", None, BONE_EDGES)
        self._ghost_layers = set()

    def _opened(self) -> None:
        self._framed, self._own_view = False, None
        self.clusters = None
        if not self.bench.document.is_open:
            self._clear()

    def _changed(self, stages: frozenset[str]) -> None:
        if "segment" in stages:
            self.clusters = None
        self.drawing.ask()
        tracks = self.shown.tracks
        if tracks is None:
            return
        if stages & {"markers", "clean"}:
            self._names()
            lowest = scene.extent(tracks)[0]
            self.widget.set_floor(0.0 if -0.3 < lowest[2] < 0.5 else float(lowest[2]))
        track = self.shown.track
        if "fit" in stages and track is not None:
            self.widget.set_facing(track.rotations[len(track.times) // 2, 0][:2, 2])
        if not self._framed:
            self._framed = True
            state = self.bench.document.view.get("camera")
            if isinstance(state, dict):
                self.widget.restore_camera(state)
            else:
                self._look_at(scene.outline(tracks, track))
        elif "fit" in stages and track is not None and self._own_view == self._view():
            # The body reaches beyond the markers, and now it is known which way it faces.
            self._look_at(scene.outline(tracks, track))

    def _look_at(self, points: np.ndarray) -> None:
        """See all of them, from before the person where that is known."""
        self.widget.view_from("isometric")
        self.widget.frame(points)
        self._own_view = self._view()

    def _view(self) -> dict[str, Any]:
        return {name: value for name, value in self.widget.camera_state().items() if name != "facing"}

    def _display(self, names: frozenset[str]) -> None:
        display = self.bench.display
        self.widget.show_layer("floor", display.layers["floor"])
        self.widget.show_layer("axes", display.layers["floor"])
        self.widget.set_follow(display.follow)
        self._names()
        self.drawing.ask()

    def _names(self) -> None:
        markers = self.shown.markers
        named = markers is not None and self.bench.display.layers["labels"]
        self.widget.set_marker_labels(markers.labels if named and markers is not None else None)

    def _bone(self, edge: int, held: Qt.KeyboardModifier) -> None:
        if 0 <= edge < len(BONE_EDGES):
            self.bench.selection.select_bone(int(BONE_EDGES[edge, 0]), how(held))


def _held(held: Qt.KeyboardModifier) -> bool:
    return bool(held & (Qt.KeyboardModifier.ControlModifier | Qt.KeyboardModifier.ShiftModifier))


def _box_how(held: Qt.KeyboardModifier) -> Any:
    """Shift draws the box, so it alone replaces; with Ctrl it adds."""
    return "add" if held & Qt.KeyboardModifier.ControlModifier else "replace"


def _standing_out(ghost: Ghost) -> Any:
    """A ghost's colour for the bones that carry the markers, and a faint grey for the others."""
    carrying = np.isin(BONE_EDGES[:, 0], list(ghost.bones))
    if not carrying.any():
        return ghost.colour
    faint = np.array(theme.colours().grid, dtype=np.uint8)
    return np.where(carrying[:, None], np.array(ghost.colour, dtype=np.uint8), faint)


def _striped(bands: np.ndarray) -> np.ndarray:
    """(V, 3) uint8 of a body that is out of date: stripes of its colour and of a warning's."""
    look = theme.colours()
    return np.where(bands[:, None], np.array(look.warning), np.array(look.body)).astype(np.uint8)
