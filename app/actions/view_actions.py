"""What is shown: colours, layers, the camera, the window's own parts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from markerscope.app.actions.action import Action, ActionWith, Asks, Reason, needs_session
from markerscope.app.models.display import COLOURS, LAYERS, STATISTICS, ColourBy
from markerscope.app.models.workbench import Workbench

_COLOUR_TITLES: dict[ColourBy, str] = {
    "cluster": "Colour by group",
    "bone": "Colour by bone",
    "residual": "Colour by residual",
    "gaps": "Colour by gaps",
    "selection": "Colour by selection",
    "skin": "Colour by distance to the skin",
}
_CAMERAS = {
    "front": "From the front", "back": "From the back", "left": "From the left", "right": "From the right",
    "top": "From the top", "isometric": "From a corner",
}  # fmt: skip
LONGEST_TRAIL_S = 10.0
TEXT_PERCENT = (100, 125, 150)
"""Sizes of text, of the desktop's own."""
_LAYER_KEYS = {
    "labels": "L",
    "trails": "T",
    "body": "B",
    "skeleton": "K",
    "bones": "Shift+K",
    "ghosts": "H",
    "neighbours": "I",
}


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
        lambda bench: "they are coloured so already" if bench.display.colour_by == colour else "",
        lambda bench: bench.display.colour_by == colour,
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


def _look(what: str, title: str, help: str, value: object) -> Action:
    """A choice that is kept with the user's preferences, under what stands before the dot."""
    name = what.partition(".")[0]
    usual = {"theme": "system", "text": 100}[name]
    chosen = _show(what, title, "View", help)
    return replace(chosen, checked=lambda bench: bench.document.home.preferences().get(name, usual) == value)


def _follow(bench: Workbench, asks: Asks) -> None:
    bench.display.set(follow=not bench.display.follow)


def _box(bench: Workbench, asks: Asks) -> None:
    bench.display.set(boxing=not bench.display.boxing)


def _show_body(bench: Workbench, asks: Asks, share: float) -> None:
    """Whoever says how dense the body is wants to see it."""
    bench.display.set(opacity=round(min(max(share, 0.0), 1.0), 2))


def _show_trails(bench: Workbench, asks: Asks, seconds: float) -> None:
    """Whoever says how long trails are wants to see them."""
    length = round(min(max(seconds, 0.0), LONGEST_TRAIL_S), 2)
    bench.display.set(trail_s=length)
    bench.display.show("trails", length > 0)


@dataclass(frozen=True)
class ShownFit:
    """A fit in the store by its key, and whether its residual is to be shown."""

    key: str
    on: bool


def _show_fit(bench: Workbench, asks: Asks, given: ShownFit) -> None:
    hidden = set(bench.display.hidden_fits) - {given.key} | (set() if given.on else {given.key})
    bench.display.set(hidden_fits=tuple(sorted(hidden)))


def _no_statistic(bench: Workbench, name: str) -> str:
    return "" if name in STATISTICS else "there is no such value"


BODY_OPACITY: ActionWith[float] = ActionWith("body.opacity", "Opacity of the body", _show_body)
TRAIL_LENGTH: ActionWith[float] = ActionWith("trails.length", "Length of the trails", _show_trails)
SHOW_FIT: ActionWith[ShownFit] = ActionWith("residual.fit", "Residual of a fit", _show_fit)
RESIDUAL_VALUE: ActionWith[str] = ActionWith(
    "residual.value", "Value of the residual", lambda bench, asks, name: bench.display.set(residual=name), _no_statistic
)
RESIDUAL_SELECTED: ActionWith[bool] = ActionWith(
    "residual.selected",
    "Selected markers only",
    lambda bench, asks, on: bench.display.set(residual_selected=on),
)
VIEWS_WITH = (BODY_OPACITY, TRAIL_LENGTH, SHOW_FIT, RESIDUAL_VALUE, RESIDUAL_SELECTED)


def _opacity(by: float) -> Callable[[Workbench, Asks], object]:
    def run(bench: Workbench, asks: Asks) -> None:
        bench.display.show("body", True)
        _show_body(bench, asks, bench.display.opacity + by)

    return run


def _opaque_already(least: bool) -> Reason:
    def why_not(bench: Workbench) -> str:
        at_end = bench.display.opacity <= 0.0 if least else bench.display.opacity >= 1.0
        if not (at_end and bench.display.layers["body"]):
            return ""
        return "the body is as clear as it gets" if least else "the body is as dense as it gets"

    return why_not


def _trails(by: float) -> Callable[[Workbench, Asks], object]:
    return lambda bench, asks: _show_trails(bench, asks, bench.display.trail_s + by)


def _trails_already(least: bool) -> Reason:
    def why_not(bench: Workbench) -> str:
        length, shown = bench.display.trail_s, bench.display.layers["trails"]
        if least:
            return "there are no trails" if length <= 0 and not shown else ""
        return "the trails are as long as they get" if length >= LONGEST_TRAIL_S and shown else ""

    return why_not


VIEW_ACTIONS = (
    Action(
        "tool.select",
        "Select by a box",
        "View",
        "A drag in the scene draws a box about markers; Shift+drag does so at any time.",
        _box,
        "Q",
        checked=lambda bench: bench.display.boxing,
    ),
    *(_colour(colour, number) for number, colour in enumerate(COLOURS, start=1)),
    *(_layer(layer) for layer in LAYERS),
    Action(
        "body.less",
        "Body clearer",
        "View",
        "Make the body more transparent by 10 %.",
        _opacity(-0.1),
        "O",
        _opaque_already(True),
    ),
    Action(
        "body.more",
        "Body denser",
        "View",
        "Make the body more opaque by 10 %.",
        _opacity(0.1),
        "Shift+O",
        _opaque_already(False),
    ),
    Action(
        "trails.shorter",
        "Trails shorter",
        "View",
        "Have the trails reach 0.1 s less far back.",
        _trails(-0.1),
        "Ctrl+T",
        _trails_already(True),
    ),
    Action(
        "trails.longer",
        "Trails longer",
        "View",
        "Have the trails reach 0.1 s further back.",
        _trails(0.1),
        "Shift+T",
        _trails_already(False),
    ),
    Action(
        "camera.follow",
        "Follow the person",
        "View",
        "The camera goes where the person goes.",
        _follow,
        "J",
        checked=lambda bench: bench.display.follow,
    ),
    *(
        _show(f"camera.{name}", title, "View", f"Look {title[0].lower()}{title[1:]}.", f"Ctrl+{number}", True)
        for number, (name, title) in enumerate(_CAMERAS.items(), start=1)
    ),
    _show("camera.fit", "Show everything", "View", "Bring all that is drawn into sight.", "Ctrl+0", True),
    _show(
        "camera.selected", "Frame the selection", "View", "Bring the selected markers, or all, into sight.", "F", True
    ),
    _show("export.picture", "Picture of the scene...", "Export", "Write the scene as PNG.", "Ctrl+Shift+P", True),
    _show("export.turntable", "Turntable...", "Export", "Write the scene, turned once round, as MP4.", "", True),
    _show("export.playback", "Playback...", "Export", "Write the scene as it plays as MP4.", "", True),
    _look("theme.light", "Light", "Dark on light.", "light"),
    _look("theme.dark", "Dark", "Light on dark.", "dark"),
    _look("theme.system", "As the system", "Light or dark as the system is.", "system"),
    *(
        _look(f"text.{percent}", f"Text {percent} %", "How large words and figures are.", percent)
        for percent in TEXT_PERCENT
    ),
    _show("window.layout", "Arrange panels anew", "View", "Put every panel back in its first place."),
    _show("window.history", "History", "Edit", "Every decision since the session was opened.", "Ctrl+H", True),
    _show("help.search", "Search actions...", "Help", "Find and do anything by its name.", "Ctrl+K"),
    _show("help.shortcuts", "Keyboard shortcuts", "Help", "Every shortcut on one sheet.", "F1 ?"),
    _show("help.about", "About Markerscope", "Help", "Version and licences."),
)
