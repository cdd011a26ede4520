"""How well a known body serves further trials without a video, and whether another person is noticed.

    python -m benchmarks.subjects OUT [--subjects 20] [--seed 1]

Synthetic subjects outside the shapes that the solver knows, skin that slides: a squat with a video's poses, then four
other movements of the same person without. Each trial is solved with its own video too, for comparison; in the last
one another person with markers at the same anatomical places is put in as well. One line of JSON a trial goes to OUT;
what is there already is not solved again. Prints a Markdown table of all that is in OUT.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.solver.bench.measure import near_bones
from markerscope.solver.bench.methods import Given, run_stages
from markerscope.solver.body.bones import load_body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.known.body import known_body
from markerscope.solver.fit.known.method import comparison, pose_of
from markerscope.solver.fit.known.person_file import read_person, write_person
from markerscope.solver.synth.session import SynthSession, synthesise
from markerscope.solver.synth.settings import SynthSettings

ACTS = ("walk", "reach", "lunge", "throw")
LAYOUTS = ("uniform", "plug_in_gait", "full_body", "uniform")
COMPARED = ("walk", "throw")
"""Trials that are solved with their own video, too."""
FRAMES = 240
_TWELVE = [
    JOINTS.index(f"{side}_{joint}")
    for side in ("left", "right")
    for joint in ("hip", "knee", "ankle", "shoulder", "elbow", "wrist")
]
_HIPS = [JOINTS.index("left_hip"), JOINTS.index("right_hip")]


def main() -> None:
    """Solve what is not solved yet and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--subjects", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    known = {(row["seed"], row["subject"]) for row in read(options.out)}
    for subject in range(options.subjects):
        if (options.seed, subject) in known:
            continue
        rows = subject_rows(subject, options.seed)
        with options.out.open("a") as file:
            for row in rows:
                file.write(json.dumps({"seed": options.seed, "subject": subject, **row}) + "\n")
    print(table(read(options.out)))


def read(out: Path) -> list[dict[str, Any]]:
    """All rows so far."""
    return [json.loads(line) for line in out.read_text().splitlines()] if out.exists() else []


def drawn(act: str, layout: str, seed: int, misplaced: float = 7.5) -> SynthSession:
    """A trial of the person with that seed; hands that put the markers of a named layout on miss by so many mm."""
    misplaced = 0.0 if layout == "uniform" else misplaced
    settings = SynthSettings(frames=FRAMES, layout=layout, misplaced_mm=misplaced, lost=0.02)  # type: ignore[arg-type]
    return synthesise(act, settings, seed)


def given(session: SynthSession) -> Given:
    """What a method is given of it."""
    return Given(session.markers, session.prior, session.nominal_offset)


def subject_rows(subject: int, seed: int) -> list[dict[str, Any]]:
    """One subject: the trial that determines the body, the others, another person."""
    layout, own = LAYOUTS[subject % len(LAYOUTS)], 1000 * seed + subject
    first = drawn("squat", layout, own)
    results, _ = run_stages("bundle", given(first), {}, "check", silent)
    motion = results["fit"]
    rows = [{"act": "squat", "kind": "first", "layout": layout, **judged(first, results)}]
    with tempfile.TemporaryDirectory() as folder:
        person = Path(folder) / "person.npz"
        write_person(person, known_body(load_body(None), motion))
        for act in ACTS:
            session = drawn(act, layout, own)
            if act in COMPARED:
                with_video, _ = run_stages("bundle", given(session), {}, "check", silent)
                rows.append({"act": act, "kind": "video", "layout": layout, **judged(session, with_video)})
            rows.append({"act": act, "kind": "known", "layout": layout, **followed(session, person)})
        if layout == "uniform":  # another person has random markers elsewhere: the layout itself would tell
            layout = "full_body" if subject % 2 else "plug_in_gait"
            again = drawn("squat", layout, own)
            results, _ = run_stages("bundle", given(again), {}, "check", silent)
            write_person(person, known_body(load_body(None), results["fit"]))
        other = drawn("walk", layout, own + 500)
        rows.append({"act": "walk", "kind": "another person", "layout": layout, **followed(other, person)})
        moved = drawn("reach", layout, own, misplaced=25.0)
        rows.append({"act": "reach", "kind": "markers moved", "layout": layout, **followed(moved, person)})
        same = drawn("walk", layout, own)
        rows.append({"act": "walk", "kind": "same person", "layout": layout, **followed(same, person)})
    return rows


def followed(session: SynthSession, person: Path) -> dict[str, Any]:
    """A trial without a video by what is known of a person."""
    start = time.process_time()
    try:
        files = {"known_file": person, "prior_file": None}
        begun, _ = run_stages("known", given(session), {}, "known", silent, files)
        begun["prior"] = pose_of(begun["known"], session.markers)
        results, _ = run_stages("known", given(session), {}, "check", silent, begun)
    except InputError as error:
        return {"refused": str(error), "cpu": time.process_time() - start}
    return {"cpu": time.process_time() - start, **judged(session, results), **compared(results, person)}


def judged(session: SynthSession, results: dict[str, Any]) -> dict[str, Any]:
    """Figures against the truth; markers count as right on a bone next to their own."""
    motion, truth = results["fit"], session.truth
    off = 1000 * np.linalg.norm(motion.joints - truth.joints, axis=2)
    ranks = results["orient"]
    return {
        "mpjpe": float(off[:, _TWELVE].mean()),
        "hips": float(off[:, _HIPS].mean()),
        "right": near_bones(motion.marker_joint, truth.marker_joint),
        "confidence": results["check"].confidence,
        "margin": ranks.margin,
        "residual": float(1000 * np.nanmedian(motion.residual)),
        "doubts": [d.sentence for d in results["check"].doubts] + list(motion.warnings),
    }


def compared(results: dict[str, Any], person: Path) -> dict[str, Any]:
    """What freeing the shape, and the places, would gain: what a doubt about the person rests on."""
    body = load_body(None)
    found = comparison(body, read_person(person, body), results["known"], results["clean"].measured.positions)
    return {
        "held": 1000 * found.held_m,
        "shape": 1000 * found.shape_m,
        "places": 1000 * found.places_m,
        "longer": found.longer,
        "moved": float(1000 * np.median(found.moved_m)),
        "moved_most": float(1000 * found.moved_m.max()),
    }


def table(rows: list[dict[str, Any]]) -> str:
    """Means by kind, and how often another person was noticed."""
    lines = [
        "| | trials | 12-joint MPJPE (mm) | hips (mm) | markers on the right bone | CPU s |",
        "|---|---|---|---|---|---|",
    ]
    for kind in ("first", "video", "known", "same person", "markers moved", "another person"):
        own = [row for row in rows if row["kind"] == kind and "mpjpe" in row]
        if own:
            cpu = [row["cpu"] for row in own if "cpu" in row]
            lines.append(
                f"| {kind} | {len(own)} | {np.mean([r['mpjpe'] for r in own]):.1f} | "
                f"{np.mean([r['hips'] for r in own]):.1f} | {100 * np.mean([r['right'] for r in own]):.1f} % | "
                f"{f'{np.mean(cpu):.1f}' if cpu else ''} |"
            )
    for kind in ("same person", "known", "markers moved", "another person"):
        own = [row for row in rows if row["kind"] == kind]
        noticed = sum("refused" in row or bool(row["doubts"]) for row in own)
        lines.append(f"\n{kind}: {noticed} of {len(own)} with a doubt or refused")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
