"""The movements that the sessions are made from: recorded ones from a folder, or the program's own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TypeVar

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.motion import SkeletonMotion
from markerscope.solver.pipeline.digest import digest_of, file_digest
from markerscope.solver.pipeline.source import changed
from markerscope.solver.synth.acts import ACTS

T = TypeVar("T")


@dataclass(frozen=True)
class MotionSource:
    """Where a movement comes from.

    Attributes
    ----------
    name : what the tables call it
    digest : of all that it is read or made from
    path : a BVH or AMC file; None for the program's own of that name
    skeleton : the ASF file of an AMC
    """

    name: str
    digest: str
    path: Path | None = None
    skeleton: Path | None = None


def find_motions(folder: Path | None, most: int) -> tuple[MotionSource, ...]:
    """The movements below a folder, ``most`` of them evenly spread over their names; the program's own without one.

    Raises
    ------
    InputError : there is no such folder, or no movement in it
    """
    if folder is None:
        return tuple(MotionSource(name, digest_of(["act", name])) for name in _spread(ACTS, most))
    if not folder.is_dir():
        raise InputError("there is no such folder", folder, "name a folder with .bvh or .amc files")
    paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".bvh", ".amc"))
    paths = [path for path in paths if path.suffix.lower() == ".bvh" or _skeleton_of(path) is not None]
    if not paths:
        raise InputError("holds no motion", folder, "name a folder with .bvh files, or .amc files and their .asf")
    return tuple(_source(path) for path in _spread(paths, most))


def _spread(items: Sequence[T], most: int) -> list[T]:
    """At most so many of them, evenly spread."""
    return [items[i] for i in np.unique(np.linspace(0, len(items) - 1, min(most, len(items))).round().astype(int))]


def _source(path: Path) -> MotionSource:
    skeleton = _skeleton_of(path) if path.suffix.lower() == ".amc" else None
    return MotionSource(path.stem, _digest(path, skeleton), path, skeleton)


def _digest(path: Path, skeleton: Path | None) -> str:
    return digest_of([file_digest(file) for file in (path, skeleton) if file is not None])


def _skeleton_of(amc: Path) -> Path | None:
    """The ASF beside an AMC: the one whose name begins the AMC's, else the only one."""
    beside = sorted((p for p in amc.parent.iterdir() if p.suffix.lower() == ".asf"), key=lambda p: len(p.stem))
    named = [path for path in beside if amc.stem.startswith(path.stem)]
    return named[-1] if named else beside[0] if len(beside) == 1 else None


@lru_cache(maxsize=4)
def read_source(source: MotionSource) -> SkeletonMotion | str:
    """The movement itself, or the name of one that the generator knows.

    Raises
    ------
    Changed : the file holds another movement than when it was found, so that its record would be under a wrong key
    """
    if source.path is None:
        return source.name
    motion = _read(source.path, source.skeleton)
    if _digest(source.path, source.skeleton) != source.digest:
        raise changed(source.path)
    return motion


def _read(path: Path, skeleton: Path | None) -> SkeletonMotion:
    if skeleton is not None:
        from markerscope.solver.io.asf_amc import read_asf_amc

        return read_asf_amc(skeleton, path)
    from markerscope.solver.io.bvh import read_bvh

    return read_bvh(path)
