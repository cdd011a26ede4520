"""Markerscope: from unlabelled optical markers and one ordinary video to a body and its joint angles.

The names below are for scripts and notebooks, ``import markerscope as ms``; each is loaded when it is first used.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from markerscope.solver import __version__ as __version__
    from markerscope.solver.api.result import PosedBody as PosedBody
    from markerscope.solver.api.result import Result as Result
    from markerscope.solver.api.run import clean as clean
    from markerscope.solver.api.run import evaluate as evaluate
    from markerscope.solver.api.run import load_markers as load_markers
    from markerscope.solver.api.run import simulate as simulate
    from markerscope.solver.api.run import solve as solve
    from markerscope.solver.api.run import track_video as track_video
    from markerscope.solver.api.tables import AngleTable as AngleTable
    from markerscope.solver.api.tables import Points as Points
    from markerscope.solver.cleaning.clean import CleanSettings as CleanSettings
    from markerscope.solver.core.errors import Cancelled as Cancelled
    from markerscope.solver.core.errors import InputError as InputError
    from markerscope.solver.core.errors import MarkerscopeError as MarkerscopeError
    from markerscope.solver.core.markers import Markers as Markers

_WHERE = {
    "__version__": "solver",
    "AngleTable": "solver.api.tables",
    "Cancelled": "solver.core.errors",
    "CleanSettings": "solver.cleaning.clean",
    "InputError": "solver.core.errors",
    "Markers": "solver.core.markers",
    "MarkerscopeError": "solver.core.errors",
    "Points": "solver.api.tables",
    "PosedBody": "solver.api.result",
    "Result": "solver.api.result",
    "clean": "solver.api.run",
    "evaluate": "solver.api.run",
    "load_markers": "solver.api.run",
    "simulate": "solver.api.run",
    "solve": "solver.api.run",
    "track_video": "solver.api.run",
}
__all__ = [
    "AngleTable",
    "Cancelled",
    "CleanSettings",
    "InputError",
    "Markers",
    "MarkerscopeError",
    "Points",
    "PosedBody",
    "Result",
    "__version__",
    "clean",
    "evaluate",
    "load_markers",
    "simulate",
    "solve",
    "track_video",
]


def __getattr__(name: str) -> Any:
    """Load a public name when it is first asked for, so that the import itself costs nothing."""
    if name not in _WHERE:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(f"{__name__}.{_WHERE[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_WHERE})
