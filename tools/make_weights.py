"""Train the layout-agnostic network that ships.

    python -m tools.make_weights --motions FOLDER... --minutes 25 --out resources/neural/agnostic.safetensors

``--start`` goes on from weights there are, as for a body that was baked anew. A run that was stopped goes on where it
was. FOLDER holds motions whose licence allows what is derived from them to be given on; ``--data`` says on the weights'
card what they were.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import asdict
from pathlib import Path

from markerscope.solver.neural.layout_free.agnostic_solve import NETWORK
from markerscope.solver.neural.layout_free.pretrain import PretrainSettings, pretrain
from markerscope.solver.neural.training.library import load_library
from markerscope.solver.neural.training.train import TrainSettings


def main() -> None:
    """Train, write the weights in half precision, and print how good they are."""
    from markerscope.solver.neural.layout_free.agnostic import AgnosticSettings
    from markerscope.solver.neural.weights import Card, load_weights, save_weights

    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motions", type=Path, nargs="*", default=[])
    parser.add_argument("--minutes", type=float, default=25.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--clips", type=int, default=PretrainSettings.clips)
    parser.add_argument("--bodies", type=int, default=PretrainSettings.bodies)
    parser.add_argument("--start", type=Path, help="weights to go on from, instead of chance")
    parser.add_argument("--rate", type=float, default=1.5e-3, help="of learning, at its height")
    parser.add_argument("--data", nargs="*", default=["made motions of Markerscope (Apache-2.0)"])
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    clips = load_library(options.motions) if options.motions else ()
    settings = PretrainSettings(seed=options.seed, clips=options.clips, bodies=options.bodies)
    training = TrainSettings(
        seconds=60 * options.minutes, seed=options.seed, patience=None, rate=options.rate, average=0.998
    )
    sizes = AgnosticSettings()
    start = None
    if options.start is not None:
        start = {name: value.float() for name, value in load_weights(options.start, network=NETWORK)[0].items()}
    checkpoint = options.out.with_suffix(".checkpoint")
    found = pretrain(clips, training, settings, sizes, start=start, checkpoint=checkpoint, progress=_Lines())
    card = Card(
        NETWORK,
        {"sizes": asdict(sizes)},
        "",
        (),
        tuple(options.data),
        found.figures,
        options.seed,
        found.steps,
        found.seconds,
    )
    save_weights(options.out, {name: value.half() for name, value in found.params.items()}, card)
    print(json.dumps(found.figures))


class _Lines:
    """Prints now and then how far it is."""

    def __init__(self, every: float = 15.0) -> None:
        self._every, self._last = every, 0.0

    def __call__(self, fraction: float, text: str) -> None:
        if time.monotonic() - self._last > self._every:
            self._last = time.monotonic()
            print(f"{100 * fraction:.1f} %  {text}", flush=True)


if __name__ == "__main__":
    main()
