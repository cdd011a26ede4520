"""What is selected: one selection, which every view shows and every view can change."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from typing import Any, Literal

import numpy as np

from markerscope.app.models.signal import Signal

How = Literal["replace", "add", "remove", "toggle"]
_SINGLE = ("candidate", "hypothesis", "iteration", "stage")


class Selection:
    """Markers, and what they have in common; a candidate, a hypothesis, an iteration, a stage.

    Attributes
    ----------
    markers : the selected markers, by column
    cluster, bone : those of all selected markers, where they share one; a bone can be selected without markers
    candidate, hypothesis : rows
    iteration : of the optimisation that is looked into
    stage : name
    changed : emitted with the names of what changed
    """

    def __init__(self) -> None:
        self.changed: Signal[[frozenset[str]]] = Signal()
        self.markers: frozenset[int] = frozenset()
        self.bone: int | None = None
        self.candidate: int | None = None
        self.hypothesis: int | None = None
        self.iteration: int | None = None
        self.stage: str | None = None
        self._clusters = self._bones = np.zeros(0, int)

    @property
    def cluster(self) -> int | None:
        """The cluster of all selected markers, None where they have no common one."""
        return self._common(self._clusters)

    @property
    def pair(self) -> tuple[int, int] | None:
        """The two selected markers, None where there are not two."""
        first, *rest = sorted(self.markers) or [-1]
        return (first, rest[0]) if len(rest) == 1 else None

    def set_groups(self, clusters: np.ndarray | None, bones: np.ndarray | None) -> None:
        """Say which cluster and which bone each marker belongs to, (M,), -1 for none; None if that is not known."""
        before = self.cluster
        self._clusters = np.zeros(0, int) if clusters is None else np.asarray(clusters)
        self._bones = np.zeros(0, int) if bones is None else np.asarray(bones)
        names = {"cluster"} if self.cluster != before else set()
        bone = self._common(self._bones)
        if self.markers and bone != self.bone:
            self.bone = bone
            names.add("bone")
        self._tell(names)

    def select_markers(self, markers: Iterable[int], how: How = "replace") -> None:
        """Select markers, by column."""
        given = frozenset(int(m) for m in markers)
        chosen = {
            "replace": given,
            "add": self.markers | given,
            "remove": self.markers - given,
            "toggle": self.markers ^ given,
        }[how]
        before = self.markers, self.cluster, self.pair, self.bone
        self.markers = chosen
        self.bone = self._common(self._bones)
        after = self.markers, self.cluster, self.pair, self.bone
        self._tell({name for name, a, b in zip(("markers", "cluster", "pair", "bone"), before, after) if a != b})

    def select_cluster(self, cluster: int, how: How = "replace") -> None:
        """Select the markers of a cluster."""
        self.select_markers(np.flatnonzero(self._clusters == cluster), how)

    def select_bone(self, bone: int, how: How = "replace") -> None:
        """Select the markers on a bone, and the bone even if it carries none."""
        self.select_markers(np.flatnonzero(self._bones == bone), how)
        if how in ("replace", "add") and not self.markers and self.bone != bone:
            self.bone = bone
            self._tell({"bone"})

    def select(self, **chosen: Any) -> None:
        """Select a candidate, hypothesis, iteration or stage by name; None selects none of them."""
        if not chosen.keys() <= set(_SINGLE):
            raise TypeError(f"nothing to select is called {', '.join(sorted(chosen.keys() - set(_SINGLE)))}")
        names = {name for name, value in chosen.items() if getattr(self, name) != value}
        for name in names:
            setattr(self, name, chosen[name])
        self._tell(names)

    def clear(self) -> None:
        """Select nothing."""
        self.select_markers(())
        self.select(candidate=None, hypothesis=None, iteration=None)

    def keep_within(self, markers: int) -> None:
        """Forget markers that there are not, after other data was opened."""
        self.select_markers(m for m in self.markers if m < markers)

    def state(self) -> dict[str, Any]:
        """What to write down, so that ``restore`` brings it back."""
        return {"markers": sorted(self.markers), "bone": self.bone, **{name: getattr(self, name) for name in _SINGLE}}

    def restore(self, state: Mapping[str, Any]) -> None:
        """Select what ``state`` gave; what cannot be understood is left out."""
        markers = state.get("markers", ())
        self.select_markers(_numbers(markers))
        bone = state.get("bone")
        if not self.markers and isinstance(bone, int):
            self.select_bone(bone)
        kinds: dict[str, type] = {name: str if name == "stage" else int for name in _SINGLE}
        self.select(**{n: v for n, v in state.items() if n in kinds and isinstance(v, kinds[n] | None)})

    def _common(self, groups: np.ndarray) -> int | None:
        found = {int(groups[m]) for m in self.markers if m < len(groups)}
        return next(iter(found)) if len(found) == 1 and -1 not in found else None

    def _tell(self, names: Collection[str]) -> None:
        if names:
            self.changed.emit(frozenset(names))


def _numbers(value: Any) -> list[int]:
    return [v for v in value if type(v) is int and v >= 0] if isinstance(value, list | tuple) else []
