"""The bar above the scene: what a drag does, colours, layers, the body's opacity, trails, and from where one looks."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

from PySide6.QtCore import QSignalBlocker, QSize, Qt, Signal
from PySide6.QtGui import QAction
from PySide6.QtWidgets import QComboBox, QDoubleSpinBox, QHBoxLayout, QLabel, QSlider, QToolButton, QWidget

from markerscope.widgets.icons import icon
from markerscope.widgets.menu_button import menu_button


@dataclass(frozen=True)
class Choice:
    """One of several: its name in the signals, its title, its keys in words, and what it means."""

    name: str
    title: str
    keys: str = ""
    help: str = ""


class SceneBar(QWidget):
    """Controls of the scene, narrow enough to stand above it.

    Signals
    -------
    tool_toggled(on) : whether a plain drag draws a box about markers
    colour_chosen(name), layer_toggled(name, on), view_chosen(name), follow_toggled(on)
    opacity_changed(share) : 0..1, of the body
    trail_changed(seconds) : how long the trails are
    """

    tool_toggled = Signal(bool)
    colour_chosen = Signal(str)
    layer_toggled = Signal(str, bool)
    view_chosen = Signal(str)
    follow_toggled = Signal(bool)
    opacity_changed = Signal(float)
    trail_changed = Signal(float)

    def __init__(
        self,
        colours: Sequence[Choice],
        layers: Sequence[Choice],
        views: Sequence[Choice],
        keys: dict[str, str] | None = None,
        parent: QWidget | None = None,
    ) -> None:
        super().__init__(parent)
        self.setAccessibleName("Scene controls")
        keys = keys or {}
        self.tool = _button("box", "Select by a box", f"A drag draws a box about markers{_said(keys.get('tool'))}")
        self.tool.setCheckable(True)
        self.tool.toggled.connect(self.tool_toggled)
        self.colour = QComboBox()
        self.colour.setAccessibleName("Colour of the markers")
        for choice in colours:
            self.colour.addItem(choice.title, choice.name)
            tip = f"{choice.help}{_said(choice.keys)}"
            self.colour.setItemData(self.colour.count() - 1, tip, Qt.ItemDataRole.ToolTipRole)
        listed = ", ".join(f"{choice.title} {choice.keys}" for choice in colours if choice.keys)
        self.colour.setToolTip(f"What the colours of the markers mean ({listed})")
        self.colour.activated.connect(lambda k: self.colour_chosen.emit(self.colour.itemData(k)))
        self.layers = menu_button("Layers", "What is shown in the scene and in the video")
        self.actions_of_layers = {choice.name: self._layer(choice) for choice in layers}
        self.views = menu_button("View", "From where one looks at the scene")
        self.actions_of_views = {choice.name: self._view(choice) for choice in views}
        self.follow = _button("target", "Follow the person", f"The camera goes along{_said(keys.get('follow'))}")
        self.follow.setCheckable(True)
        self.follow.toggled.connect(self.follow_toggled)
        self.opacity = QSlider(Qt.Orientation.Horizontal)
        self.opacity.setRange(0, 100)
        self.opacity.setPageStep(20)
        self.opacity.setMinimumWidth(3 * self.fontMetrics().height())
        self.opacity.setMaximumWidth(9 * self.fontMetrics().height())
        self.opacity.setAccessibleName("Opacity of the body, per cent")
        self._opacity_keys = _said(keys.get("opacity"))
        self.opacity.valueChanged.connect(self._opacity)
        self.trail = QDoubleSpinBox()
        self.trail.setRange(0.0, 10.0)
        self.trail.setDecimals(1)
        self.trail.setSingleStep(0.1)
        self.trail.setSuffix(" s")
        self.trail.setKeyboardTracking(False)
        self.trail.setAccessibleName("Length of the trails, seconds")
        self.trail.setToolTip(f"How far back the trails of the markers reach, in seconds{_said(keys.get('trail'))}")
        self.trail.valueChanged.connect(self.trail_changed)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(4, 2, 4, 2)
        layout.setSpacing(4)
        parts: list[QWidget] = [self.tool, self.colour, self.layers, _sign("body", self), self.opacity]
        for part in [*parts, _sign("trails", self), self.trail, self.views, self.follow]:
            layout.addWidget(part)
        layout.addStretch(1)
        self.set_state(False, "", (), 1.0, 0.0, False)

    def set_state(
        self, tool: bool, colour: str, layers: Collection[str], opacity: float, trail: float, follow: bool
    ) -> None:
        """Show how it stands, ``layers`` being those that are shown; nothing is emitted."""
        for button, on in ((self.tool, tool), (self.follow, follow)):
            with QSignalBlocker(button):
                button.setChecked(on)
        with QSignalBlocker(self.colour):
            self.colour.setCurrentIndex(self.colour.findData(colour))
        for name, action in self.actions_of_layers.items():
            with QSignalBlocker(action):
                action.setChecked(name in layers)
        with QSignalBlocker(self.opacity):
            self.opacity.setValue(round(100 * opacity))
        self.opacity.setToolTip(f"Opacity of the body: {self.opacity.value()} %{self._opacity_keys}")
        with QSignalBlocker(self.trail):
            self.trail.setValue(trail)

    def minimumSizeHint(self) -> QSize:
        """No narrower than its controls, which decide no more than the scene does."""
        return self.layout().minimumSize()  # type: ignore[union-attr]

    def _opacity(self, value: int) -> None:
        self.opacity.setToolTip(f"Opacity of the body: {value} %{self._opacity_keys}")
        self.opacity_changed.emit(value / 100)

    def _layer(self, choice: Choice) -> QAction:
        action = self.layers.menu().addAction(_item(choice))
        action.setCheckable(True)
        action.setToolTip(choice.help)
        action.toggled.connect(lambda on: self.layer_toggled.emit(choice.name, on))
        return action

    def _view(self, choice: Choice) -> QAction:
        action = self.views.menu().addAction(_item(choice), lambda: self.view_chosen.emit(choice.name))
        action.setToolTip(choice.help)
        return action


def _button(glyph: str, name: str, tip: str) -> QToolButton:
    button = QToolButton()
    button.setIcon(icon(glyph))
    button.setAutoRaise(True)
    button.setAccessibleName(name)
    button.setToolTip(tip)
    button.setFocusPolicy(Qt.FocusPolicy.StrongFocus)
    return button


def _sign(glyph: str, owner: QWidget) -> QLabel:
    label = QLabel()
    side = owner.fontMetrics().height()
    label.setPixmap(icon(glyph, "faint").pixmap(QSize(side, side)))
    return label


def _item(choice: Choice) -> str:
    """The text of a menu's entry; the keys behind the tab are only said here, the window has them."""
    return f"{choice.title}\t{choice.keys}" if choice.keys else choice.title


def _said(keys: str | None) -> str:
    return f" ({keys})" if keys else ""
