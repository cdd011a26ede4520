"""The settings of stages as records that a form can be made from: label, unit, range, default, meaning."""

from __future__ import annotations

import dataclasses
import re
import types
import typing
from collections.abc import Hashable
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from markerscope.app.models.ranges import RANGES
from markerscope.solver.fit.counting import candidate_number

Kind = Literal["float", "int", "bool", "choice", "text"]

TITLES = {
    "markers": "Markers",
    "clean": "Cleaning",
    "landmarks": "Video landmarks",
    "prior": "Pose prior",
    "sync": "Synchronisation",
    "segment": "Segmentation",
    "localize": "Localization",
    "solve": "Solving",
    "orient": "Orientation",
    "known": "Known person",
    "network": "Network",
    "fit": "Fit",
    "neutral": "Neutral pose",
    "angles": "Joint angles",
    "errors": "Standard errors",
    "surface": "Distance to the skin",
    "check": "Doubts",
}
_COUNTED = "fit", "candidate"
"""The setting that is a row, and is shown as a candidate's number."""
_UNITS = {"m": "m", "mm": "mm", "s": "s", "Hz": "Hz", "px": "px", "degrees": "deg", "degree": "deg"}
_SUFFIXES = {"_mm": "mm", "_deg": "deg", "_s": "s", "_px": "px", "_hz": "Hz"}
_STARTS_WITH_UNIT = re.compile(rf"({'|'.join(_UNITS)})(?:$|[,;:.]\s*|\s+(?=in the ))")


@dataclass(frozen=True)
class Setting:
    """One setting of a stage, as it stands.

    Attributes
    ----------
    stage, name : which
    label : name in words
    kind : of value
    value, default : in ``unit``; None where it is left to the program
    unit : as shown; lengths in mm, whatever the solver counts in
    minimum, maximum : in ``unit``, None for kinds that have no range
    choices : the values of a choice
    optional : whether None may be chosen
    help : what it means
    decided : whether the value is a decision by hand, laid over the settings
    factor, first : shown value = factor * the solver's + first
    """

    stage: str
    name: str
    label: str
    kind: Kind
    value: Any
    default: Any
    unit: str = ""
    minimum: float | None = None
    maximum: float | None = None
    choices: tuple[str, ...] = ()
    optional: bool = False
    help: str = ""
    decided: bool = False
    factor: float = 1.0
    first: int = 0

    @property
    def changed(self) -> bool:
        """Whether it differs from its default."""
        return bool(self.value != self.default)

    def inner(self, shown: Any) -> Any:
        """A shown value as the solver counts it."""
        if shown is None or self.kind not in ("float", "int"):
            return shown
        return int(shown) - self.first if self.kind == "int" else _tidy(float(shown) / self.factor)

    def said(self, shown: Any) -> str:
        """A shown value in words, with its unit."""
        if shown is None:
            return "automatic"
        if isinstance(shown, bool):
            return "on" if shown else "off"
        return f"{shown:g} {self.unit}".rstrip() if isinstance(shown, int | float) else str(shown)


def title(stage: str) -> str:
    """A stage's name as the user reads it."""
    return TITLES.get(stage, stage.replace("_", " ").capitalize())


def settings_of(stage: str, settings: Any, decided: frozenset[str] = frozenset()) -> tuple[Setting, ...]:
    """The records of a settings dataclass; what no form can show (lists of edits) is left out.

    Parameters
    ----------
    settings : as they are
    decided : names of those decided by hand
    """
    cls: type = type(settings)
    hints, texts, default = _hints(cls), _descriptions(cls), cls()
    found = []
    for field in dataclasses.fields(cls):
        kind, choices, optional = _kind(hints[field.name])
        if kind is None:
            continue
        unit, text = _unit(field.name, texts.get(field.name, ""))
        unit, factor = ("mm", 1000.0) if unit == "m" else (unit, 1.0)
        first = candidate_number(0) if (stage, field.name) == _COUNTED else 0
        value, standard = (
            _tidy(v * factor) if isinstance(v, float) else v + first if first and v is not None else v
            for v in (getattr(settings, field.name), getattr(default, field.name))
        )
        low, high = (end if end is None else end + first for end in _range(stage, field.name, kind, standard, factor))
        found.append(
            Setting(
                stage,
                field.name,
                _label(field.name),
                kind,
                value,
                standard,
                unit,
                low,
                high,
                choices,
                optional,
                text,
                field.name in decided,
                factor,
                first,
            )
        )
    return tuple(found)


def setting_of(stage: str, settings: Any, name: str) -> Setting:
    """One record of a settings dataclass."""
    return next(setting for setting in settings_of(stage, settings) if setting.name == name)


def descriptions(cls: type) -> dict[str, str]:
    """What a dataclass's docstring, and those of the classes it extends, say of each of its fields."""
    return _descriptions(cls)


@cache
def _hints(cls: Hashable) -> dict[str, Any]:
    return typing.get_type_hints(cls)


@cache
def _descriptions(cls: Hashable) -> dict[str, str]:
    found: dict[str, str] = {}
    for base in reversed(typing.cast(type, cls).__mro__):
        found |= _attributes(base.__dict__.get("__doc__") or "")
    return found


def _attributes(doc: str) -> dict[str, str]:
    lines = doc.expandtabs().splitlines()
    rules = [i for i, line in enumerate(lines) if line.strip() and not line.strip("- ")]
    starts = [i + 1 for i in rules if lines[i - 1].strip() == "Attributes"]
    if not starts:
        return {}
    margin = len(lines[starts[0] - 1]) - len(lines[starts[0] - 1].lstrip())
    found: dict[str, str] = {}
    names: list[str] = []
    for line in lines[starts[0] :]:
        depth = len(line) - len(line.lstrip())
        if not line.strip() or depth < margin:
            break
        if depth == margin and " : " in line:
            head, text = line.strip().split(" : ", 1)
            names = [name.strip() for name in head.split(",")]
            found |= dict.fromkeys(names, text)
        else:
            found |= {name: f"{found[name]} {line.strip()}" for name in names}
    return found


def _unit(name: str, text: str) -> tuple[str, str]:
    """The unit of a setting, and its description without it, as a sentence."""
    unit = next((unit for suffix, unit in _SUFFIXES.items() if name.endswith(suffix)), "")
    stated = _STARTS_WITH_UNIT.match(text)
    if stated is not None:
        unit, text = _UNITS[stated[1]], text[stated.end() :]
    text = text.replace("``", "").strip()
    return unit, f"{text[:1].upper()}{text[1:]}."[: None if not text.endswith(".") else -1] if text else ""


def _label(name: str) -> str:
    for suffix in _SUFFIXES:
        name = name.removesuffix(suffix)
    return name.replace("_", " ")


def _kind(hint: Any) -> tuple[Kind | None, tuple[str, ...], bool]:
    """What kind of value an annotation wants, its choices, and whether it may be None."""
    optional = False
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        inner = [argument for argument in typing.get_args(hint) if argument is not type(None)]
        optional = len(inner) < len(typing.get_args(hint))
        if len(inner) != 1:
            return None, (), optional
        hint = inner[0]
    if typing.get_origin(hint) is Literal:
        return "choice", tuple(str(value) for value in typing.get_args(hint)), optional
    kinds: dict[Any, Kind] = {bool: "bool", int: "int", float: "float", str: "text"}
    return kinds.get(hint), (), optional


def _range(stage: str, name: str, kind: Kind, standard: Any, factor: float) -> tuple[float | None, float | None]:
    """The least and the greatest value a form offers, as shown."""
    if kind not in ("float", "int"):
        return None, None
    low, high = RANGES.get((stage, name), (None, None))
    if low is None or high is None:
        signed = standard is None or standard < 0
        return (-1e6 if signed else 0.0), max(1e6, 100 * abs(standard or 0))
    return _tidy(low * factor), _tidy(high * factor)


def _tidy(value: float) -> float:
    """Without the digits that changing units leaves behind."""
    return float(f"{value:.12g}")
