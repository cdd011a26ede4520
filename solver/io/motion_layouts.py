"""How other programs call the arrays of a body motion, told in the words of AMASS."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

_RATES = ("mocap_frame_rate", "mocap_framerate", "fps")


def as_amass(data: dict[Any, Any]) -> dict[str, Any]:
    """The same motion under the names of AMASS; what is in no known layout comes back as it is."""
    named = {str(name): value for name, value in data.items()}
    for fits, told in _LAYOUTS:
        if fits <= set(named):
            return told(named)
    return named


def model_of(data: dict[str, Any]) -> str:
    """The body model that a file says its shape belongs to; blank where it does not say."""
    name = data.get("surface_model_type", "")
    named = str(name) if np.size(name) == 1 else ""
    return named or ("smplx" if "fullpose" in data else "")


def _stage_two(data: dict[str, Any]) -> dict[str, Any]:
    """MoSh++ and SOMA, ``*_stageii.pkl``: ``fullpose`` (T, 156 | 165), the rate among the details of the fit."""
    told = {**data, "poses": data["fullpose"]}
    details = data.get("stageii_debug_details")
    if not any(name in data for name in _RATES) and isinstance(details, dict):
        told |= {name: details[name] for name in _RATES if name in details}
    return told


def _split(data: dict[str, Any]) -> dict[str, Any]:
    """AMASS for SMPL-X, should only the separate poses be there."""
    pieces = [np.asarray(data[name]) for name in ("root_orient", "pose_body")]
    if any(piece.ndim != 2 for piece in pieces) or len({len(piece) for piece in pieces}) != 1:
        return data
    return {**data, "poses": np.concatenate(pieces, axis=1)}


_LAYOUTS: tuple[tuple[set[str], Callable[[dict[str, Any]], dict[str, Any]]], ...] = (
    ({"poses"}, dict),
    ({"fullpose"}, _stage_two),
    ({"root_orient", "pose_body"}, _split),
)
