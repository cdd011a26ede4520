"""A look at the small files of a session before anything stands on them: what cannot be used is refused at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any


def look_at(files: Mapping[str, Path | None]) -> None:
    """Read the camera, body, pose prior and weights among some files, by the names of their sources.

    Raises
    ------
    InputError : one of them cannot be used
    """
    for name, reader in _READERS.items():
        path = files.get(name)
        if path is not None:
            reader(path)


def _camera(path: Path) -> Any:
    from markerscope.solver.io.camera import read_camera

    return read_camera(path)


def _body(path: Path) -> Any:
    from markerscope.solver.body.model import Body

    return Body.load(path)


def _prior(path: Path) -> Any:
    from markerscope.solver.io.priors import load_prior

    return load_prior(path)


def _weights(path: Path) -> Any:
    from markerscope.solver.neural.weights import read_card

    return read_card(path)


_READERS: dict[str, Callable[[Path], Any]] = {
    "camera_file": _camera,
    "body_file": _body,
    "prior_file": _prior,
    "weights_file": _weights,
}
