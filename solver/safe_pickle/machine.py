"""A stack machine that reads the pickle language and builds plain data only."""

from __future__ import annotations

import codecs
import pickletools
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np

from markerscope.solver.safe_pickle.limits import DEPTH, Budget, Damaged, Forbidden


@dataclass(frozen=True)
class Global:
    """A name found in a pickle. It is compared, never looked up."""

    module: str
    name: str

    def __str__(self) -> str:
        return f"{self.module}.{self.name}"


@dataclass(eq=False)
class Shell:
    """An object whose making has begun and whose state comes later in the stream."""

    kind: str
    detail: Any = None
    memo: list[int] = field(default_factory=list)


Persistent = Callable[[Any], Any]


@dataclass(frozen=True)
class Context:
    """What a recipe may use: the stream behind the pickle, the budget, and how deep we are.

    Attributes
    ----------
    stream : where the pickle is read from; joblib stores arrays between its opcodes
    budget : bytes that may still be made
    persistent : turns a persistent id (torch's reference to a storage) into data
    depth : how many pickles this one is nested in
    """

    stream: BinaryIO
    budget: Budget
    persistent: Persistent | None = None
    depth: int = 0

    def inside(self, stream: BinaryIO) -> Context:
        """The context of a pickle found inside this one."""
        if self.depth >= DEPTH:
            raise Damaged("pickles are nested too deeply in it")
        return Context(stream, self.budget, None, self.depth + 1)


_OPCODES = {opcode.code.encode("latin-1"): opcode for opcode in pickletools.opcodes}
_LITERALS = set(
    "INT LONG BININT BININT1 BININT2 LONG1 LONG4 FLOAT BINFLOAT STRING BINSTRING SHORT_BINSTRING UNICODE BINUNICODE "
    "SHORT_BINUNICODE BINUNICODE8 BINBYTES SHORT_BINBYTES BINBYTES8 BYTEARRAY8".split()
)
_CONSTANTS = {"NONE": None, "NEWTRUE": True, "NEWFALSE": False, "EMPTY_TUPLE": ()}
_EMPTY: dict[str, Callable[[], Any]] = {"EMPTY_LIST": list, "EMPTY_DICT": dict, "EMPTY_SET": set}
_PUT = {"PUT", "BINPUT", "LONG_BINPUT", "MEMOIZE"}
_GET = {"GET", "BINGET", "LONG_BINGET"}
_SKIP = {"PROTO", "FRAME"}
_SCALARS = (str, bytes, int, float, complex, bool, type(None))


def interpret(context: Context) -> Any:
    """The plain data that the pickle at the context's stream describes.

    Raises
    ------
    Forbidden
        Where the pickle names anything that is not on the allow-list.
    Damaged
        Where it cannot be read.
    """
    try:
        result = _Machine(context).run()
        _refuse_shells(result)
        return result
    except (Forbidden, Damaged):
        raise
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, OverflowError, EOFError, MemoryError) as error:
        raise Damaged("its contents are damaged or cut short") from error


def check_key(key: Any) -> Any:
    """``key``, where it may serve in a dict or set: flat, since hashing a deep tuple can take for ever."""
    if isinstance(key, _SCALARS) or (isinstance(key, tuple) and all(isinstance(k, _SCALARS) for k in key)):
        return key
    if isinstance(key, frozenset):  # its members have passed here
        return key
    try:  # numpy scalars
        return check_key(key.item())
    except AttributeError:
        raise Damaged("it has a dictionary key that is neither text nor number") from None


class _Machine:
    def __init__(self, context: Context) -> None:
        self.context = context
        self.stack: list[Any] = []
        self.marks: list[list[Any]] = []
        self.memo: dict[int, Any] = {}

    def run(self) -> Any:
        while True:
            name, argument = _next_opcode(self.context.stream)
            if name == "STOP":
                return self.stack.pop()
            if name in _LITERALS:
                self.stack.append(argument)
            elif name in _CONSTANTS:
                self.stack.append(_CONSTANTS[name])
            elif name in _EMPTY:
                self.stack.append(_EMPTY[name]())
            elif name in _PUT:
                self._put(len(self.memo) if argument is None else argument)
            elif name in _GET:
                self.stack.append(self.memo[int(argument)])
            elif name not in _SKIP:
                operation = getattr(self, f"op_{name.lower()}", None)
                if operation is None:
                    raise Forbidden(f"opcode {name}")
                operation(argument)

    def _put(self, key: int) -> None:
        top = self.stack[-1]
        self.memo[int(key)] = top
        if isinstance(top, Shell):
            top.memo.append(int(key))

    def _above_mark(self) -> list[Any]:
        items, self.stack = self.stack, self.marks.pop()
        return items

    def _pop(self, count: int) -> list[Any]:
        if len(self.stack) < count:
            raise Damaged("its contents are damaged or cut short")
        items = self.stack[-count:]
        del self.stack[-count:]
        return items

    # stack ------------------------------------------------------------------------------------------------------------
    def op_mark(self, _: Any) -> None:
        self.marks.append(self.stack)
        self.stack = []

    def op_pop(self, _: Any) -> None:
        if self.stack:
            self.stack.pop()
        else:
            self._above_mark()

    def op_pop_mark(self, _: Any) -> None:
        self._above_mark()

    def op_dup(self, _: Any) -> None:
        self.stack.append(self.stack[-1])

    # containers -------------------------------------------------------------------------------------------------------
    def op_tuple(self, _: Any) -> None:
        items = self._above_mark()
        self.stack.append(tuple(items))

    def op_tuple1(self, _: Any) -> None:
        self.stack.append(tuple(self._pop(1)))

    def op_tuple2(self, _: Any) -> None:
        self.stack.append(tuple(self._pop(2)))

    def op_tuple3(self, _: Any) -> None:
        self.stack.append(tuple(self._pop(3)))

    def op_list(self, _: Any) -> None:
        items = self._above_mark()
        self.stack.append(items)

    def op_dict(self, _: Any) -> None:
        items = self._above_mark()
        self.stack.append(_pairs(items))

    def op_frozenset(self, _: Any) -> None:
        items = self._above_mark()
        self.stack.append(frozenset(map(check_key, items)))

    def op_append(self, _: Any) -> None:
        (item,) = self._pop(1)
        _expect(self.stack[-1], list).append(item)

    def op_appends(self, _: Any) -> None:
        items = self._above_mark()
        _expect(self.stack[-1], list).extend(items)

    def op_setitem(self, _: Any) -> None:
        pair = self._pop(2)
        _expect(self.stack[-1], dict).update(_pairs(pair))

    def op_setitems(self, _: Any) -> None:
        items = self._above_mark()
        _expect(self.stack[-1], dict).update(_pairs(items))

    def op_additems(self, _: Any) -> None:
        items = self._above_mark()
        _expect(self.stack[-1], set).update(map(check_key, items))

    # names and objects ------------------------------------------------------------------------------------------------
    def op_global(self, argument: str) -> None:
        self.stack.append(_known(*argument.split(" ", 1)))

    def op_stack_global(self, _: Any) -> None:
        module, name = self._pop(2)
        self.stack.append(_known(_expect(module, str), _expect(name, str)))

    def op_reduce(self, _: Any) -> None:
        target, arguments = self._pop(2)
        self.stack.append(self._make(target, arguments))

    op_newobj = op_reduce

    def op_newobj_ex(self, _: Any) -> None:
        target, arguments, keywords = self._pop(3)
        if keywords:
            raise Forbidden(f"{target} with keywords")
        self.stack.append(self._make(target, arguments))

    def op_obj(self, _: Any) -> None:
        target, *arguments = self._above_mark()
        self.stack.append(self._make(target, tuple(arguments)))

    def op_inst(self, argument: str) -> None:
        arguments = self._above_mark()
        self.stack.append(self._make(_known(*argument.split(" ", 1)), tuple(arguments)))

    def op_build(self, _: Any) -> None:
        from markerscope.solver.safe_pickle.recipes import finish

        (state,) = self._pop(1)
        shell = self.stack[-1]
        if isinstance(shell, dict):  # attributes of an OrderedDict (torch hangs a version on it): of no interest
            return
        if not isinstance(shell, Shell):
            raise Forbidden(f"state set on a {type(shell).__name__}")
        value = finish(shell, state, self.context)
        self.stack[-1] = value
        for key in shell.memo:
            if self.memo.get(key) is shell:
                self.memo[key] = value

    def op_binpersid(self, _: Any) -> None:
        (identity,) = self._pop(1)
        if self.context.persistent is None:
            raise Forbidden("persistent id")
        self.stack.append(self.context.persistent(identity))

    def _make(self, target: Any, arguments: Any) -> Any:
        from markerscope.solver.safe_pickle.recipes import make

        if not isinstance(target, Global):
            raise Forbidden(f"call of a {type(target).__name__}")
        return make(target, _expect(arguments, tuple), self.context)


def _next_opcode(stream: BinaryIO) -> tuple[str, Any]:
    """Name and argument of the next opcode; ``pickletools`` decodes arguments and runs nothing."""
    code = stream.read(1)
    opcode = _OPCODES.get(code)
    if not code or opcode is None:
        raise Damaged("its contents are damaged or cut short")
    if opcode.name == "STRING":  # Python 2 text, which pickletools would only take as ASCII
        text = stream.readline().rstrip(b"\r\n")
        unescaped: bytes = codecs.escape_decode(text[1:-1])[0]
        return opcode.name, unescaped.decode("latin-1")
    return opcode.name, None if opcode.arg is None else opcode.arg.reader(stream)


def _known(module: str, name: str) -> Global:
    from markerscope.solver.safe_pickle.recipes import canonical

    return canonical(Global(module, name))


def _expect(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise Damaged("its contents are damaged or cut short")
    return value


def _pairs(items: list[Any]) -> dict[Any, Any]:
    return {check_key(key): value for key, value in zip(items[::2], items[1::2], strict=True)}


def _refuse_shells(result: Any) -> None:
    """No half-made object leaves the machine."""
    seen: set[int] = set()
    todo = [result]
    while todo:
        item = todo.pop()
        if isinstance(item, Shell):
            raise Damaged("an object in it is only half described")
        if id(item) in seen or isinstance(item, _SCALARS):
            continue
        seen.add(id(item))
        if isinstance(item, dict):
            todo.extend(item.values())
        elif isinstance(item, list | tuple):
            todo.extend(item)
        elif isinstance(item, np.ndarray) and item.dtype.hasobject:
            todo.extend(item.ravel().tolist())
