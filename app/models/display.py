"""What the scene and the video show, and how; not part of what was decided, but kept with the session."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, get_args

from markerscope.app.models.signal import Signal

ColourBy = Literal["cluster", "bone", "residual", "gaps", "selection", "skin"]
COLOURS: tuple[ColourBy, ...] = get_args(ColourBy)
Statistic = Literal["mean", "median", "p95", "worst"]
STATISTICS: dict[Statistic, str] = {"mean": "Mean", "median": "Median", "p95": "95th percentile", "worst": "Worst"}
"""What the residual over time is of the markers in each frame."""
LAYERS = {
    "markers": ("Markers", True),
    "labels": ("Marker names", False),
    "trails": ("Trails", False),
    "floor": ("Floor and axes", True),
    "body": ("Body", True),
    "skeleton": ("Skeleton", True),
    "bones": ("Bones", True),
    "links": ("Lines from markers to the skin", False),
    "neighbours": ("Neighbours that move rigidly", False),
    "ghosts": ("Ghosts of other answers", True),
    "landmarks": ("Landmarks in the video", True),
    "projected": ("Markers and body in the video", True),
}
"""Title of each layer, and whether it is shown at first."""


class Display:
    """Layers, colours, opacity.

    Attributes
    ----------
    colour_by : what the markers' colours mean
    layers : whether each layer of ``LAYERS`` is shown
    opacity : 0..1, of the body
    trail_s : s, how far back the trails reach
    follow : whether the camera goes with the person
    boxing : whether a plain drag in the scene draws a box about markers
    residual : which value over the markers the timelines show of every fit
    residual_selected : whether only the selected markers count there
    hidden_fits : keys of the fits that are not shown there
    changed : emitted with the names of what changed; a layer is "layer.NAME"
    """

    def __init__(self) -> None:
        self.changed: Signal[[frozenset[str]]] = Signal()
        self.colour_by: ColourBy = "cluster"
        self.layers = {name: shown for name, (_, shown) in LAYERS.items()}
        self.opacity = 0.6
        self.trail_s = 0.5
        self.follow = False
        self.boxing = False
        self.residual: Statistic = "mean"
        self.residual_selected = False
        self.hidden_fits: tuple[str, ...] = ()

    def set(self, **values: Any) -> None:
        """Change any of the values; what cannot be is left as it is."""
        names = set()
        for name, value in values.items():
            if name in _SOUND and _SOUND[name](value) and getattr(self, name) != value:
                setattr(self, name, value)
                names.add(name)
        if names:
            self.changed.emit(frozenset(names))

    def show(self, layer: str, shown: bool) -> None:
        """Show a layer, or hide it."""
        if self.layers[layer] != shown:
            self.layers[layer] = shown
            self.changed.emit(frozenset({f"layer.{layer}"}))

    def toggle(self, layer: str) -> None:
        """Show a layer that is hidden, hide one that is shown."""
        self.show(layer, not self.layers[layer])

    def state(self) -> dict[str, Any]:
        """What to write down, so that ``restore`` brings it back."""
        return {name: getattr(self, name) for name in _SOUND} | {"layers": dict(self.layers)}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Show what ``state`` gave; what cannot be understood is left out."""
        values = {name: value for name, value in state.items() if name in _SOUND}
        if isinstance(values.get("hidden_fits"), list):
            values["hidden_fits"] = tuple(values["hidden_fits"])
        self.set(**values)
        layers = state.get("layers")
        for name, shown in layers.items() if isinstance(layers, Mapping) else ():
            if name in self.layers and isinstance(shown, bool):
                self.show(name, shown)


def _number(low: float, high: float) -> Any:
    return lambda v: isinstance(v, int | float) and not isinstance(v, bool) and low <= v <= high


_SOUND = {
    "colour_by": lambda v: v in COLOURS,
    "opacity": _number(0, 1),
    "trail_s": _number(0, 60),
    "follow": lambda v: isinstance(v, bool),
    "boxing": lambda v: isinstance(v, bool),
    "residual": lambda v: v in STATISTICS,
    "residual_selected": lambda v: isinstance(v, bool),
    "hidden_fits": lambda v: isinstance(v, tuple) and all(isinstance(key, str) for key in v),
}
"""What each value must be."""
