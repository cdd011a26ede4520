"""Torch tensors as numpy arrays, rebuilt from storages without torch."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from markerscope.solver.safe_pickle.limits import Damaged
from markerscope.solver.safe_pickle.machine import Context, Global

STORAGES = {
    "FloatStorage": "float32",
    "DoubleStorage": "float64",
    "HalfStorage": "float16",
    "BFloat16Storage": "bfloat16",
    "LongStorage": "int64",
    "IntStorage": "int32",
    "ShortStorage": "int16",
    "CharStorage": "int8",
    "ByteStorage": "uint8",
    "BoolStorage": "bool",
    "ComplexFloatStorage": "complex64",
    "ComplexDoubleStorage": "complex128",
}
TORCH_DTYPES = (*STORAGES.values(), "uint16", "uint32", "uint64")


@dataclass(frozen=True)
class Pending:
    """A storage whose bytes come later in the file; tensors on it are not built yet."""


def item_size(dtype: str) -> int:
    """Bytes per element of a torch type."""
    return 2 if dtype == "bfloat16" else np.dtype(dtype).itemsize


def storage_type(token: Any) -> str:
    """The element type of a storage's class as it stands in a persistent id; untyped ones count bytes."""
    if not isinstance(token, Global):
        raise Damaged("a tensor in it has no element type")
    return STORAGES.get(token.name, "uint8")


def storage_array(raw: bytes, dtype: str, count: int, big_endian: bool = False) -> np.ndarray:
    """(count,) elements of a storage; bfloat16, which numpy lacks, becomes float32."""
    if count < 0 or len(raw) < count * item_size(dtype):
        raise Damaged("a tensor in it is cut short")
    plain = np.dtype("uint16" if dtype == "bfloat16" else dtype).newbyteorder(">" if big_endian else "<")
    values = np.frombuffer(raw, plain, count)
    if dtype == "bfloat16":
        return (values.astype(np.uint32) << 16).view(np.float32)
    return values.astype(plain.newbyteorder("="))


def tensor(context: Context, storage: Any, offset: Any, size: Any, stride: Any, *_: Any) -> Any:
    """A strided view of a storage, copied into an array of its own; nothing outside the storage is touched."""
    if isinstance(storage, Pending):
        return None
    if not isinstance(storage, np.ndarray) or storage.ndim != 1:
        raise Damaged("a tensor in it has no data")
    size, stride = tuple(size), tuple(stride)
    if (
        len(size) != len(stride)
        or len(size) > 32
        or not all(type(n) is int and n >= 0 for n in (*size, *stride, offset))
    ):
        raise Damaged("a tensor in it has an impossible shape")
    context.budget.spend(math.prod(size) * storage.itemsize)
    if math.prod(size) == 0:
        return np.empty(size, storage.dtype)
    last = offset + sum((n - 1) * step for n, step in zip(size, stride, strict=True))
    if last >= len(storage):
        raise Damaged("a tensor in it reaches beyond its data")
    strides = tuple(step * storage.itemsize for step in stride)
    return np.lib.stride_tricks.as_strided(storage[offset:], size, strides, writeable=False).copy()


def tensor_v3(
    context: Context, storage: Any, offset: Any, size: Any, stride: Any, _: Any, __: Any, dtype: Any, *___: Any
) -> Any:
    """As ``tensor``, for element types that have no storage class: the storage counts bytes."""
    if isinstance(storage, Pending):
        return None
    if not isinstance(dtype, Global) or dtype.name not in TORCH_DTYPES:
        raise Damaged("a tensor in it has no element type")
    raw = np.asarray(storage, np.uint8).tobytes()
    return tensor(context, storage_array(raw, dtype.name, len(raw) // item_size(dtype.name)), offset, size, stride)


def parameter(_: Context, data: Any, *__: Any) -> Any:
    """A trainable tensor is its data."""
    return data
