"""Every method that can be named."""

from __future__ import annotations

from markerscope.solver.bench.ablations import ablations
from markerscope.solver.bench.imported import outside
from markerscope.solver.bench.methods import METHODS, Variant
from markerscope.solver.core.errors import InputError

VARIANTS: dict[str, Variant] = {variant.name: variant for variant in (*METHODS, *ablations())}


def method_named(name: str) -> Variant:
    """The method of that name, or the results in a folder: ``NAME=FOLDER``.

    Raises
    ------
    InputError : there is none
    """
    if "=" in name:
        return outside(name)
    if name not in VARIANTS:
        raise InputError(f'there is no method "{name}"', "--methods", f"use some of: {', '.join(VARIANTS)}")
    return VARIANTS[name]


def with_ablations(names: tuple[str, ...]) -> tuple[str, ...]:
    """Each method followed by those that are named after it."""
    return tuple(
        dict.fromkeys(
            other for name in names for other in (name, *(known for known in VARIANTS if known.startswith(f"{name}-")))
        )
    )
