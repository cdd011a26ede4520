"""The allow-list: every name a pickle may use, and the plain data that stands for it."""

from __future__ import annotations

import io
import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from markerscope.solver.safe_pickle.limits import Damaged, Forbidden
from markerscope.solver.safe_pickle.machine import Context, Global, Shell, check_key, interpret
from markerscope.solver.safe_pickle.sparse import sparse_from_state
from markerscope.solver.safe_pickle.tensors import STORAGES, TORCH_DTYPES, parameter, tensor, tensor_v3

_RENAMED = (
    ("numpy.core.", "numpy._core."),
    ("__builtin__", "builtins"),
    ("copy_reg", "copyreg"),
)
_DTYPE = re.compile(r"[<>=|]?([?bBhHiIlLqQefdgFDGOSUV]|[biufcSUVO]\d{1,6})")
_SPARSE = re.compile(r"scipy\.sparse(\._?(csc|csr|coo))?")
_OMEGACONF = re.compile(r"omegaconf\.(base|nodes|dictconfig|listconfig)")
"""MoSh++ and SOMA keep their settings beside their results, as trees of these; they are passed over."""


def canonical(name: Global) -> Global:
    """The allowed name that ``name`` stands for, across versions of its library; anything else is forbidden."""
    module = name.module
    for old, new in _RENAMED:
        if module == old or (old.endswith(".") and module.startswith(old)):
            module = new + module[len(old) :]
    if _SPARSE.fullmatch(module) and (match := re.fullmatch(r"(csc|csr|coo)_(matrix|array)", name.name)):
        return Global("scipy.sparse", match[1])
    if _OMEGACONF.fullmatch(module):
        return Global("omegaconf", "settings")
    found = Global(module, name.name)
    if found in _CALLS or found in _TOKENS:
        return found
    raise Forbidden(str(name))


def make(target: Global, arguments: tuple[Any, ...], context: Context) -> Any:
    """What calling ``target`` would have given, as plain data or as a shell that waits for its state."""
    recipe = _CALLS.get(target)
    if recipe is None:
        raise Forbidden(f"{target}()")
    return recipe(context, *arguments)


def finish(shell: Shell, state: Any, context: Context) -> Any:
    """The plain data of a shell whose ``state`` has come."""
    return _FINISHERS[shell.kind](shell, state, context)


# numpy ----------------------------------------------------------------------------------------------------------------
def array_from_bytes(raw: Any, dtype: Any, shape: Any, fortran: bool, context: Context) -> np.ndarray:
    """An array of ``shape`` from the bytes that hold it, all of them and no more."""
    dtype, shape = _dtype_of(dtype), _shape_of(shape)
    if dtype.hasobject:
        raise Forbidden("objects in raw memory")
    if isinstance(raw, str):  # Python 2
        raw = raw.encode("latin-1")
    if not isinstance(raw, bytes | bytearray) or len(raw) != math.prod(shape) * dtype.itemsize or dtype.itemsize == 0:
        raise Damaged("an array in it has another size than its data")
    context.budget.spend(len(raw))
    flat = np.frombuffer(raw, dtype).copy()
    return flat.reshape(shape[::-1]).T if fortran else flat.reshape(shape)


def _object_array(items: Any, shape: Any) -> np.ndarray:
    shape = _shape_of(shape)
    if not isinstance(items, list) or len(items) != math.prod(shape):
        raise Damaged("an array in it has another size than its data")
    flat = np.empty(len(items), dtype=object)
    for i, item in enumerate(items):  # one by one: numpy would look into sequences
        flat[i] = item
    return flat.reshape(shape)


def _shape_of(shape: Any) -> tuple[int, ...]:
    shape = (shape,) if isinstance(shape, int) else shape
    if not isinstance(shape, tuple | list) or len(shape) > 32:
        raise Damaged("an array in it has an impossible shape")
    if not all(isinstance(n, int | np.integer) and n >= 0 for n in shape):
        raise Damaged("an array in it has an impossible shape")
    return tuple(int(n) for n in shape)


def _dtype_of(dtype: Any) -> np.dtype:
    if isinstance(dtype, Shell) and dtype.kind == "dtype":
        return np.dtype(dtype.detail)
    if not isinstance(dtype, np.dtype):
        raise Damaged("an array in it has no element type")
    return dtype


def _dtype(_: Context, spec: Any, *__: Any) -> Shell:
    if not isinstance(spec, str) or not _DTYPE.fullmatch(spec):
        raise Forbidden(f"element type {spec}" if isinstance(spec, str | Global) else "element type")
    return Shell("dtype", spec)


def _finish_dtype(shell: Shell, state: Any, _: Context) -> np.dtype:
    order, base, names, fields, size = state[1:6]
    if base is not None:
        return np.dtype((_dtype_of(base[0]), _shape_of(base[1])))
    if names:
        formats = [_dtype_of(fields[name][0]) for name in names]
        if any(f.hasobject for f in formats):
            raise Forbidden("objects in raw memory")
        offsets = [int(fields[name][1]) for name in names]
        return np.dtype({"names": list(names), "formats": formats, "offsets": offsets, "itemsize": size})
    dtype = np.dtype(shell.detail)
    return dtype.newbyteorder(order) if order in ("<", ">") else dtype


def _finish_array(_: Shell, state: Any, context: Context) -> np.ndarray:
    shape, dtype, fortran, raw = state[-4:]
    if _dtype_of(dtype).hasobject:
        array = _object_array(raw, shape[::-1] if fortran else shape)
        return array.T if fortran else array
    return array_from_bytes(raw, dtype, shape, bool(fortran), context)


def _scalar(context: Context, dtype: Any, raw: Any) -> Any:
    return array_from_bytes(raw, dtype, (), False, context)[()]


def _frombuffer(context: Context, raw: Any, dtype: Any, shape: Any, order: str = "C") -> np.ndarray:
    return array_from_bytes(raw, dtype, shape, order == "F", context)


def _finish_joblib(_: Shell, state: Any, context: Context) -> np.ndarray:
    """The array that joblib has put into the stream right behind its wrapper."""
    dtype, shape, fortran = _dtype_of(state["dtype"]), _shape_of(state["shape"]), state["order"] == "F"
    if dtype.hasobject:
        return np.asarray(interpret(context.inside(context.stream)), dtype=object).reshape(shape)
    if state.get("numpy_array_alignment_bytes") is not None:
        context.stream.read(int.from_bytes(context.stream.read(1), "little"))
    size = math.prod(shape) * dtype.itemsize
    context.budget.spend(size)
    return array_from_bytes(context.stream.read(size), dtype, shape, fortran, context)


# the standard library -------------------------------------------------------------------------------------------------
def _mapping(_: Context, items: Any = (), *__: Any) -> dict:
    """An ordered or defaulting dict; the factory of the latter is forgotten."""
    if isinstance(items, Global):
        return {}
    return {check_key(key): value for key, value in (items.items() if isinstance(items, dict) else items)}


def _encode(_: Context, text: str, encoding: str = "latin1") -> bytes:
    if encoding not in ("latin1", "latin-1"):
        raise Forbidden(f"encoding {encoding}")
    return text.encode("latin-1")


def _bytearray(_: Context, text: Any = b"", encoding: str = "latin-1") -> bytes:
    return _encode(_, text, encoding) if isinstance(text, str) else bytes(_require(text, bytes))


def _require(value: Any, *kinds: type) -> Any:
    if not isinstance(value, kinds):
        raise Damaged("its contents are damaged or cut short")
    return value


def _reconstructor(context: Context, cls: Any, *_: Any) -> Any:
    """Protocols 0 and 1 make an object by its class and an (unused) base."""
    return make(_require(cls, Global), (), context)


def _newobj(context: Context, cls: Any, *arguments: Any) -> Any:
    return make(_require(cls, Global), arguments, context)


# torch ----------------------------------------------------------------------------------------------------------------
def _storage_from_bytes(context: Context, raw: Any) -> Any:
    from markerscope.solver.safe_pickle.files import read_legacy_torch

    return read_legacy_torch(context.inside(io.BytesIO(_require(raw, bytes))))


def _shell(kind: str, detail: Any = None) -> Callable[..., Any]:
    return lambda _, *__: Shell(kind, detail)


_PLAIN_CALLS: dict[Global, Callable[..., Any]] = {
    Global("numpy._core.multiarray", "_reconstruct"): _shell("array"),
    Global("numpy._core.multiarray", "scalar"): _scalar,
    Global("numpy._core.numeric", "_frombuffer"): _frombuffer,
    Global("numpy", "dtype"): _dtype,
    Global("joblib.numpy_pickle", "NumpyArrayWrapper"): _shell("joblib"),
    Global("collections", "OrderedDict"): _mapping,
    Global("collections", "defaultdict"): _mapping,
    Global("builtins", "set"): lambda _, items=(): set(map(check_key, items)),
    Global("builtins", "frozenset"): lambda _, items=(): frozenset(map(check_key, items)),
    Global("builtins", "complex"): lambda _, a, b=0.0: complex(_require(a, int, float), _require(b, int, float)),
    Global("builtins", "bytearray"): _bytearray,
    Global("builtins", "bytes"): _bytearray,
    Global("_codecs", "encode"): _encode,
    Global("copyreg", "_reconstructor"): _reconstructor,
    Global("copyreg", "__newobj__"): _newobj,
    Global("chumpy.ch", "Ch"): _shell("chumpy"),
    Global("omegaconf", "settings"): _shell("settings"),
    Global("torch._utils", "_rebuild_tensor"): tensor,
    Global("torch._utils", "_rebuild_tensor_v2"): tensor,
    Global("torch._utils", "_rebuild_tensor_v3"): tensor_v3,
    Global("torch._utils", "_rebuild_parameter"): parameter,
    Global("torch.storage", "_load_from_bytes"): _storage_from_bytes,
    Global("torch", "Size"): lambda _, size=(): _shape_of(size),
    Global("torch", "device"): lambda _, *where: ":".join(str(_require(w, str, int)) for w in where),
}
_CALLS = _PLAIN_CALLS | {Global("scipy.sparse", layout): _shell("sparse", layout) for layout in ("csc", "csr", "coo")}

_TOKENS = (
    {Global("numpy", name) for name in ("ndarray", "memmap")}
    | {Global("builtins", name) for name in ("object", "dict", "list", "tuple", "int", "float", "str", "bool")}
    | {Global("typing", "Any")}
    | {Global("torch", name) for name in (*STORAGES, *TORCH_DTYPES)}
    | {Global("torch.storage", name) for name in ("UntypedStorage", "TypedStorage", "_UntypedStorage")}
)

_FINISHERS: dict[str, Callable[[Shell, Any, Context], Any]] = {
    "array": _finish_array,
    "dtype": _finish_dtype,
    "joblib": _finish_joblib,
    "sparse": lambda shell, state, _: sparse_from_state(shell.detail, _require(state, dict)),
    "chumpy": lambda _, state, __: _require(state, dict)["x"],
    "settings": lambda *_: None,
}
