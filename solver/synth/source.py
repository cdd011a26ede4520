"""The motion that a session is made from, as a user names it: a file, or one of the program's own."""

from __future__ import annotations

from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.asf_amc import read_asf_amc
from markerscope.solver.io.bvh import read_bvh
from markerscope.solver.io.motion import SkeletonMotion
from markerscope.solver.synth.acts import ACTS

_AMC_RATE = 120.0  # Hz, which the format does not tell


def read_source(
    name: str | Path, *, skeleton: str | Path | None = None, rate: float | None = None
) -> SkeletonMotion | str:
    """A recorded motion, or the name of one of ``ACTS``, as ``synthesise`` takes them.

    Parameters
    ----------
    name : a ``.bvh``, an ``.amc`` (its skeleton beside it), or one of ``ACTS``
    skeleton : the ``.asf`` of an ``.amc``
    rate : Hz of an ``.amc``, 120 where it is None

    Raises
    ------
    InputError : there is no such motion, or it cannot be read
    """
    path = Path(name)
    kind = path.suffix.lower()
    if str(name) in ACTS:
        return str(name)
    if not path.is_file():
        known = ", ".join(ACTS)
        raise InputError("it is neither a file nor a motion of the program's own", name, f"name a file, or {known}")
    if kind == ".bvh":
        return read_bvh(path)
    if kind != ".amc":
        raise InputError("a motion of this kind cannot be read", path, "name a .bvh, or an .amc with its .asf")
    asf = skeleton if skeleton is not None else skeleton_beside(path)
    if asf is None:
        raise InputError("its skeleton, an .asf file, is not beside it", path, "name it with --skeleton")
    return read_asf_amc(asf, path, rate=_AMC_RATE if rate is None else rate)


def skeleton_beside(amc: Path) -> Path | None:
    """The ASF in the folder of an AMC: the one whose name the AMC's begins with, else the only one."""
    beside = sorted((p for p in amc.parent.iterdir() if p.suffix.lower() == ".asf"), key=lambda p: len(p.stem))
    named = [path for path in beside if amc.stem.startswith(path.stem)]
    return named[-1] if named else beside[0] if len(beside) == 1 else None
