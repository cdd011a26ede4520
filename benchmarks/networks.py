"""A network for a named layout, trained and examined: how far off it is when markers are not quite where they belong.

    python -m benchmarks.networks MOTIONS OUT [--layout full_body] [--minutes 11] [--size compact|paper|holden]
                                              [--start OUT/net.safetensors]

MOTIONS is a folder of BVH and AMC files; kinds of action named in ``markerscope.solver.bench.neural.UNSEEN`` are held
out, and the last 15 % of every other motion. OUT gets ``net.safetensors`` and ``net.json``. ``--start`` goes on with
weights. Prints a Markdown table: 60 spans of 32 frames, on bodies outside of the shape basis that were not learnt from.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from markerscope.solver.bench.neural import held_out
from markerscope.solver.body.model import Body
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.io.atomic import make_folder, write_text_atomic
from markerscope.solver.neural.layout import named_layout
from markerscope.solver.neural.metrics import angles_between, jpe
from markerscope.solver.neural.per_layout.build import Choice
from markerscope.solver.neural.per_layout.heterogeneous import COMPACT, Sizes
from markerscope.solver.neural.per_layout.named import Solver, load_solver, save_solver, solve, train_solver
from markerscope.solver.neural.per_layout.solving import samplers
from markerscope.solver.neural.training.examples import Sampler, generator
from markerscope.solver.neural.training.library import RATE, by_kind, load_library, procedural_clips
from markerscope.solver.neural.training.train import TrainSettings
from markerscope.solver.neural.weights import Card

PLACEMENTS_MM = (0.0, 2.0, 5.0)
CHOICES = {"compact": Choice(sizes=COMPACT, batch=96), "paper": Choice(sizes=Sizes()), "holden": Choice(kind="holden")}
LEARNT, MADE, SPANS, FRAMES = 0.85, 120, 60, 32
WRISTS = [INDEX["left_wrist"], INDEX["right_wrist"]]


@dataclass(frozen=True)
class Row:
    """Markers misplaced by ``placement_mm`` along each axis; JOE in degrees, JPE in cm."""

    kinds: str
    placement_mm: float
    joe: float
    joe_without_wrists: float
    jpe: float
    frames_per_s: float


def examine(solver: Solver, body: Body, sampler: Sampler, kinds: str, placement_mm: float) -> Row:
    """The mean over the 22 joints of the body, and over 20."""
    own = replace(sampler, settings=replace(sampler.settings, placement_mm=placement_mm))
    drawn = own.draw(solver.layout, SPANS, generator(5), FRAMES)
    turns, places, seconds = [], [], 0.0
    for i in range(SPANS):
        span = slice(i * FRAMES, (i + 1) * FRAMES)
        markers = drawn.markers[span].numpy().astype(float)
        start = time.process_time()
        said = solve(solver, markers, RATE, body)
        seconds += time.process_time() - start
        turns.append(angles_between(said.rotations, drawn.rotations[span].numpy())[:, :22].mean(axis=0))
        places.append(jpe(said.joints, drawn.joints[span].numpy()))
    joint = sum(turns) / SPANS
    others = [j for j in range(22) if j not in WRISTS]
    mean = float(joint.mean()), float(joint[others].mean()), float(sum(places) / SPANS)
    return Row(kinds, placement_mm, *mean, SPANS * FRAMES / seconds)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motions", type=Path)
    parser.add_argument("out", type=Path)
    parser.add_argument("--layout", default="full_body", choices=("full_body", "body_53", "body_hands"))
    parser.add_argument("--minutes", type=float, default=11.0)
    parser.add_argument("--size", default="compact", choices=tuple(CHOICES))
    parser.add_argument("--start", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    out = make_folder(given.out)
    body = Body.load()
    recorded = load_library([given.motions])
    known, unseen = by_kind(recorded, held_out(recorded))
    # Each recording is a kind of its own, so that it is drawn as often as a kind of made motion.
    parts = tuple(replace(clip.part(0, LEARNT), kind=clip.name) for clip in known)
    seen = tuple(clip.part(LEARNT, 1) for clip in known)
    learnt, judged = samplers(body, (*procedural_clips(MADE, 0), *parts), seen)
    layout = named_layout(body, given.layout)
    solver, card = (None, None) if given.start is None else load_solver(given.start, layout)
    steps, seconds, cpu, figures = (0, 0.0, 0.0, {}) if card is None else (card.steps, card.seconds, 0.0, card.figures)
    if given.minutes > 0 or solver is None:
        settings = TrainSettings(seconds=60 * given.minutes, seed=given.seed, patience=None, average=0.99)
        start = time.process_time()
        solver, found = train_solver(
            body, layout, (learnt, judged), CHOICES[given.size], settings, start=solver,
            checkpoint=out / "net.checkpoint", progress=lambda share, said: print(f"\r{said:100.100}", end=""),
        )  # fmt: skip
        cpu = time.process_time() - start
        figures = found["body"].figures
        steps, seconds = steps + found["body"].steps, seconds + sum(one.seconds for one in found.values())
    data = (f"recordings in {given.motions.name}", f"{MADE} motions of the program's own")
    save_solver(out / "net.safetensors", solver, Card("", {}, "", (), data, figures, given.seed, steps, seconds))
    rows = [
        examine(solver, body, replace(judged, clips=clips), kinds, placement)
        for placement in PLACEMENTS_MM
        for kinds, clips in (("seen", seen), ("unseen", unseen))
    ]
    said = {"layout": given.layout, "markers": len(layout), "size": given.size, "steps": steps, "seconds": seconds}
    said |= {"cpu_seconds_here": cpu, "unseen": sorted({clip.kind for clip in unseen})}
    write_text_atomic(out / "net.json", json.dumps(said | {"rows": [asdict(row) for row in rows]}, indent=1) + "\n")
    print(f"\n{len(layout)} markers, {steps} steps in {seconds / 60:.1f} min ({cpu / 60:.1f} min of processor here)\n")
    print(
        "| kinds | markers misplaced mm | JOE deg | without wrists | JPE cm | frames/s |\n| --- " * 1
        + "| --- " * 5
        + "|"
    )
    for row in rows:
        print(
            f"| {row.kinds} | {row.placement_mm:g} | {row.joe:.2f} | {row.joe_without_wrists:.2f} | {row.jpe:.2f} | "
            f"{row.frames_per_s:.0f} |"
        )


if __name__ == "__main__":
    main()
