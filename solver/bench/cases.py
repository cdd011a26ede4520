"""The declared cases: what is hard about each, as settings of the generator of synthetic sessions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import PARTS
from markerscope.solver.synth.settings import SynthSettings

FRAMES = 450
"""Frames of a case where nothing else is said: 15 s at 30 Hz, as in the paper's sequences."""


@dataclass(frozen=True)
class Case:
    """One kind of session.

    Attributes
    ----------
    name : short, without blanks, unique within its suite
    settings : of the generator
    about : what is hard about it
    """

    name: str
    settings: SynthSettings
    about: str


def usual(frames: int) -> SynthSettings:
    """Forty markers anywhere on a body outside the shape basis, 4 % of the samples lost, skin that slides."""
    return SynthSettings(frames=frames, markers=40, shape="outside", lost=0.04)


def accuracy(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """A whole body: number of markers, errors of the video, of the markers, of the clock, of the shape."""
    base = usual(frames)

    def case(name: str, about: str, **changed: object) -> Case:
        return Case(name, replace(base, **changed), about)  # type: ignore[arg-type]

    cases = [
        case("40-markers", "the usual case: a shape outside the basis, sliding skin, 4 % lost, usual video errors"),
        case("50-markers", "more markers", markers=50),
        case("30-markers", "fewer markers", markers=30),
        case("20-markers", "few markers", markers=20),
        case("video-x0", "a video without error but its camera", video_noise=0.0),
        case("video-x2", "twice the video's usual error", video_noise=2.0),
        case("video-x3", "three times the video's usual error", video_noise=3.0),
        case("drop-outs", "in each frame each marker is lost with p = 1 % for 10 frames", lost=0.0, hidden_chance=0.01),
        case("lost-20", "a fifth of all samples lost, in gaps of heavy-tailed lengths", lost=0.2),
        case("desync-6", "the video's clock is 6 frames off and nobody says so", desync_frames=6),
        case("near-still", "a tenth of the movement", still=0.1),
        case("shape-inside", "a body that the shape basis can reach", shape="inside"),
        case("5-ghosts", "five trajectories that belong to nobody", ghosts=5),
        case("5-swaps", "five times two trajectories are exchanged for good", swaps=5),
        case("video-flips", "the video takes left for right in some spans", video_flips=3),
        case("video-lost", "the video loses the person for 20 % of the time", video_lost=0.2),
        case("video-shape", "the video's program says a wrong shape", video_wrong_shape=True),
    ]
    if gaps is not None:
        cases.append(case("real-gaps", f"lost as in real recordings ({gaps.name})", lost=0.0, gap_statistics=gaps))
    return tuple(cases)


def parts(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """One part of the body with ten markers."""
    return tuple(
        Case(
            f"{part.replace('_', '-')}-x{noise}",
            replace(usual(frames), markers=10, part=part, video_noise=float(noise)),
            f"ten markers on the {part.replace('_', ' ')} alone, {noise} times the video's usual error",
        )
        for noise in (1, 3)
        for part in PARTS
    )


def layouts(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """Places where laboratories put markers, hit by hands that miss them, beside places that mean nothing."""
    named = {"plug-in-gait": "plug_in_gait", "ior": "ior", "cast": "cast", "full-body": "full_body"}
    return (
        Case("40-anywhere", usual(frames), "forty markers anywhere: nothing to be drawn to"),
        *(
            Case(
                f"{name}-{by}-mm",
                replace(usual(frames), layout=layout, misplaced_mm=float(by)),  # type: ignore[arg-type]
                f"the layout {name}, each marker {by} mm beside its place",
            )
            for name, layout in named.items()
            for by in (5, 10, 20, 30)
        ),
    )


def bodies(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """Bodies like those that the program knows, beside others; skin that moves as much as on real thighs."""
    base = usual(frames)
    other = replace(base, spread=1.2, bones=0.06, bumps=0.015, centres_mm=8.0, slide=2.0)
    return (
        Case("own-family", base, "the usual case"),
        Case("own-family-soft-tissue", replace(base, slide=3.0), "skin that slides up to 18 mm on the thigh"),
        Case("other-bodies", other, "proportions, skin and joint centres that no coefficients reach"),
        *(
            Case(f"other-bodies-{name}", replace(other, layout=layout), f"the same with the layout {name}")  # type: ignore[arg-type]
            for name, layout in {"plug-in-gait": "plug_in_gait", "ior": "ior", "cast": "cast"}.items()
        ),
    )


def scaling(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """Time and memory against frames, and against markers."""
    long = tuple(Case(f"{count}-frames", usual(count), "40 markers") for count in (frames, 10 * frames, 100 * frames))
    many = tuple(
        Case(f"{count}-markers", replace(usual(frames), markers=count), f"{frames} frames")
        for count in (20, 50, 100, 150)
    )
    return (*long, *many)


def ablation(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """One case, for methods with something left out."""
    return (Case("40-markers", usual(frames), "the usual case"),)


def short(frames: int, gaps: Path | None) -> tuple[Case, ...]:
    """Two small cases, to see that everything works."""
    frames = min(frames, 90)
    return (
        Case("40-markers", usual(frames), "the usual case"),
        Case("left-leg", replace(usual(frames), markers=10, part="left_leg"), "ten markers on one leg"),
    )


SUITES: dict[str, Callable[[int, Path | None], tuple[Case, ...]]] = {
    "accuracy": accuracy,
    "parts": parts,
    "layouts": layouts,
    "bodies": bodies,
    "scaling": scaling,
    "ablation": ablation,
    "short": short,
}


def cases_of(suite: str, names: tuple[str, ...], frames: int = FRAMES, gaps: Path | None = None) -> tuple[Case, ...]:
    """The cases of a suite, or those of them that are named.

    Raises
    ------
    InputError : there is no such suite or case
    """
    if suite not in SUITES:
        known_suites = ", ".join((*SUITES, "clean", "neural"))  # these two declare no cases
        raise InputError(f'there is no suite "{suite}"', remedy=f"use one of: {known_suites}")
    cases = SUITES[suite](frames, gaps)
    known = {case.name: case for case in cases}
    for name in names:
        if name not in known:
            raise InputError(f'suite {suite} has no case "{name}"', "--cases", f"use some of: {', '.join(known)}")
    return tuple(known[name] for name in names) if names else cases
