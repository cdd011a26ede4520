"""A known person as a file: what other trials of the same person need, and nothing of a recording."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.fit.kinematics import Points
from markerscope.solver.fit.known.body import KnownBody
from markerscope.solver.io.atomic import write_bytes_atomic

_FORMAT = "markerscope-person-1"
_NAMES = ("betas", "rest", "dirs", "weights", "markers", "poses", "off_m")
_REMEDY = "give the person.npz that a solve of a subject left"


def write_person(path: str | Path, known: KnownBody) -> None:
    """Write a person as an npz without pickles; the same person makes the same bytes.

    Raises
    ------
    InputError : the file system refuses
    """
    at = known.placement
    arrays = (known.betas, at.rest, at.dirs, at.weights, known.markers, known.poses, np.array(known.off_m))
    content = io.BytesIO()
    named: dict[str, Any] = {"format": np.array(_FORMAT), **dict(zip(_NAMES, arrays))}
    np.savez_compressed(content, **named)
    write_bytes_atomic(path, content.getvalue())


def read_person(path: str | Path, body: Body) -> KnownBody:
    """Read a person.

    Parameters
    ----------
    body : the one that the trials are solved with

    Raises
    ------
    InputError : the file is none, or was made with another body
    """
    try:
        with np.load(path, allow_pickle=False) as content:
            if str(content["format"]) != _FORMAT:
                raise InputError("holds no person that this version can read", path, _REMEDY)
            betas, rest, dirs, weights, markers, poses, off = (content[name] for name in _NAMES)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        raise InputError("holds no person", path, _REMEDY) from error
    count, shapes = len(rest), body.shape_count
    if betas.shape != (shapes,) or dirs.shape != (count, 3, shapes) or weights.shape != (count, 24):
        raise InputError("was made with another body", path, "solve the subject again with this body")
    if not all(np.isfinite(a).all() for a in (betas, rest, dirs, weights, poses)):
        raise InputError("is damaged: a number in it is not finite", path, _REMEDY)
    return KnownBody(betas, Points(rest, dirs, weights), markers, poses, float(off))
