"""The motions that networks learn from: a user's own folders of recordings, and motions made here."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.synth.acts import ACTS, act
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.retarget import retarget
from markerscope.solver.synth.source import read_source

RATE = 60.0
"""Hz of all clips, unless said otherwise."""

KINDS: Mapping[str, str] = {
    "02_01": "walk",
    "02_02": "walk",
    "02_03": "run",
    "02_04": "jump",
    "02_05": "punch",
    "02_06": "bend",
    "02_07": "sword",
    "02_08": "sword",
    "02_09": "sword",
    "02_10": "wash",
}
"""What the recordings of CMU's subject 02, which only have numbers for names, show."""

FREE = "free"
"""The kind of made motions that go through random poses within the joints' limits."""


@dataclass(frozen=True, eq=False)
class Clip:
    """One motion, on the embedded body's 24 joints.

    Attributes
    ----------
    rotations : (T, 24, 3, 3), root in the lab (z up), others relative to the parent
    trans : (T, 3) m, as ``Body.pose`` takes it
    rate : Hz
    name : of its file, or what made it
    kind : of action, as far as its name tells
    """

    rotations: np.ndarray
    trans: np.ndarray
    rate: float
    name: str
    kind: str

    def part(self, first: float, last: float) -> Clip:
        """The frames from one fraction of its length to another."""
        frames = slice(round(first * len(self.trans)), round(last * len(self.trans)))
        return Clip(self.rotations[frames], self.trans[frames], self.rate, self.name, self.kind)


def load_library(folders: Sequence[str | Path], rate: float = RATE) -> tuple[Clip, ...]:
    """Every BVH and AMC (with its ASF beside it) in some folders and below, put onto the embedded body.

    Raises
    ------
    InputError : a folder is not there, holds no motion, or a file in it cannot be read
    """
    body = Body.load()
    betas = np.zeros(body.shape_count)
    clips = []
    for folder in map(Path, folders):
        if not folder.is_dir():
            raise InputError("there is no such folder", folder, "name a folder of BVH or AMC files")
        paths = sorted(path for path in folder.rglob("*") if path.suffix.lower() in (".bvh", ".amc"))
        if not paths:
            raise InputError("holds no motion", folder, "name a folder of BVH or AMC files")
        for path in paths:
            source = read_source(path)
            if isinstance(source, str):
                raise InputError("is the name of a made motion", path, "rename the file")
            clips.append(_clip(retarget(source, body, betas, rate=rate), path.stem, kind_of(path.stem)))
    return tuple(clips)


def kind_of(stem: str) -> str:
    """The kind of action that a file's name tells: its first word that is no number and names no collection."""
    if stem in KINDS:
        return KINDS[stem]
    for word in re.split(r"[_\s]+", stem.lower()):
        if not re.fullmatch(r"(dataset|subject|take|trial)?-?\d*", word):
            return word
    return stem


def procedural_clips(n: int, seed: int, rate: float = RATE, seconds: float = 8.0) -> tuple[Clip, ...]:
    """Motions from no recording: every other one wanders through random poses, the rest are gaits, squats and the like.

    The first of more clips are what fewer clips are.
    """
    from markerscope.solver.neural.training.procedural import free_motion

    body = Body.load()
    betas = np.zeros(body.shape_count)
    clips = []
    for i in range(n):
        rng = np.random.default_rng([seed, i])
        if i % 2 == 0:
            clips.append(_clip(free_motion(seconds, rate, rng), f"{FREE} {i}", FREE))
        else:
            name = ACTS[i // 2 % len(ACTS)]
            made = act(name, body, betas, seconds=seconds, rate=rate, rng=rng)
            clips.append(_clip(made, f"{name} {i}", f"made {name}"))
    return tuple(clips)


def motions_of(folders: Sequence[Path], made: int, seed: int) -> tuple[Clip, ...]:
    """Recorded motions, each of a kind of its own, and made ones, of two kinds: they are many, and alike."""
    recorded = load_library(folders) if folders else ()
    return (
        *(replace(clip, kind=clip.kind.partition(" ")[0]) for clip in procedural_clips(made, seed)),
        *(replace(clip, kind=clip.name) for clip in recorded),
    )


def by_kind(clips: Sequence[Clip], held_out: Sequence[str]) -> tuple[tuple[Clip, ...], tuple[Clip, ...]]:
    """Clips of the kinds that may be learnt from, and those of kinds held out."""
    kept = tuple(clip for clip in clips if clip.kind not in held_out)
    return kept, tuple(clip for clip in clips if clip.kind in held_out)


def _clip(motion: Motion, name: str, kind: str) -> Clip:
    return Clip(motion.rotations.astype(np.float32), motion.trans.astype(np.float32), motion.rate, name, kind)
