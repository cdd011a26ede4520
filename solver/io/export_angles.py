"""Joint angles to files: a wide CSV with its sidecar, and a long one for statistics programs."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.plain import json_text
from markerscope.solver.io.atomic import write_text_atomic

AS_RECORDED = "angles_as_recorded.csv"
"""The file beside ``angles.csv`` where that is relative to a neutral pose."""


def write_angles(
    folder: str | Path,
    angles: JointAngles,
    provenance: Mapping[str, Any],
    evidence: Mapping[str, str] | None = None,
    errors: AngleErrors | None = None,
    columns: bool = False,
) -> None:
    """Write ``angles.csv`` (time in s, one column per angle in degrees, empty where singular) and ``angles.json``.

    Where angles are relative to a neutral pose, ``angles_as_recorded.csv`` has them as the convention counts them.

    Parameters
    ----------
    provenance : program version, digests of the inputs, settings of every stage
    evidence : what each angle rests on, by column name, as ``markerscope.solver.angles.angles.evidence`` gives it
    errors : standard errors, of which the sidecar has the root mean squares
    columns : whether ``angles.csv`` has them frame by frame, level and shape together, in columns ``NAME_se``
    """
    folder = Path(folder)
    relative = angles.zero == "neutral"
    write_text_atomic(folder / "angles.csv", angles_csv(angles, errors if columns else None))
    if relative:
        write_text_atomic(folder / AS_RECORDED, angles_csv(angles.as_recorded))
    about = {
        "convention": angles.convention,
        "title": angles.title,
        "zero": angles.zero,
        "zero_pose": angles.zero_pose,
        **({"neutral_pose": angles.neutral_pose} if relative else {}),
        **({"other_order": angles.hint} if angles.hint else {}),
        "units": {"time": "s", "angles": "degrees"},
        "filter": "not filtered",
        **({} if errors is None else {"noise": noise_of(errors)}),
        "angles": [
            {
                "column": name,
                "sequence": sequence,
                "positive": positive,
                "singular_frames": int(flags.sum()),
                "jumps_s": [round(float(t), 6) for t in angles.time[jumps]],
                **({"neutral_degrees": round(float(angles.neutral[i]), 4)} if relative else {}),
                **({} if evidence is None else {"evidence": evidence[name]}),
                **({} if errors is None else {"standard_error": standard_error(errors, name)}),
            }
            for i, (name, sequence, positive, flags, jumps) in enumerate(
                zip(angles.names, angles.sequence, angles.positive, angles.singular.T, angles.jumps.T, strict=True)
            )
        ],
        **provenance,
    }
    write_text_atomic(folder / "angles.json", json_text(about) + "\n")


def standard_error(errors: AngleErrors, name: str) -> dict[str, float | None]:
    """Degrees, root mean square over frames, of one angle: level, shape, and the definition's part of the level."""
    return {part: _rounded(value, 3) for part, value in errors.mean_of(name).items()}


def noise_of(errors: AngleErrors) -> dict[str, float | None]:
    """The noise a coordinate that the session showed: of markers, mm, of the video's joints, degrees, and landmarks."""
    return {name: _rounded(getattr(errors, name), 4) for name in ("marker_mm", "video_deg", "image_share")}


def _rounded(value: float, digits: int) -> float | None:
    return round(float(value), digits) if np.isfinite(value) else None


def angles_csv(angles: JointAngles, errors: AngleErrors | None = None) -> str:
    """The wide form: a header line, then a row per frame; with standard errors a column ``NAME_se`` for each angle."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    values, names = np.where(angles.singular, np.nan, angles.degrees), list(angles.names)
    if errors is not None:
        values = np.concatenate([values, errors.total], axis=1)
        names += [f"{name}_se" for name in angles.names]
    writer.writerow(["time", *names])
    for time, row in zip(angles.time, values, strict=True):
        writer.writerow([f"{time:.6f}", *("" if np.isnan(v) else f"{v:.4f}" for v in row)])
    return text.getvalue()


def angles_long_csv(angles: JointAngles) -> str:
    """The long form: a row per frame and angle, with its flag."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time", "angle", "degrees", "singular"])
    for i, time in enumerate(angles.time):
        for k, name in enumerate(angles.names):
            flag = bool(angles.singular[i, k])
            writer.writerow([f"{time:.6f}", name, "" if flag else f"{angles.degrees[i, k]:.4f}", int(flag)])
    return text.getvalue()
