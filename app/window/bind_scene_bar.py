"""The bar above the scene: it shows how the display stands, and changes it."""

from __future__ import annotations

from markerscope.app.actions import Actions
from markerscope.app.actions.view_actions import BODY_OPACITY, TRAIL_LENGTH
from markerscope.app.models.display import COLOURS, LAYERS
from markerscope.app.models.workbench import Workbench
from markerscope.app.window.actions import native
from markerscope.widgets.panels.scene_bar import Choice, SceneBar
from markerscope.widgets.scene import Scene3D


def make_bar(table: Actions) -> SceneBar:
    """The bar, with the titles and keys of the actions that do the same."""

    def choice(name: str, id: str, title: str) -> Choice:
        action = table.table[id]
        return Choice(name, title, native(action), action.help)

    def keys(*ids: str) -> str:
        return ", ".join(native(table.table[id]) for id in ids)

    words = {name: table.table[f"colour.{name}"].title.split()[-1].capitalize() for name in COLOURS}
    views = [id for id in table.table if id.startswith("camera.") and id not in ("camera.follow", "camera.selected")]
    return SceneBar(
        [choice(name, f"colour.{name}", words[name]) for name in COLOURS],
        [choice(name, f"layer.{name}", LAYERS[name][0]) for name in LAYERS],
        [choice(id, id, table.table[id].title) for id in [*views, "camera.selected"]],
        {
            "tool": keys("tool.select"), "follow": keys("camera.follow"),
            "opacity": keys("body.less", "body.more"), "trail": keys("trails.shorter", "trails.longer"),
        },
    )  # fmt: skip


class SceneBarBinder:
    """Joins bar, display and scene."""

    def __init__(self, widget: SceneBar, scene: Scene3D, bench: Workbench, table: Actions) -> None:
        self.widget, self.scene, self.bench, self.table = widget, scene, bench, table
        display = bench.display
        display.changed.connect(lambda names: self.fill())
        widget.tool_toggled.connect(lambda on: self._switch("tool.select", on))
        widget.colour_chosen.connect(lambda name: self._switch(f"colour.{name}", True))
        widget.layer_toggled.connect(lambda name, on: self._switch(f"layer.{name}", on))
        widget.opacity_changed.connect(lambda share: table.do(BODY_OPACITY, share))
        widget.trail_changed.connect(lambda seconds: table.do(TRAIL_LENGTH, seconds))
        widget.follow_toggled.connect(lambda on: self._switch("camera.follow", on))
        widget.view_chosen.connect(lambda name: table.trigger(name))
        self.fill()

    def fill(self) -> None:
        """Show how the display stands."""
        display = self.bench.display
        shown = {name for name, on in display.layers.items() if on}
        self.widget.set_state(
            display.boxing, display.colour_by, shown, display.opacity, display.trail_s, display.follow
        )
        self.scene.set_tool("select" if display.boxing else "orbit")

    def _switch(self, name: str, on: bool) -> None:
        """Have an action that can be on or off as the control is."""
        if self.table.is_on(name) != on and not self.table.trigger(name):
            self.fill()
