"""What a solve says where something is wrong, and where nothing is.

    python -m benchmarks.traps OUT [--data DATA] [--seed 1] [--each 10] [--sound 150] [--share 1/2]

Ten instances of each kind of trap (``benchmarks.trap_sessions``) and sound sessions beside them are solved; one line of
JSON each goes to OUT, and what is there already is not solved again, so a run can be broken off and several processes
can share the work (``--share``). DATA holds recorded movements in ``motion``; without it the program's own are used.
Prints a Markdown table of all that is in OUT.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.trap_sessions import TRAPS, Trial, movements, sound
from markerscope.solver.bench.measure import RIGHT_HEADING_DEG, heading_error_deg, near_bones
from markerscope.solver.bench.methods import Given, run_stages
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.fit.doubts.agreement import agreement
from markerscope.solver.fit.doubts.doubt import CAP
from markerscope.solver.fit.doubts.turn import camera_turn
from markerscope.solver.fit.observe import on_clock
from markerscope.solver.pipeline.stages import GRAPH

_RIGHT_BONES = 0.8
_RIGHT_OFFSET_S = 0.5
"""Markers and video share one clock in all sessions: whose offset is found to be more is doubted with good reason."""


def main() -> None:
    """Solve what is not solved yet and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--each", type=int, default=10)
    parser.add_argument("--sound", type=int, default=150)
    parser.add_argument("--kinds", help="some of the kinds, separated by commas; sound is one")
    parser.add_argument("--share", default="1/1", help="which of how many processes this is")
    options = parser.parse_args()
    mine, all_of = (int(n) for n in options.share.split("/"))
    sources = movements(options.data)
    kinds = options.kinds.split(",") if options.kinds else ["sound", *TRAPS]
    for i, (kind, number) in enumerate(_wanted(kinds, options.each, options.sound)):
        if i % all_of != mine - 1 or (kind, number, options.seed) in {
            (row["made"], row["number"], row["seed"]) for row in read(options.out)
        }:
            continue
        make = sound if kind == "sound" else TRAPS[kind]
        row = {"made": kind, "seed": options.seed, **judged(make(number, 1000 * options.seed, sources))}
        with options.out.open("a") as file:
            file.write(json.dumps(row) + "\n")
        print(json.dumps(row), flush=True)
    print("\n".join(table(read(options.out))))


def _wanted(kinds: list[str], each: int, sounds: int) -> Iterator[tuple[str, int]]:
    for kind in kinds:
        for number in range(sounds if kind == "sound" else each):
            yield kind, number


def read(path: Path) -> list[dict[str, Any]]:
    """The lines that are there."""
    return [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []


def judged(trial: Trial) -> dict[str, Any]:
    """Solve a trial as ``solve`` does, and say what it answered and how right that is."""
    given = Given(trial.markers, trial.prior)
    start = time.process_time()
    about = {"kind": trial.kind, "number": trial.number, "video": trial.video, "settings": trial.settings}
    try:
        found = run_stages("bundle", given, {}, "check", silent, {"sync": _sync(given)})[0]
    except InputError as error:
        return about | {"refused": str(error), "doubts": ["refused"], "confidence": 0.0, "right": False, "unnamed": 1.0}
    motion, ranked, verdict, sync = found["fit"], found["orient"], found["check"], found["sync"]
    foreign = trial.joint < 0
    heading = heading_error_deg(motion.rotations[:, 0], trial.root)
    bones = near_bones(motion.marker_joint, trial.joint)
    video, tracked = on_clock(trial.prior, motion.time, sync.offset, sync.rate_ratio)
    spread, drift = camera_turn(motion.rotations, video, tracked)
    return about | {
        "doubts": [doubt.kind for doubt in verdict.doubts],
        "warnings": list(motion.warnings),
        "confidence": verdict.confidence,
        "ranking": ranked.confidence,
        "margin": ranked.margin if np.isfinite(ranked.margin) else None,
        "refined_rival": ranked.runner_up >= 0 and ranked.candidates[ranked.runner_up].refined,
        "right": bool(bones >= _RIGHT_BONES and heading < RIGHT_HEADING_DEG),
        "bones": bones,
        "heading": heading,
        "unnamed": float((motion.marker_joint[foreign] < 0).mean()) if foreign.any() else None,
        "own_unnamed": int((motion.marker_joint[~foreign] < 0).sum()),
        "foreign": int(foreign.sum()),
        "sync": [sync.offset, sync.confidence],
        "m2s": 1000 * found["surface"].mean,
        "residual": 1000 * float(np.nanmedian(motion.residual)),
        "suspects": len(verdict.suspect),
        "agreement": agreement(motion.rotations, video, tracked, motion.marker_joint),
        "spread": spread,
        "drift": drift,
        "mirror": ranked.mirror,
        "seconds": time.process_time() - start,
    }


def _sync(given: Given) -> Any:
    """The offset as a solve finds it, whatever its confidence."""
    stages = {stage.name: stage for stage in GRAPH}
    before = run_stages("bundle", given, {}, "clean", silent)[0]
    sync = stages["sync"]
    inputs = {name: before.get(name, given.prior) for name in sync.inputs} | {"landmarks": None}
    return sync.run(sync.settings(), silent, **inputs)


def table(rows: list[dict[str, Any]]) -> list[str]:
    """The figures of all kinds."""
    lines = [
        "| kind | runs | in words | confidence at most 0.6 | right | foreign markers unnamed | own markers unnamed |",
        "|---|---|---|---|---|---|---|",
    ]
    for kind in TRAPS:
        own = [row for row in rows if row["made"] == kind]
        if not own:
            continue
        foreign = sum(row.get("foreign", 0) for row in own)
        unnamed = sum(row["unnamed"] * row["foreign"] for row in own if row.get("foreign"))
        lines.append(
            f"| {kind} | {len(own)} | {sum(bool(row['doubts'] or row.get('warnings')) for row in own)} "
            f"| {sum(row['confidence'] <= CAP for row in own)} | {sum(row['right'] for row in own)} "
            f"| {f'{100 * unnamed / foreign:.1f} %' if foreign else ''} "
            f"| {sum(row.get('own_unnamed', 0) for row in own) if foreign else ''} |"
        )
    sounds = [row for row in rows if row["made"] == "sound"]
    if sounds:
        lines += ["", *_sound_lines(sounds)]
    return lines


def _sound_lines(rows: list[dict[str, Any]]) -> list[str]:
    right = [row for row in rows if row["right"]]
    doubted = [row for row in right if row["doubts"]]
    wrongly = [row for row in doubted if abs(row["sync"][0]) <= _RIGHT_OFFSET_S]
    said = [row for row in right if row["warnings"] and not row["doubts"]]
    full = [row for row in rows if row["kind"] == "full" and row["video"] == 1]
    sure = sum(row["confidence"] >= 0.9 for row in full)
    surely_wrong = sum(not row["right"] and row["confidence"] >= 0.9 for row in rows)
    return [
        f"Sound sessions: {len(rows)}, of which {len(right)} were solved rightly.",
        f"Doubted although bones and heading are right: {len(doubted)} of {len(rows)} "
        f"({100 * len(doubted) / len(rows):.1f} %); the offset is right too in {len(wrongly)} "
        f"({100 * len(wrongly) / len(rows):.1f} %).",
        f"Right, not doubted, with a near tie or little movement said: {len(said)}.",
        f"Full bodies at video x1 with confidence of at least 0.9: {sure} of {len(full)} "
        f"({100 * sure / max(len(full), 1):.0f} %).",
        f"Wrong with confidence of at least 0.9: {surely_wrong}.",
    ]


if __name__ == "__main__":
    main()
