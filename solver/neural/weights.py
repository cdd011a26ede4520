"""Weights of a network in a file that runs no code when it is read, with a card that says what they are."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from markerscope.solver import __version__
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.plain import json_text
from markerscope.solver.io.atomic import write_bytes_atomic

if TYPE_CHECKING:
    from torch import Tensor

_CARD = "card"
_AGAIN = "train it again, or name another file"
_LONGEST_HEADER = 10_000_000


@dataclass(frozen=True)
class Card:
    """What weights are.

    Attributes
    ----------
    network : which one: "heterogeneous", "occlusion", ...
    config : all that it takes to build it: sizes, graphs; plain JSON
    layout : digest of the layout that it was trained for; empty for one that takes any
    labels : of that layout's markers
    data : what it was trained on, a line each, with licences where they are known
    figures : how good it was on what it had not seen, by name
    seed : of its training
    steps, seconds : of its training
    date : UTC, ISO 8601
    version : of the program
    """

    network: str
    config: Mapping[str, Any]
    layout: str
    labels: tuple[str, ...]
    data: tuple[str, ...]
    figures: Mapping[str, float]
    seed: int
    steps: int
    seconds: float
    date: str = ""
    version: str = __version__


def require_torch() -> None:
    """Say what is missing.

    Raises
    ------
    InputError : torch is not there
    """
    try:
        import torch  # noqa: F401
    except ImportError as error:
        raise InputError("networks need torch, which is not installed", None, "pip install torch") from error


def save_weights(path: str | Path, params: Mapping[str, Tensor], card: Card) -> Card:
    """Write weights and their card, dated now; the card as written."""
    from safetensors.torch import save

    if not card.date:
        card = Card(**asdict(card) | {"date": datetime.now(UTC).isoformat(timespec="seconds")})
    tensors = {name: value.detach().contiguous() for name, value in params.items()}
    write_bytes_atomic(path, save(tensors, {_CARD: json_text(asdict(card), indent=None)}))
    return card


def read_card(path: str | Path) -> Card:
    """The card alone; quick, and without torch.

    Raises
    ------
    InputError : the file holds no weights of ours
    """
    try:
        with open(path, "rb") as file:
            (length,) = struct.unpack("<Q", file.read(8))
            if length > _LONGEST_HEADER:
                raise ValueError("header")
            header = json.loads(file.read(length))
        said = json.loads(header["__metadata__"][_CARD])
        card = Card(**said | {"labels": tuple(said["labels"]), "data": tuple(said["data"])})
        if not (isinstance(card.config, dict) and isinstance(card.figures, dict) and isinstance(card.network, str)):
            raise ValueError("card")
        return card
    except FileNotFoundError as error:
        raise InputError("there is no such file", path, "check the name and the folder") from error
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}", path, "check its permissions") from error
    except (ValueError, KeyError, TypeError, AttributeError, struct.error) as error:
        raise InputError("holds no weights of Markerscope", path, _AGAIN) from error


def load_weights(
    path: str | Path, *, network: str | None = None, layout: str | None = None
) -> tuple[dict[str, Tensor], Card]:
    """Weights and their card.

    Parameters
    ----------
    network : the kind that is wanted; None takes any
    layout : digest of the layout that they are to be used for; None takes any

    Raises
    ------
    InputError : the file holds no weights of ours, or those of another network or layout; or torch is not there
    """
    card = read_card(path)
    if network is not None and card.network != network:
        what = f'holds the weights of a network of the kind "{card.network}", not "{network}"'
        raise InputError(what, path, "name another file")
    if layout is not None and card.layout and card.layout != layout:
        what = f"was trained for another layout of {len(card.labels)} markers ({card.layout}, this one is {layout})"
        raise InputError(what, path, "train a network on this layout")
    require_torch()
    from safetensors import SafetensorError
    from safetensors.torch import load

    try:
        return load(Path(path).read_bytes()), card
    except (SafetensorError, ValueError, KeyError, RuntimeError) as error:
        raise InputError("is damaged or cut off", path, _AGAIN) from error
