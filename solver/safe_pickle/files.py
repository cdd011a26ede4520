"""From the first bytes of a file to the plain data inside it."""

from __future__ import annotations

import bz2
import io
import lzma
import math
import struct
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.file_kinds import refuse_other_kind
from markerscope.solver.safe_pickle.limits import EXPANSION, SLACK, Budget, Damaged, Forbidden
from markerscope.solver.safe_pickle.machine import Context, Global, interpret
from markerscope.solver.safe_pickle.recipes import array_from_bytes
from markerscope.solver.safe_pickle.tensors import Pending, item_size, storage_array, storage_type

_TORCH_MAGIC = 0x1950A86A20F9469CFC6C
_TORCH_LEGACY_START = b"\x80\x02\x8a\n\x6c\xfc\x9c\x46\xf9\x20\x6a\xa8\x50\x19"


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool: ...

    def decompress(self, data: bytes, max_length: int) -> bytes: ...


def load_untrusted(path: str | Path) -> Any:
    """Plain data from a pickle, joblib dump, ``.npy``, ``.npz`` or torch file, without running anything in it.

    Parameters
    ----------
    path : the file; its kind is told from its first bytes, not from its name

    Returns
    -------
    dict, list, tuple, set, str, bytes, number, numpy array, or ``Sparse``. Torch tensors and chumpy arrays come as
    numpy arrays, ordered and defaulting dicts as dicts, Python 2 text is read as latin-1.

    Raises
    ------
    InputError
        Where the file cannot be read, is damaged, or names anything that is not on the allow-list.
    """
    try:
        data = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("there is no such file", path, "check the path") from None
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})", path, "check what it is and who may read it"
        ) from None
    if not data:
        raise InputError("the file is empty", path, "export it again")
    refuse_other_kind(data, path, "a file of arrays or results (npz, npy, pkl or pt)")
    try:
        return _read(data)
    except Forbidden as error:
        remedy = "use the file that the reconstruction program itself wrote, or export plain arrays"
        raise InputError(
            f"it asks for '{error}', which plain data does not need, so it was not opened", path, remedy
        ) from None
    except Damaged as error:
        raise InputError(str(error), path, "write or copy it again") from None
    except (zipfile.BadZipFile, NotImplementedError, RuntimeError, OSError, ValueError, EOFError, struct.error):
        raise InputError("its contents are damaged or cut short", path, "write or copy it again") from None


def _read(data: bytes) -> Any:
    if data.startswith(b"PK\x03\x04"):
        return _read_zip(data)
    if data.startswith(b"\x93NUMPY"):
        return _unwrap(_read_npy(data, _budget(data)))
    if data.startswith(b"\x04\x22\x4d\x18"):
        raise Damaged("it is compressed with LZ4, which is not supported")
    if data.startswith(b"ZF"):
        raise Damaged("it was written by joblib before version 0.10, which is not supported")
    data = _decompressed(data)
    if data.startswith(b"\x93NUMPY"):
        return _unwrap(_read_npy(data, _budget(data)))
    context = Context(io.BytesIO(data), _budget(data))
    if data.startswith(_TORCH_LEGACY_START):
        return read_legacy_torch(context)
    return interpret(context)


def _budget(data: bytes) -> Budget:
    return Budget(4 * len(data) + SLACK)


def _decompressed(data: bytes) -> bytes:
    """``data``, unpacked where it is zlib, gzip, bzip2, xz or lzma, up to a size that an honest file stays under."""
    decompressor: _Decompressor
    if data[:1] == b"\x78" and data[:2] in (b"\x78\x01", b"\x78\x5e", b"\x78\x9c", b"\x78\xda"):
        decompressor = zlib.decompressobj()
    elif data[:2] == b"\x1f\x8b":
        decompressor = zlib.decompressobj(wbits=31)
    elif data[:3] == b"BZh":
        decompressor = bz2.BZ2Decompressor()
    elif data[:6] == b"\xfd7zXZ\x00" or data[:3] == b"\x5d\x00\x00":
        decompressor = lzma.LZMADecompressor(memlimit=SLACK * 4)
    else:
        return data
    limit = EXPANSION * len(data) + SLACK
    try:
        unpacked = decompressor.decompress(data, limit)
    except (zlib.error, lzma.LZMAError, OSError, ValueError):
        raise Damaged("its compressed contents are damaged or cut short") from None
    if len(unpacked) >= limit:
        raise Damaged("it unpacks to far more data than a file of its size can hold")
    if not decompressor.eof:
        raise Damaged("its compressed contents are damaged or cut short")
    return unpacked


def _read_npy(data: bytes, budget: Budget, depth: int = 0) -> Any:
    stream = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(stream)
        read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
        shape, fortran, dtype = read_header(stream)
    except (ValueError, TypeError, KeyError, SyntaxError, RecursionError, MemoryError, tokenize.TokenError):
        raise Damaged("its array header is damaged") from None
    context = Context(stream, budget, depth=depth)
    if dtype.hasobject:
        return interpret(context.inside(stream))
    size = math.prod(shape) * dtype.itemsize
    if 0 in shape and dtype.itemsize:
        return np.empty(shape, dtype)
    budget.spend(size)
    return array_from_bytes(stream.read(size), dtype, shape, fortran, context)


def _unwrap(value: Any) -> Any:
    """The object itself, where ``np.save`` was given a dict or list."""
    return value.item() if isinstance(value, np.ndarray) and value.dtype == object and value.ndim == 0 else value


def _read_zip(data: bytes) -> Any:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        names = set(archive.namelist())
        budget = Budget(EXPANSION * len(data) + SLACK)
        pickles = sorted((n for n in names if n == "data.pkl" or n.endswith("/data.pkl")), key=len)
        if pickles:
            return _read_zipped_torch(archive, pickles[0], budget)
        arrays = [name for name in archive.namelist() if name.endswith(".npy")]
        if not arrays:
            raise Damaged("it is a zip archive that holds neither arrays nor tensors")
        return {name[:-4]: _unwrap(_read_npy(_member(archive, name, budget), budget)) for name in arrays}


def _member(archive: zipfile.ZipFile, name: str, budget: Budget) -> bytes:
    try:
        info = archive.getinfo(name)
        budget.spend(info.file_size)
        with archive.open(info) as member:
            return member.read(info.file_size)
    except (KeyError, zlib.error, lzma.LZMAError, EOFError):
        raise Damaged("a part of the archive is missing or damaged") from None


def _read_zipped_torch(archive: zipfile.ZipFile, pickle_name: str, budget: Budget) -> Any:
    folder = pickle_name.removesuffix("data.pkl")
    if f"{folder}constants.pkl" in archive.namelist():
        raise Damaged("it is a TorchScript program, not data")
    big_endian = f"{folder}byteorder" in archive.namelist() and archive.read(f"{folder}byteorder") == b"big"
    storages: dict[str, np.ndarray] = {}

    def persistent(identity: Any) -> Any:
        dtype, key, count = _storage_id(identity)
        if key not in storages:
            raw = _member(archive, f"{folder}data/{key}", budget)
            storages[key] = storage_array(raw, dtype, count, big_endian)
        return storages[key]

    raw = _member(archive, pickle_name, budget)
    return interpret(Context(io.BytesIO(raw), budget, persistent))


def _storage_id(identity: Any) -> tuple[str, str, int]:
    """Element type, key and element count in torch's persistent id ``('storage', type, key, device, count, ...)``."""
    match identity:
        case ("storage", Global() as token, str() as key, _, int() as count, *_) if count >= 0:
            return storage_type(token), key, count
    raise Damaged("a tensor in it is described in an unknown way")


def read_legacy_torch(context: Context) -> Any:
    """A torch file from before version 1.6: four pickles, then the storages that the fourth refers to.

    The bytes come last, so the fourth pickle is read twice: once to learn which storages there are.
    """
    stream = context.stream
    if interpret(context) != _TORCH_MAGIC:
        raise Damaged("it is not a torch file")
    interpret(context)
    interpret(context)
    start = stream.tell()
    found: dict[str, tuple[str, int]] = {}

    def note(identity: Any) -> Pending:
        dtype, key, count = _storage_id(identity)
        found[key] = dtype, count
        return Pending()

    def look_up(identity: Any) -> np.ndarray:
        _, key, _ = _storage_id(identity)
        storage = storages[key]
        view = identity[5] if len(identity) > 5 else None
        return storage if view is None else storage[int(view[1]) : int(view[1]) + int(view[2])]

    interpret(Context(stream, context.budget, note, context.depth))
    storages: dict[str, np.ndarray] = {}
    keys = interpret(Context(stream, context.budget, depth=context.depth))
    if not isinstance(keys, list) or not set(found) <= {k for k in keys if isinstance(k, str)}:
        raise Damaged("a tensor in it has no data")
    for key in keys:
        if key not in found:
            raise Damaged("its list of tensors is damaged")
        dtype, _ = found[key]
        count = int.from_bytes(stream.read(8), "little")
        size = count * item_size(dtype)
        context.budget.spend(size)
        storages[key] = storage_array(stream.read(size), dtype, count)
    stream.seek(start)
    return interpret(Context(stream, context.budget, look_up, context.depth))
