"""What a benchmark is asked for. Imports nothing heavy, so that the command line answers at once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from markerscope.solver.core.errors import InputError

OUT = Path("bench-out")


@dataclass(frozen=True)
class BenchRequest:
    """One benchmark.

    Attributes
    ----------
    suite : which declared cases
    motions : folder of BVH and ASF/AMC files; None takes the program's own movements
    motion_count : how many of them at most; None is the suite's own
    methods : names; empty takes the suite's own
    cases : names; empty takes all of the suite
    seeds : sessions of each case and movement
    out : folder for records and tables
    workers : processes; None is one a core
    iterations : cap of the published method's optimisations
    limit : s that a run may take
    gaps : statistics of real gaps
    frames : of each session; None is the suite's own
    minutes : of training of each network; None is the suite's own
    """

    suite: str
    motions: Path | None = None
    motion_count: int | None = None
    methods: tuple[str, ...] = ()
    cases: tuple[str, ...] = ()
    seeds: int = 1
    out: Path = OUT
    workers: int | None = None
    iterations: int | None = None
    limit: float | None = None
    gaps: Path | None = None
    frames: int | None = None
    minutes: float | None = None

    def __post_init__(self) -> None:
        """Refuse what cannot be run."""
        for name in ("motion_count", "seeds", "workers", "iterations", "limit", "minutes"):
            value = getattr(self, name)
            if value is not None and not value > 0:
                raise InputError(f"{value:g} is not possible", f"--{name.replace('_', '-')}", "give a number above 0")
        if self.frames is not None and self.frames < 60:
            raise InputError(f"{self.frames} is not possible", "--frames", "give 60 or more")
        if self.gaps is not None and not self.gaps.is_file():
            raise InputError("there is no such file (--gaps)", self.gaps, "check the name and the folder")

    @property
    def command(self) -> str:
        """The command line that asks for the same figures, folders by their last name."""
        words = ["markerscope bench", self.suite]
        for name in ("motions", "gaps"):
            path = getattr(self, name)
            words += [] if path is None else [f"--{name} {path.name}"]
        for name in ("methods", "cases"):
            words += [f"--{name} {','.join(getattr(self, name))}"] if getattr(self, name) else []
        for name in ("seeds", "motion_count", "iterations", "limit", "frames", "minutes"):
            value, default = getattr(self, name), type(self).__dataclass_fields__[name].default
            words += [] if value == default else [f"--{name.replace('_', '-')} {value:g}"]
        return " ".join(words)


def names(text: str) -> tuple[str, ...]:
    """``a,b`` as a tuple."""
    return tuple(word.strip() for word in text.split(",") if word.strip())
