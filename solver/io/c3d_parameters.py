"""The parameter section of a C3D file: its records one by one, and their values."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError

BLOCK = 512
INTEL, DEC, MIPS = 84, 85, 86
Value = tuple[str, ...] | np.ndarray
"""Text, or numbers as a flat float array."""
_TYPES = {-1: "S1", 1: "i1", 2: "i2", 4: "f4"}


@dataclass(frozen=True)
class Record:
    """One group or parameter as it stands in the file.

    Attributes
    ----------
    identity : negative for a group, else of the group that the parameter belongs to
    raw : bytes of the name as they stand there (a minus before its length, which locks it, is in ``locked``)
    content : bytes after the link to the next record
    at : byte of the file at which the content begins
    """

    identity: int
    raw: bytes
    content: bytes
    locked: bool = False
    at: int = 0

    @property
    def name(self) -> str:
        """In capitals, without blanks at the ends."""
        return clean(self.raw).upper()


@dataclass(frozen=True)
class Section:
    """A parameter section that was read.

    Attributes
    ----------
    records : in the file's order
    values : by (GROUP, NAME)
    block, blocks : number of its first block (from 1) and how many it says it has
    processor : which machine's numbers the file holds
    notes : what could not be read, one sentence each
    """

    records: tuple[Record, ...]
    values: Mapping[tuple[str, str], Value]
    block: int
    blocks: int
    processor: int
    notes: tuple[str, ...] = ()

    @property
    def order(self) -> str:
        """Byte order as ``struct`` calls it."""
        return ">" if self.processor == MIPS else "<"

    def text(self, group: str, name: str) -> tuple[str, ...]:
        """Text of a parameter and of its continuations (``LABELS2``, ...), empty where absent."""
        found: list[str] = []
        for suffix in ("", *map(str, range(2, 1000))):
            value = self.values.get((group, name + suffix))
            if not isinstance(value, tuple):
                break
            found += value
        return tuple(found)

    def text_of(self, group: str, name: str) -> tuple[str, ...]:
        """Text of one parameter, empty where absent."""
        value = self.values.get((group, name))
        return value if isinstance(value, tuple) else ()

    def numbers(self, group: str, name: str) -> np.ndarray:
        """Numbers of a parameter, empty where absent."""
        value = self.values.get((group, name))
        return value if isinstance(value, np.ndarray) else np.zeros(0)

    def record(self, group: str, name: str) -> Record | None:
        """The record of a parameter, None where absent."""
        identities = {-record.identity for record in self.records if record.identity < 0 and record.name == group}
        return next((r for r in self.records if r.identity in identities and r.name == name), None)

    def count(self, group: str, name: str) -> int | None:
        """A count of 16 bits without sign, None where absent."""
        value = self.numbers(group, name)[:1]
        return int(value[0]) % 65536 if value.size and np.isfinite(value[0]) else None

    def number(self, group: str, name: str) -> float | None:
        """The first number of a parameter, None where absent or no number."""
        value = self.numbers(group, name)[:1]
        return float(value[0]) if value.size and np.isfinite(value[0]) else None


def read_section(data: bytes, path: str | Path) -> Section:
    """The records of a file's parameter section, as far as they can be followed.

    A record that cannot be read does not cost those before it, nor the points: it is said in the notes.

    Raises
    ------
    InputError : there is no such section, or the file ends inside it
    """
    block = data[0] or 2
    start = (block - 1) * BLOCK
    section = data[start : start + 255 * BLOCK]
    if len(section) < 8:
        raise InputError("is cut off before the C3D parameters", path, "copy or export it again")
    processor, blocks = section[3], section[2]
    if processor not in (INTEL, DEC, MIPS):
        raise InputError("is damaged: its C3D parameter section has no valid header", path, "export it again")
    cut = start + blocks * BLOCK > len(data)
    order = ">" if processor == MIPS else "<"
    records: list[Record] = []
    at, broken = 4, ""
    while at + 2 <= len(section):
        length, identity = struct.unpack_from("bb", section, at)
        size = abs(length)
        if size == 0 or identity == 0:
            break
        link = at + 2 + size
        offset = struct.unpack_from(order + "H", section, link)[0] if link + 2 <= len(section) else 1
        stop = link + offset
        if offset == 0:  # the last one says no more, so that its end follows from what it holds
            stop = link + 2 + _held(section, link + 2, identity)
        elif offset == 1 or stop > len(section):
            if cut:
                raise InputError("is cut off within the C3D parameters", path, "copy or export it again")
            broken = clean(section[at + 2 : link]).upper() or "?"
            break
        raw = section[at + 2 : link]
        records.append(Record(identity, raw, section[link + 2 : stop], length < 0, start + link + 2))
        if offset == 0:
            break
        at = stop
    values, unread = _values(records, order, processor == DEC)
    notes: tuple[str, ...] = ()
    if broken:
        notes += (f"The C3D parameters are damaged at {_shown(broken)}; those behind it could not be read.",)
    if unread:
        notes += (f"The C3D parameters {_listed(unread)} are damaged and were left aside.",)
    return Section(tuple(records), values, block, blocks, processor, notes)


def _shown(name: str) -> str:
    return name if name.isprintable() and name else "an unreadable name"


def _listed(names: list[str], most: int = 5) -> str:
    shown = [_shown(name) for name in names[:most]]
    return ", ".join(shown) + (f" and {len(names) - most} more" if len(names) > most else "")


def _values(records: list[Record], order: str, dec: bool) -> tuple[dict[tuple[str, str], Value], list[str]]:
    """Values by group and name, and the names of parameters that hold none."""
    groups = {-record.identity: record.name for record in records if record.identity < 0}
    values: dict[tuple[str, str], Value] = {}
    unread = []
    for record in records:
        if record.identity < 0:
            continue
        group = groups.get(record.identity, "?")
        value = decode_value(record.content, order, dec)
        if value is None:
            unread.append(f"{group}:{record.name}")
        else:
            values[group, record.name] = value
    return values, unread


def _held(section: bytes, at: int, identity: int) -> int:
    """Bytes that a record holds behind its link, by its own account, as far as the section goes."""
    if identity < 0:
        return min(len(section), at + 1 + (section[at] if at < len(section) else 0)) - at
    if at + 2 > len(section):
        return max(0, len(section) - at)
    kind, rank = struct.unpack_from("bB", section, at)
    count = int(np.prod(tuple(section[at + 2 : at + 2 + rank]), dtype=np.int64)) if rank <= 7 else 0
    stop = at + 2 + rank + max(0, count) * abs(kind)
    stop += 1 + (section[stop] if stop < len(section) else 0)
    return max(0, min(stop, len(section)) - at)


def decode_value(content: bytes, order: str, dec: bool) -> Value | None:
    """What a parameter holds; None where it says more than there is."""
    kind, rank = struct.unpack_from("bB", content) if len(content) >= 2 else (0, 0)
    shape = tuple(content[2 : 2 + rank])
    dtype = _TYPES.get(kind)
    count = int(np.prod(shape, dtype=np.int64)) if rank <= 7 else -1
    begin = 2 + rank
    size = count * (1 if dtype is None else np.dtype(dtype).itemsize)
    if dtype is None or count < 0 or len(shape) < rank or begin + size > len(content):
        return None
    raw = content[begin : begin + size]
    if kind == -1:
        width = shape[0] if rank else 1
        return tuple(clean(raw[i : i + width]) for i in range(0, size, width)) if width else ()
    if kind == 4:
        return floats(raw, order, dec)
    return np.frombuffer(raw, (order if kind == 2 else "") + dtype).astype(float)


def floats(raw: bytes, order: str, dec: bool) -> np.ndarray:
    """32-bit floats; the VAX kind has its 16-bit halves swapped and an exponent that is 2 larger."""
    if not dec:
        return np.frombuffer(raw, order + "f4").astype(float)
    words = np.frombuffer(raw, "<u2").reshape(-1, 2)[:, ::-1]
    return np.ascontiguousarray(words).view("<f4").ravel().astype(float) / 4


def from_floats(values: np.ndarray, order: str, dec: bool) -> bytes:
    """The bytes of 32-bit floats, as ``floats`` reads them."""
    if not dec:
        return values.astype(order + "f4").tobytes()
    words = np.ascontiguousarray(values * 4, dtype="<f4").view("<u2").reshape(-1, 2)[:, ::-1]
    return np.ascontiguousarray(words).tobytes()


def with_numbers(content: bytes, values: np.ndarray, order: str, dec: bool) -> bytes:
    """A parameter's content with other numbers of the same kind and shape; whole ones take 16 bits without sign.

    Raises
    ------
    ValueError : the parameter holds text, or another number of values
    """
    kind, rank = struct.unpack_from("bB", content)
    shape = tuple(content[2 : 2 + rank])
    if kind not in (2, 4) or int(np.prod(shape, dtype=np.int64)) != values.size:
        raise ValueError("a parameter is not of the kind that its numbers want")
    begin = 2 + rank
    whole = (np.round(values).astype(np.int64) % 65536).astype(order + "u2").tobytes()
    raw = from_floats(values.astype(float), order, dec) if kind == 4 else whole
    return content[:begin] + raw + content[begin + len(raw) :]


def with_texts(content: bytes, texts: tuple[str, ...]) -> bytes:
    """A parameter's content with other texts, as wide as the longest; its description stays."""
    _, rank = struct.unpack_from("bB", content)
    shape = tuple(content[2 : 2 + rank])
    rest = content[2 + rank + int(np.prod(shape, dtype=np.int64)) :]
    encoded = [text.encode("utf-8") for text in texts]
    width = max([*map(len, encoded), shape[0] if rank else 1, 1])
    if width > 255 or len(encoded) > 255:
        raise ValueError("texts do not fit a parameter")
    return struct.pack("b3B", -1, 2, width, len(encoded)) + b"".join(e.ljust(width) for e in encoded) + rest


def section_bytes(section: Section, head: bytes, contents: Mapping[int, bytes], room: int) -> bytes:
    """The section written anew, some records with other contents, in at least ``room`` blocks.

    Parameters
    ----------
    head : the section's first two bytes
    contents : by the record's place in the list

    Raises
    ------
    ValueError : it takes more than 255 blocks, or a record more than its link can say
    """
    body = b""
    for i, record in enumerate(section.records):
        content = contents.get(i, record.content)
        if len(content) + 2 > 65535:
            raise ValueError(f"the parameter {record.name} is too large")
        length = -len(record.raw) if record.locked else len(record.raw)
        body += struct.pack("bb", length, record.identity) + record.raw
        body += struct.pack(section.order + "H", len(content) + 2) + content
    body += b"\0\0"
    blocks = max(room, -(-(4 + len(body)) // BLOCK))
    if blocks > 255:
        raise ValueError("the parameters take more than 255 blocks")
    return (head + bytes([blocks, section.processor]) + body).ljust(blocks * BLOCK, b"\0")


def clean(raw: bytes) -> str:
    """Text up to the first zero byte, UTF-8 or Western 8-bit, less blanks at the ends."""
    raw = raw.split(b"\0")[0]
    try:
        return raw.decode("utf-8").strip()
    except UnicodeDecodeError:
        return raw.decode("latin-1").strip()
