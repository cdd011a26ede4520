"""Sessions in which something is wrong that a solve has to notice, and sound ones beside them; all of known truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from markerscope.solver.bench.motions import MotionSource, find_motions, read_source
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX, mirror_index
from markerscope.solver.synth.session import SynthSession, synthesise
from markerscope.solver.synth.settings import SynthSettings

FRAMES = 300
_ACROSS = np.diag([-1.0, 1, 1])
_PARTS: Mapping[str, tuple[str, ...]] = {
    "legs": tuple(f"{side}_{bone}" for side in ("left", "right") for bone in ("hip", "knee", "ankle", "foot")),
    "arms": tuple(f"{side}_{bone}" for side in ("left", "right") for bone in ("shoulder", "elbow", "wrist")),
}
SOUND = ("full", "legs", "arms", "left_leg", "right_leg", "left_arm", "right_arm")
ASYMMETRIC = ("lunge", "reach", "kick", "throw")


@dataclass(frozen=True)
class Trial:
    """What a solve is given, and what it is judged by.

    Attributes
    ----------
    kind, number : which
    markers, prior : what the solve is given
    joint : (M,) true bone of each marker, -1 for those that are not the person's
    root : (T, 3, 3) true turn of the pelvis in the lab
    video : times the usual error of the video
    settings : the session's, in words
    """

    kind: str
    number: int
    markers: Markers
    prior: PosePrior
    joint: np.ndarray
    root: np.ndarray
    video: float = 1.0
    settings: str = ""


def movements(data: Path | None) -> tuple[MotionSource, ...]:
    """The program's own movements, and the recorded ones where there are any."""
    own = find_motions(None, 99)
    return own if data is None else own + find_motions(data / "motion", 24)


def sound(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """A session with nothing wrong: part, number of markers and the video's errors by turns."""
    part = SOUND[number % len(SOUND)] if number % 2 else "full"
    count, video = (20, 40)[number // 2 % 2], (1.0, 2.0, 3.0)[number // 4 % 3]
    source = sources[(number * 7 + seed) % len(sources)]
    session = drawn(source, seed + number, part, count, video)
    return _trial(part, number, session, f"{source.name} {count} x{video:g}")


def drawn(source: MotionSource, seed: int, part: str = "full", count: int = 40, video: float = 1.0) -> SynthSession:
    """A session of a movement; ``part`` is one of ``SOUND``."""
    settings = SynthSettings(frames=FRAMES, markers=count, video_noise=video)
    if part == "full":
        return synthesise(read_source(source), settings, seed)
    if part not in _PARTS:
        return synthesise(read_source(source), replace(settings, part=part), seed)
    whole = synthesise(read_source(source), replace(settings, markers=150, apart_mm=25.0), seed)
    there = np.flatnonzero(np.isin(whole.truth.marker_joint, [INDEX[name] for name in _PARTS[part]]))[:count]
    return replace(
        whole,
        markers=whole.markers.select(markers=there),
        truth=replace(whole.truth, marker_joint=whole.truth.marker_joint[there]),
    )


def _trial(kind: str, number: int, session: SynthSession, settings: str) -> Trial:
    truth = session.truth
    return Trial(
        kind,
        number,
        session.markers,
        session.prior,
        truth.marker_joint,
        truth.motion.rotations[:, 0],
        session.settings.video_noise,
        settings,
    )


def _with_others(trial: Trial, more: np.ndarray, seed: int) -> Trial:
    """The trial with columns (T, N, 3) m that are not the person's, in any order."""
    joined = np.concatenate([trial.markers.positions, more], axis=1)
    order = np.random.default_rng(seed).permutation(joined.shape[1])
    joint = np.concatenate([trial.joint, np.full(more.shape[1], -1)])[order]
    labels = tuple(f"M{i + 1:02d}" for i in range(len(order)))
    return replace(trial, markers=replace(trial.markers, positions=joined[:, order], labels=labels), joint=joint)


def _beside(own: Trial, other: np.ndarray, root: np.ndarray, rng: np.random.Generator, apart: float) -> np.ndarray:
    """Another person's markers (T, N, 3) m, so far from the first that their pelvises are never nearer, m."""
    theirs = np.nanmean(own.markers.positions, axis=1)[:, :2]
    turn = rng.uniform(0, 2 * np.pi)
    direction = np.array([np.cos(turn), np.sin(turn)])
    between = root[:, :2] - theirs
    shift = -np.median(between, axis=0)
    distance = apart
    while np.linalg.norm(between + shift + distance * direction, axis=1).min() < apart:
        distance += 0.05
    moved: np.ndarray = other + np.append(shift + distance * direction, 0.0)
    return moved


def two_people(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """Two whole people in one file, from 0.7 m apart; the video shows the first."""
    rng = np.random.default_rng([seed, number])
    apart = (0.7, 0.8, 1.0, 1.2, 1.5)[number % 5]
    return _second_person(number, seed, sources, rng, apart, 40)


def few_of_another(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """Six or so markers on a hand or a foot of somebody else."""
    rng = np.random.default_rng([seed, number])
    return _second_person(number, seed, sources, rng, (0.7, 0.9, 1.2)[number % 3], 4 + number % 5)


def _second_person(
    number: int, seed: int, sources: tuple[MotionSource, ...], rng: np.random.Generator, apart: float, count: int
) -> Trial:
    first, second = sources[(3 * number + seed) % len(sources)], sources[(5 * number + 2 + seed) % len(sources)]
    own = drawn(first, seed + number)
    other = drawn(second, seed + 5000 + number)
    chosen = np.arange(40)
    if count < 40:
        limbs = (
            ("left_wrist", "left_elbow"),
            ("right_ankle", "right_foot", "right_knee"),
            ("right_wrist", "right_elbow"),
        )
        bones = [INDEX[name] for name in limbs[number % 3]]
        other = drawn(second, seed + 5000 + number, "arms" if number % 3 != 1 else "legs", 40)
        chosen = np.flatnonzero(np.isin(other.truth.marker_joint, bones))[:count]
    trial = _trial(
        "two people" if count == 40 else "few of another", number, own, f"{first.name} + {second.name} {apart}"
    )
    positions, root = other.markers.positions[:, chosen], other.truth.motion.trans
    frames = min(len(positions), len(trial.markers.positions))
    trial = _shortened(trial, frames)
    return _with_others(trial, _beside(trial, positions[:frames], root[:frames], rng, apart), seed + number)


def _shortened(trial: Trial, frames: int) -> Trial:
    if len(trial.markers.positions) == frames:
        return trial
    return replace(trial, markers=trial.markers.select(slice(0, frames)), root=trial.root[:frames])


def props(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """Markers on things that stand about the person: a chair, a step, a force plate."""
    rng = np.random.default_rng([seed, number])
    source = sources[(3 * number + 1 + seed) % len(sources)]
    trial = _trial("props", number, drawn(source, seed + number), source.name)
    count, frames = 6 + number % 7, len(trial.markers.positions)
    reach = np.nanmax(trial.markers.positions, axis=(0, 1)) - np.nanmin(trial.markers.positions, axis=(0, 1))
    low = np.nanmin(trial.markers.positions, axis=(0, 1))
    middle = low + rng.uniform(0, 1, 3) * reach * [1, 1, 0.4]
    stand = middle + rng.uniform(-0.25, 0.25, (count, 3))
    more = stand + rng.normal(0, 0.0003, (frames, count, 3))
    return _with_others(trial, more, seed + number)


def cluster(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """One rigid plate with four to eight markers on a thigh, a shank or an upper arm, and nothing else."""
    rng = np.random.default_rng([seed, number])
    source = sources[(3 * number + 2 + seed) % len(sources)]
    session = drawn(source, seed + number)
    joint = INDEX[("left_hip", "right_knee", "left_shoulder", "right_hip", "left_knee")[number % 5]]
    truth = session.truth
    from markerscope.solver.angles.angles import world_rotations

    turns = world_rotations(truth.motion.rotations)[:, joint]
    on = np.array([0.0, -0.2, 0.05]) + rng.uniform(-0.05, 0.05, (4 + number % 5, 3))
    positions = truth.joints[:, joint, None] + np.einsum("tij,mj->tmi", turns, on)
    positions += rng.normal(0, 0.0004, positions.shape)
    labels = tuple(f"M{i + 1:02d}" for i in range(len(on)))
    markers = Markers(positions, session.markers.rate, labels)
    return Trial("cluster", number, markers, session.prior, np.full(len(on), joint), truth.motion.rotations[:, 0])


def other_video(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """The video of another movement by another person."""
    first, second = sources[(3 * number + seed) % len(sources)], sources[(5 * number + 3 + seed) % len(sources)]
    if first == second:
        second = sources[(5 * number + 4 + seed) % len(sources)]
    trial = _trial("other video", number, drawn(first, seed + number), f"{first.name} / {second.name}")
    return replace(trial, prior=drawn(second, seed + 7000 + number).prior)


def mirrored_video(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """A video that was mirrored, of a movement whose sides differ."""
    uneven = [source for source in sources if source.name in ASYMMETRIC or source.path is not None]
    source = uneven[(3 * number + seed) % len(uneven)]
    trial = _trial("mirrored", number, drawn(source, seed + number), source.name)
    return replace(trial, prior=replace(trial.prior, rotations=mirror_image(trial.prior.rotations)))


def mirror_image(rotations: np.ndarray) -> np.ndarray:
    """Poses (F, 24, 3, 3), root in the camera's axes, as seen in a mirrored picture."""
    mirrored: np.ndarray = _ACROSS @ rotations[:, mirror_index()] @ _ACROSS
    return mirrored


def panning(number: int, seed: int, sources: tuple[MotionSource, ...]) -> Trial:
    """A video whose camera turns after the person, by 50 to 140 degrees in all."""
    source = sources[(3 * number + 4 + seed) % len(sources)]
    trial = _trial("panning", number, drawn(source, seed + number), source.name)
    share = np.linspace(-0.5, 0.5, len(trial.prior.time))
    turn = exp_so3(np.radians(50 + 10 * number) * share[:, None] * np.array([0.0, 1.0, 0.0]))
    rotations = trial.prior.rotations.copy()
    rotations[:, 0] = turn @ rotations[:, 0]
    return replace(trial, prior=replace(trial.prior, rotations=rotations))


TRAPS: Mapping[str, Callable[[int, int, tuple[MotionSource, ...]], Trial]] = {
    "two people": two_people,
    "few of another": few_of_another,
    "props": props,
    "cluster": cluster,
    "other video": other_video,
    "mirrored": mirrored_video,
    "panning": panning,
}
