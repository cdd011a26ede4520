"""A synthetic session as ordinary files, so that any program can be run on it; and back."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver import __version__
from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.io.atomic import write_text_atomic
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.io.together import together
from markerscope.solver.synth.session import SynthSession
from markerscope.solver.synth.settings import SynthSettings
from markerscope.solver.synth.truth import TRUTH, Truth, load_truth, save_truth

MARKERS, PRIOR, REFERENCE, ABOUT = "markers.c3d", "prior.npz", "reference.npz", "synth.json"
FILES = (MARKERS, PRIOR, TRUTH, REFERENCE, ABOUT)
"""What ``write_session`` writes, in this order: a folder that holds the last one is whole."""


def write_session(folder: str | Path, session: SynthSession) -> None:
    """Write ``FILES``, all of them or none.

    Raises
    ------
    InputError : there is something in the folder that is no session of this kind, or it cannot be written
    """
    folder = Path(folder)
    check_free(folder)
    with together(folder) as place:
        _write(place, session)


def check_free(folder: Path) -> None:
    """Refuse a folder whose content this module did not write."""
    if folder.is_dir() and not (folder / ABOUT).is_file() and any(folder.iterdir()):
        raise InputError("the folder is not empty and holds no synthetic session", folder, "name a new folder")


def _write(folder: Path, session: SynthSession) -> None:
    truth, prior = session.truth, session.prior
    write_c3d(folder / MARKERS, session.markers, up="z")
    betas = np.zeros(truth.body.betas_count) if prior.betas is None else prior.betas
    frames = len(prior.rotations)
    more: dict[str, Any] = {"tracked": prior.tracked, "time": prior.time, "shaped": prior.betas is not None}
    poses = log_so3(prior.rotations).reshape(frames, -1)
    write_smpl_npz(folder / PRIOR, poses, np.zeros((frames, 3)), betas, session.settings.rate, more)
    save_truth(folder / TRUTH, truth)
    _write_reference(folder / REFERENCE, truth)
    about = {
        "program": "markerscope",
        "version": __version__,
        "motion": session.motion,
        "seed": session.seed,
        "nominal_offset": session.nominal_offset,
        "true_offset": truth.offset,
        "settings": {k: str(v) if isinstance(v, Path) else v for k, v in asdict(session.settings).items()},
    }
    write_text_atomic(folder / ABOUT, json_text(about) + "\n")


def _write_reference(path: Path, truth: Truth) -> None:
    """The true motion in AMASS layout, on the embedded body in the shape that comes nearest to the true one."""
    plain = load_body()
    shape = nearest_shape(plain, truth)
    motion = truth.motion
    # The root joint of the nearest body is elsewhere at rest; where it is in the lab is what has to agree.
    trans = motion.trans + truth.body.joints(truth.betas)[0] - plain.joints(shape)[0]
    poses = log_so3(motion.rotations).reshape(len(trans), -1)
    more = {"time": motion.time, "joints": truth.joints, "bone_lengths": shape[plain.betas_count :]}
    write_smpl_npz(path, poses, trans, shape[: plain.betas_count], motion.rate, more)


def nearest_shape(body: Body, truth: Truth) -> np.ndarray:
    """(S,) coefficients of a body whose resting skin comes nearest to the true one, wherever it stands."""
    wanted = truth.body.surface(truth.betas) - body.template
    columns = body.shape_dirs - body.shape_dirs.mean(axis=0)
    matrix = columns.reshape(-1, body.shape_count)
    found: np.ndarray = np.linalg.lstsq(matrix, (wanted - wanted.mean(axis=0)).ravel(), rcond=None)[0]
    return found


def load_session(folder: str | Path) -> SynthSession:
    """Read what ``write_session`` wrote; positions and rotations are as exact as single precision.

    Raises
    ------
    InputError : it is no such folder, or a file in it is damaged
    """
    folder = Path(folder)
    about = _guarded(folder / ABOUT, _about)
    markers = load_markers(folder / MARKERS)
    prior = _guarded(folder / PRIOR, _prior)
    truth = load_truth(folder / TRUTH)
    settings = about["settings"]
    if settings.get("gap_statistics") is not None:
        settings["gap_statistics"] = Path(settings["gap_statistics"])
    unknown = set(settings) - {field.name for field in fields(SynthSettings)}
    if unknown:
        raise InputError(f'the setting "{min(unknown)}" is not known', folder / ABOUT, "make the session anew")
    return SynthSession(
        markers, prior, about["nominal_offset"], truth, SynthSettings(**settings), about["seed"], about["motion"]
    )


def _guarded(path: Path, read: Callable[[Path], Any]) -> Any:
    """What ``read`` makes of the file, or the sentence that it cannot."""
    try:
        return read(path)
    except (OSError, KeyError, ValueError, TypeError, EOFError, zipfile.BadZipFile) as error:
        raise InputError("it is not as synth writes it, or not there", path, "make the session anew") from error


def _about(path: Path) -> dict[str, Any]:
    about = json.loads(path.read_text(encoding="utf-8"))
    return {
        "settings": dict(about["settings"]),
        "seed": int(about["seed"]),
        "motion": str(about["motion"]),
        "nominal_offset": float(about["nominal_offset"]),
    }


def _prior(path: Path) -> PosePrior:
    with np.load(path, allow_pickle=False) as data:
        rotations = exp_so3(data["poses"].reshape(len(data["poses"]), -1, 3))
        betas = data["betas"] if data["shaped"] else None
        return PosePrior(rotations, data["tracked"], data["time"], betas, source=str(path))
