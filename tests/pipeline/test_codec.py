"""Results survive storage without loss, and a document cannot make anything but the declared classes."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from markerscope.solver.pipeline.codec import CodecError, decode, encode, type_name


@dataclass(frozen=True)
class Leaf:
    values: np.ndarray
    name: str = ""
    score: float | None = None


@dataclass(frozen=True)
class Tree:
    anything: Any
    leaves: tuple[Leaf, ...] = ()
    best: Leaf | None = None
    by_name: dict[str, Leaf] = field(default_factory=dict)


@dataclass(frozen=True)
class Stranger:
    value: int = 0


def same(a: Any, b: Any) -> bool:
    """Equal in type, shape, dtype and every bit that matters (NaN equals NaN, -0.0 differs from 0.0)."""
    if type(a) is not type(b):
        return False
    if isinstance(a, np.ndarray):
        return a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    if isinstance(a, float):
        return (math.isnan(a) and math.isnan(b)) or (a == b and math.copysign(1, a) == math.copysign(1, b))
    if isinstance(a, np.generic):
        return a.dtype == b.dtype and (a == b or (a != a and b != b))
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b))
    if isinstance(a, dict):
        return list(a) == list(b) and all(same(a[k], b[k]) for k in a)
    if isinstance(a, Leaf | Tree):
        return all(same(getattr(a, name), getattr(b, name)) for name in a.__dataclass_fields__)
    return bool(a == b)


def round_trip(value: Any, declared: Any) -> Any:
    document, arrays = encode(value)
    return decode(json.loads(json.dumps(document)), arrays, declared)


arrays = nps.arrays(
    st.one_of(nps.boolean_dtypes(), nps.integer_dtypes(), nps.floating_dtypes(), nps.unicode_string_dtypes()),
    nps.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
plain = st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.text(), st.floats(width=32).map(np.float32))
leaves = st.builds(Leaf, arrays, st.text(), st.one_of(st.none(), st.floats()))
keys = st.one_of(st.text(), st.integers(), st.tuples(st.integers(), st.text()))
nested = st.recursive(
    st.one_of(plain, arrays, st.frozensets(st.integers()), leaves),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3),
        st.lists(inner, max_size=3).map(tuple),
        st.dictionaries(keys, inner, max_size=3),
    ),
    max_leaves=8,
)
trees = st.builds(
    Tree,
    nested,
    st.lists(leaves, max_size=3).map(tuple),
    st.one_of(st.none(), leaves),
    st.dictionaries(st.text(), leaves, max_size=2),
)


@given(trees)
def test_any_result_comes_back_as_it_was(tree: Tree) -> None:
    back = round_trip(tree, Tree)
    assert same(tree, back), f"{tree} came back as {back}"


@pytest.mark.parametrize("value", [None, Leaf(np.zeros(2))])
def test_an_optional_result(value: Leaf | None) -> None:
    assert same(round_trip(value, Leaf | None), value)


def test_only_declared_classes_are_made() -> None:
    document, stored = encode(Tree(Stranger(3)))
    with pytest.raises(CodecError, match="Stranger"):
        decode(document, stored, Tree)
    assert decode(document, stored, Tree, also=(Stranger,)).anything == Stranger(3)


def test_a_field_that_the_class_no_longer_has_is_refused() -> None:
    document, stored = encode(Leaf(np.zeros(1)))
    document["fields"]["colour"] = "red"
    with pytest.raises(CodecError, match="colour"):
        decode(document, stored, Leaf)


@pytest.mark.parametrize("value", [{1, 2}, object(), np.array([object()]), np.ma.masked_array([1.0], [True]), 1j, b"x"])
def test_what_cannot_be_stored_is_refused(value: Any) -> None:
    with pytest.raises(CodecError, match="cannot be stored"):
        encode(value)


@pytest.mark.parametrize(
    "document",
    [{"$array": "7"}, {"$who": 1}, {}, {"$type": type_name(Leaf)}, {"$tuple": 3}, {"$type": "os.system", "fields": {}}],
)
def test_a_damaged_document_is_refused(document: Any) -> None:
    with pytest.raises(CodecError):
        decode(document, {}, Leaf)
