"""Foot strikes and offs against force plates and laboratories' own events; repetitions; cycles against a known truth.

    python -m benchmarks.events DATA [--solved DIR] [--draws 200] [--walks 2]

DATA is the folder of real recordings. Steps: every trial with plates (20 N) in ``gait`` and ``subject4`` and, apart,
two more recordings with gaps or a slow clock; 0.1 s at the ends of a trial are left out. ``--solved DIR`` judges
the solved bodies of ``DIR/TRIAL-solved`` too. Repetitions: squats and sit-to-stand, both knees, white noise of 5
degrees. Cycles (synthetic): walks made and solved here, the mean curves of each side against those of the true body,
both cut at the events that the solved body tells.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from markerscope.solver.angles.angles import world_rotations
from markerscope.solver.body.model import Body
from markerscope.solver.commands import solve_session
from markerscope.solver.commands.synth import make_session
from markerscope.solver.commands.trial import Trial, events_of_trial, load_trial
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest, SynthRequest
from markerscope.solver.cycles.curve import CutCurve, cut_all, peaks_of
from markerscope.solver.cycles.cycle import Cycle, gait_cycles
from markerscope.solver.cycles.gait import gait_curves, progression
from markerscope.solver.events.event import Event
from markerscope.solver.events.feet import feet_of_body
from markerscope.solver.events.repetitions import find_repetitions
from markerscope.solver.io.mot import read_mot
from markerscope.solver.synth.files import MARKERS, PRIOR
from markerscope.solver.synth.truth import TRUTH, load_truth

ENDS_S, SAME_S = 0.1, 0.2
GAIT = ("HC002D06", "HC031A06", "HC033A10", "HC036A10", "HC036A23", "HC039A17", "HC044A15")
WALKS = ("walking1", "walkingTI1", "walkingTS1")
JUDGED = ("hip_flexion", "knee_flexion", "ankle_dorsiflexion")
NOISE_DEG = 5.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path)
    parser.add_argument("--solved", type=Path, metavar="DIR")
    parser.add_argument("--draws", type=int, default=200)
    parser.add_argument("--walks", type=int, default=2)
    options = parser.parse_args()
    steps(options.data, options.solved)
    repetitions(options.data, options.draws)
    if options.walks:
        cycles(options.walks)


def steps(data: Path, solved: Path | None) -> None:
    print("| feet | against | event | n | missed | bias | median | 95 % (ms) |\n|---|---|---|---:|---:|---:|---:|---:|")
    gait = [(load_trial(data / "gait" / f"{name}.c3d"), None) for name in GAIT]
    walks = [(load_trial(data / "subject4" / f"{name}.trc"), data / "subject4" / f"{name}_grf.mot") for name in WALKS]
    print_rows("markers, gait + subject4", "plates", gait + walks, plates_of)
    print_rows("markers, gait", "the files' own", gait, recorded_of)
    apart = [(load_trial(data / "fullbody" / "mcgill_HC040A14_raw_unlabeled.c3d"), None)]
    print_rows("markers, McGill (gaps)", "plates", apart, plates_of)
    print_rows("markers, McGill (gaps)", "the file's own", apart, recorded_of)
    slow = [(load_trial(data / "fullbody" / "Walk1.c3d"), None)]
    print_rows("markers, Walk1 (60 Hz)", "plates", slow, plates_of)
    print_rows("markers, Walk1 (60 Hz)", "the file's own", slow, recorded_of)
    if solved is not None:
        bodies = [(load_trial(solved / f"{name}-solved"), plates) for name, (_, plates) in zip(WALKS, walks)]
        truth = {id(body): one for (body, _), one in zip(bodies, walks)}
        print_rows("solved body, subject4", "plates", bodies, lambda trial, _: plates_of(*truth[id(trial)]))


def plates_of(trial: Trial, plates: Path | None) -> tuple[Event, ...]:
    return events_of_trial(trial, "plates", plates).events


def recorded_of(trial: Trial, plates: Path | None) -> tuple[Event, ...]:
    try:
        return events_of_trial(trial, "file").events
    except InputError:  # not every file has its own
        return ()


def print_rows(
    feet: str,
    against: str,
    trials: Sequence[tuple[Trial, Path | None]],
    reference: Callable[[Trial, Path | None], tuple[Event, ...]],
) -> None:
    for kind in ("foot_strike", "foot_off"):
        errors, missed = [], 0
        for trial, plates in trials:
            found = events_of_trial(replace(trial, original=None), "body" if trial.body else "markers").events
            for event in reference(trial, plates):
                if event.kind != kind or not trial.time[0] + ENDS_S <= event.time <= trial.time[-1] - ENDS_S:
                    continue
                near = [e.time - event.time for e in found if e.kind == kind and e.side == event.side]
                off = min(near, key=abs, default=np.inf)
                if abs(off) > SAME_S:
                    missed += 1
                else:
                    errors.append(1000 * off)
        own = np.array(errors)
        if not len(own):
            continue
        spread = " | ".join(f"{v:+.0f}" if i == 0 else f"{v:.0f}" for i, v in enumerate(
            (np.mean(own), np.median(np.abs(own)), np.percentile(np.abs(own), 95))
        ))  # fmt: skip
        print(
            f"| {feet} | {against} | {kind.replace('_', ' ')} | {len(own) + missed} | {missed} | {spread} |", flush=True
        )


def repetitions(data: Path, draws: int) -> None:
    print(f"\n| repetitions, {NOISE_DEG:g} degrees of noise | draws with 5 of 5 |\n|---|---:|")
    rng = np.random.default_rng(0)
    for file in ("squat_video/squats1_ik.mot", "subject4/STS1_ik.mot"):
        table = read_mot(data / file)
        for angle in ("knee_angle_l", "knee_angle_r"):
            values = table.in_degrees()[angle]
            right = 0
            for _ in range(draws):
                try:
                    right += len(find_repetitions(table.time, values + rng.normal(0, NOISE_DEG, len(values)))) == 5
                except InputError:
                    continue
            print(f"| {file}, {angle} | {right} of {draws} |", flush=True)


def cycles(walks: int) -> None:
    print("\n| synthetic walks: | side | mean curve, RMS (deg) | less its offset | range of motion, off by (deg) |")
    print("|---|---|---:|---:|---:|")
    ours: dict[tuple[str, str], list[CutCurve]] = {}
    theirs: dict[tuple[str, str], list[CutCurve]] = {}
    for seed in range(1, walks + 1):
        with TemporaryDirectory() as place:
            made, out = Path(place) / "made", Path(place) / "solved"
            make_session(SynthRequest("walk", made, seed, None, None, {"frames": 1000, "rate": 100.0}))
            solve_session(SolveRequest(made / MARKERS, prior=made / PRIOR, out=out), silent)
            trial = load_trial(out)
            own = gait_cycles(events_of_trial(trial).events)
            assert trial.body is not None
            solved, truth = trial.body, load_truth(made / TRUTH)
            both = (
                (ours, curves_of(solved.body, solved.betas, solved.time, solved.rotations, solved.joints, own)),
                (
                    theirs,
                    curves_of(truth.body, truth.betas, truth.motion.time, truth.motion.rotations, truth.joints, own),
                ),
            )
            for gathered, curves in both:
                for curve in curves:
                    gathered.setdefault((curve.name, curve.side), []).append(curve)
    for (name, side), found in ours.items():
        true = theirs[name, side]
        off = [a.summary.mean - b.summary.mean for a, b in zip(found, true)]
        rms = np.mean([np.sqrt(np.mean(o**2)) for o in off])
        less = np.mean([np.std(o) for o in off])
        ranges = [
            np.mean([r.value for r in peaks_of(a) if r.quantity.endswith(" range")])
            - np.mean([r.value for r in peaks_of(b) if r.quantity.endswith(" range")])
            for a, b in zip(found, true)
        ]
        print(f"| {name} | {side} | {rms:.1f} | {less:.1f} | {np.mean(np.abs(ranges)):.1f} |", flush=True)


def curves_of(
    body: Body, betas: np.ndarray, time: np.ndarray, rotations: np.ndarray, joints: np.ndarray, own: Sequence[Cycle]
) -> list[CutCurve]:
    turn, landmarks, rest = world_rotations(rotations), body.landmarks(betas), body.joints(betas)
    ahead, _ = progression(feet_of_body(time, 1 / (time[1] - time[0]), turn, joints, rest, landmarks))
    curves = gait_curves(time, turn, landmarks, rest, ahead)
    return [curve for curve in cut_all([("walk", curves, own)]) if curve.name in JUDGED]


if __name__ == "__main__":
    main()
