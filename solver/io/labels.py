"""Marker names: one each, whose they are, and which of them are no markers at all."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from markerscope.solver.core.plain import shown

_BONES = set(
    "HED LCL LFE LFO LHN LHU LRA LTI LTO PEL RCL RFE RFO RHN RHU RRA RTI RTO SPI THX TOR TRX BOX LTX RTX".split()
)
_COMPUTED = re.compile(
    r"V_.+"  # Cortex' virtual markers
    r"|[LR][_.]?[HKASEW]JC(_\w+)?"  # joint centres
    r"|(Centre|Center)OfMass(Floor)?|((Left|Right)[A-Z]\w+|Pelvis|Thorax|Head|Abdomen)COM"
    r"|\w+(Angles?|Force|Moment|Power|GRF)",
    re.ASCII,
)

_NOBODY = re.compile(
    r"un[\s_-]?(label+ed|identified|named|assigned|known)([\s_]*(markers?|points?|trajector(y|ies)))?|none|ghosts?",
    re.IGNORECASE,
)
_SIDE = re.compile(r"l|r|left|right|lt|rt", re.IGNORECASE)
_NUMBERED = re.compile(r"((marker|point)[\s_]*)?\d+", re.IGNORECASE)
_SEVERAL = 4


def unique(names: Sequence[str], limit: int | None = None, clean: Callable[[str], str] = str.strip) -> tuple[str, ...]:
    """Trimmed names that all differ: blanks become ``unnamed``, the second of a name gets ``_2`` and so on.

    Parameters
    ----------
    limit : longest name in UTF-8 bytes, None for any
    clean : applied to each name first
    """
    taken = {clean(name) for name in names}
    used: set[str] = set()
    result = []
    for name in names:
        base = _shorten(clean(name) or "unnamed", limit)
        label, number = base, 1
        while label in used or (number > 1 and label in taken):
            number += 1
            suffix = f"_{number}"
            label = _shorten(base, None if limit is None else limit - len(suffix)) + suffix
        used.add(label)
        result.append(label)
    return tuple(result)


def _shorten(name: str, limit: int | None) -> str:
    encoded = shown(name).encode("utf-8")
    return encoded[:limit].decode("utf-8", errors="ignore")


def prefix(label: str) -> str:
    """What a label says before its colon, blank where that is nothing, or that nobody knows whose marker it is."""
    head, colon, tail = label.partition(":")
    head = head.strip()
    return head if colon and tail.strip() and not label.startswith("*") and not _NOBODY.fullmatch(head) else ""


def without_prefix(label: str, subjects: Sequence[str] | None = None) -> str:
    """The label less its subject; with ``subjects``, less one of these only."""
    head = prefix(label)
    return label.partition(":")[2].strip() if head and (subjects is None or head in subjects) else label.strip()


def subjects_of(labels: Sequence[str], listed: Sequence[str], assets: Sequence[str] = ()) -> tuple[str, ...]:
    """Subjects that can be chosen: those the labels name, else the single one that the file lists.

    A colon is not a person yet: what stands before it counts as a subject where the file lists it as one, where it
    has several markers, or where another one has markers of the same names. A rigid body's and a side's name, and
    one whose markers have but numbers, count only where they are listed.

    Parameters
    ----------
    assets : what the file says to be things, not people
    """
    names: dict[str, list[str]] = {}
    for label in labels:
        if head := prefix(label):
            names.setdefault(head, []).append(label.partition(":")[2].strip())
    shared = {
        name for name, count in Counter(name for held in names.values() for name in set(held)).items() if count > 1
    }
    named = tuple(
        head
        for head, held in names.items()
        if head not in assets
        and (
            head in listed
            or (
                not _SIDE.fullmatch(head)
                and not all(map(_NUMBERED.fullmatch, held))
                and (len(names) == 1 or len(held) >= _SEVERAL or bool(shared & set(held)))
            )
        )
    )
    return named or (tuple(listed) if len(listed) == 1 else ())


def computed_by_name(labels: Sequence[str]) -> np.ndarray:
    """(M,) True for points whose names give them away as results of a model, not markers.

    The four points of a Plug-in Gait bone (``PELO PELA PELL PELP``) count only where all four are there.
    """
    names = [without_prefix(label) for label in labels]
    present = set(names)
    axes = {bone + end for bone in _BONES for end in "OALP" if all(bone + e in present for e in "OALP")}
    return np.array([name in axes or bool(_COMPUTED.fullmatch(name)) for name in names], dtype=bool)
