"""Tell whose reconstruction a file is by its contents, and read it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.io.priors.formats import read_amass, read_gvhmr, read_phalp, read_tram, read_wham
from markerscope.solver.io.priors.track import Track, complete
from markerscope.solver.safe_pickle import load_untrusted

Reader = Callable[[dict[Any, Any], str], Track]


def load_prior(path: str | Path, *, fps: float | None = None) -> PosePrior:
    """Body poses that another program reconstructed from the video.

    Parameters
    ----------
    path : a 4D-Humans/PHALP or WHAM ``.pkl``, a GVHMR ``.pt``, a TRAM ``.npy``, or an ``.npz`` in AMASS layout
    fps : Hz, the video's frame rate, for files that do not say it; 30 is assumed where neither does

    Returns
    -------
    PosePrior
        Its time is the frame's index over the frame rate. Shape coefficients come with the kind of body that they
        belong to, and mean nothing on another. ``notes`` says what was assumed.

    Raises
    ------
    InputError
        Where the file cannot be read, is of no known kind, or holds no usable pose.
    """
    where = str(path)
    data = load_untrusted(path)
    program, reader = _recognise(data, where)
    try:
        track = reader(data, where)
        if not len(track.frames):
            raise InputError("it has no frames", where, "export the reconstruction again")
        prior = complete(track, fps, where)
    except (ValueError, TypeError, IndexError, KeyError, OverflowError):
        raise InputError(
            f"its {program} fields are not as that program writes them", where, "export it again"
        ) from None
    return replace(prior, notes=(f"Read as {program}.", *prior.notes))


def _recognise(data: Any, where: str) -> tuple[str, Reader]:
    if isinstance(data, dict) and data:
        inner = [set(value) for value in data.values() if isinstance(value, dict)]
        for program, fits, reader in (
            ("an AMASS-layout file", "poses" in data or {"root_orient", "pose_body"} <= set(data), read_amass),
            ("GVHMR", bool({"smpl_params_incam", "smpl_params_global"} & set(data)), read_gvhmr),
            ("TRAM", "pred_rotmat" in data, read_tram),
            ("4D-Humans/PHALP", any({"smpl", "tid"} <= keys for keys in inner), read_phalp),
            ("WHAM", len(inner) == len(data) and all("pose" in keys for keys in inner), read_wham),
        ):
            if fits:
                return program, reader
    raise InputError(
        "it holds no body poses in a known layout",
        where,
        "use the output of 4D-Humans/PHALP, WHAM, GVHMR or TRAM, or an npz with 'poses' and 'mocap_frame_rate'",
    )
