"""C3D files byte by byte, with every fact open to contradiction; written apart from the program's own writer."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np


def group(identity: int, name: str) -> bytes:
    """A group record."""
    return struct.pack("bb", len(name), -identity) + name.encode() + struct.pack("<H", 3) + b"\0"


def parameter(identity: int, name: str, value: Any) -> bytes:
    """A parameter record: a list of texts, whole numbers or decimal numbers."""
    if isinstance(value, str):
        value = [value]
    if isinstance(value, Sequence):
        texts = [text.encode() for text in value]
        width = max(map(len, texts), default=0)
        content = struct.pack("b3B", -1, 2, width, len(texts)) + b"".join(text.ljust(width) for text in texts)
    else:
        array = np.asarray(value)
        kind, dtype = (4, "<f4") if array.dtype.kind == "f" else (2, "<i2")
        raw = (array if kind == 4 else (array + 32768) % 65536 - 32768).astype(dtype).tobytes()
        content = struct.pack("bB", kind, array.ndim) + bytes(array.shape) + raw
    content += b"\0"
    return struct.pack("bb", len(name), identity) + name.encode() + struct.pack("<H", 2 + len(content)) + content


def c3d_bytes(
    xyz: np.ndarray,
    *,
    word: np.ndarray | None = None,
    analog: np.ndarray | None = None,
    scale: float = -0.1,
    rate: float = 100.0,
    first: int = 1,
    header: Mapping[str, Any] | None = None,
    point: Mapping[str, Any] | None = None,
    groups: Mapping[str, Mapping[str, Any]] | None = None,
    behind: bytes = b"",
    more_blocks: int = 0,
) -> bytes:
    """A whole file.

    Parameters
    ----------
    xyz : (T, M, 3) mm
    word : (T, M) residual words
    analog : (T, samples, channels)
    header, point : what the header and the group POINT say instead of what is right; None leaves a parameter out
    groups : further groups
    behind : bytes behind the points
    more_blocks : empty blocks between parameters and data
    """
    frames, count = xyz.shape[:2]
    words = np.ones((frames, count)) if word is None else word
    counts = np.concatenate([xyz if scale < 0 else np.round(xyz / scale), words[..., None]], axis=2)
    rows = counts.reshape(frames, -1)
    samples, channels = (0, 0) if analog is None else analog.shape[1:]
    if analog is not None:
        rows = np.concatenate([rows, analog.reshape(frames, -1)], axis=1)
    body = rows.astype("<f4" if scale < 0 else "<i2").tobytes()
    said = {
        "USED": np.array(count), "SCALE": np.array(scale), "RATE": np.array(rate), "DATA_START": np.array(0),
        "FRAMES": np.array(min(frames, 65535)), "LABELS": [f"M{i}" for i in range(count)], "UNITS": "mm",
        "X_SCREEN": "+X", "Y_SCREEN": "+Z",
    }  # fmt: skip
    every: dict[str, Mapping[str, Any]] = {"POINT": said}
    if analog is not None:
        every["ANALOG"] = {
            "USED": np.array(channels), "RATE": np.array(rate * samples), "GEN_SCALE": np.array(1.0),
            "SCALE": np.ones(channels), "OFFSET": np.zeros(channels, dtype=int), "UNITS": ["V"] * channels,
            "LABELS": [f"A{i}" for i in range(channels)], "DESCRIPTIONS": ["-"] * channels,
        }  # fmt: skip
    every |= groups or {}
    blocks = -(-len(_section(every, point)) // 512)
    start = 2 + blocks + more_blocks
    said["DATA_START"] = np.array(start)
    section = _section(every, point)
    facts = {
        "count": count, "analog": samples * channels, "first": first, "last": min(first + frames - 1, 65535),
        "scale": scale, "block": start, "samples": samples, "rate": rate,
    } | dict(header or {})  # fmt: skip
    head = bytes([2, 80]) + struct.pack("<4HH", *(facts[k] % 65536 for k in ("count", "analog", "first", "last")), 10)
    head += struct.pack("<f2Hf", facts["scale"], facts["block"], facts["samples"], facts["rate"])
    top = head.ljust(512, b"\0") + (bytes([1, 80, blocks, 84]) + section[4:]).ljust((blocks + more_blocks) * 512, b"\0")
    whole = top + body + behind
    return whole.ljust(-(-len(whole) // 512) * 512, b"\0")


def _section(groups: Mapping[str, Mapping[str, Any]], point: Mapping[str, Any] | None) -> bytes:
    records = b""
    for identity, (name, parameters) in enumerate(groups.items(), 1):
        instead = dict(point or {}) if name == "POINT" else {}
        records += group(identity, name)
        said = {key: instead.get(key, value) for key, value in {**parameters, **instead}.items()}
        records += b"".join(parameter(identity, key, value) for key, value in said.items() if value is not None)
    return b"\0\0\0\0" + records + b"\0\0"
