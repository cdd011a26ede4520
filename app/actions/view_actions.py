"""What is shown: colours, layers, the camera, the window's own parts."""

from __future__ import annotations

from app.actions.action import Action, Asks, needs_session
from app.models.display import COLOURS, LAYERS, ColourBy
from app.models.workbench import Workbench

_COLOUR_TITLES: dict[ColourBy, str] = {
    "cluster": "Colour by group",
    "bone": "Colour by bone",
    "residual": "Colour by residual",
    "gaps": "Colour by gaps",
    "selection": "Colour by selection",
}
_CAMERAS = ("front", "back", "left", "right", "top", "isometric")
_LAYER_KEYS = {"labels": "L", "trails": "T", "body": "B", "skeleton": "K", "ghosts": "H"}


def _colour(colour: ColourBy, number: int) -> Action:
    def run(bench: Workbench, asks: Asks) -> None:
        bench.display.set(colour_by=colour)

    return Action(
        f"colour.{colour}",
        _COLOUR_TITLES[colour],
        "View",
        "What the colours of the markers mean, in the scene and in the video.",
        run,
        str(number),
        checked=lambda bench: bench.display.colour_by == colour,
    )


def _layer(layer: str) -> Action:
    title = LAYERS[layer][0]

    def run(bench: Workbench, asks: Asks) -> None:
        bench.display.toggle(layer)

    return Action(
        f"layer.{layer}",
        title,
        "View",
        f"Show or hide: {title[0].lower()}{title[1:]}.",
        run,
        _LAYER_KEYS.get(layer, ""),
        checked=lambda bench: bench.display.layers[layer],
    )


def _show(what: str, title: str, menu: str, help: str, shortcut: str = "", session: bool = False) -> Action:
    def run(bench: Workbench, asks: Asks) -> None:
        asks.show(what)

    action = Action(what, title, menu, help, run, shortcut)
    return Action(what, title, menu, help, run, shortcut, needs_session) if session else action


def _follow(bench: Workbench, asks: Asks) -> None:
    bench.display.set(follow=not bench.display.follow)


VIEW_ACTIONS = (
    *(_colour(colour, number) for number, colour in enumerate(COLOURS, start=1)),
    *(_layer(layer) for layer in LAYERS),
    Action(
        "camera.follow",
        "Follow the person",
        "View",
        "The camera goes where the person goes.",
        _follow,
        checked=lambda bench: bench.display.follow,
    ),
    *(
        _show(f"camera.{name}", f"From {name}" if name != "isometric" else "From a corner", "View", help)
        for name, help in zip(_CAMERAS, [f"Look from the {name}." for name in _CAMERAS[:-1]] + ["Look from a corner."])
    ),
    _show("camera.selected", "Frame the selection", "View", "Bring the selected markers, or all, into sight.", "F"),
    _show("export.picture", "Picture of the scene...", "Export", "Write the scene as PNG.", "Ctrl+Shift+P", True),
    _show("export.turntable", "Turntable...", "Export", "Write the scene, turned once round, as MP4.", "", True),
    _show("export.playback", "Playback...", "Export", "Write the scene as it plays as MP4.", "", True),
    _show("theme.light", "Light", "View", "Dark on light."),
    _show("theme.dark", "Dark", "View", "Light on dark."),
    _show("theme.system", "As the system", "View", "Light or dark as the system is."),
    _show("window.layout", "Arrange panels anew", "View", "Put every panel back in its first place."),
    _show("window.history", "History", "Edit", "Every decision since the session was opened.", "Ctrl+H", True),
    _show("help.search", "Search actions...", "Help", "Find and do anything by its name.", "Ctrl+K"),
    _show("help.shortcuts", "Keyboard shortcuts", "Help", "Every shortcut on one sheet.", "F1 ?"),
    _show("help.about", "About Markerscope", "Help", "Version and licences."),
)
