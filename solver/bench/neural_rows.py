"""The networks of the suite ``neural``: what is trained, for how long, and what is examined of it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from markerscope.solver.bench.neural import TUNING_MINUTES, Entry, Ground, Row, exams, scored
from markerscope.solver.bench.neural_exam import Recording, agnostic_answer, new_layout
from markerscope.solver.core.progress import Progress
from markerscope.solver.neural.training.train import TrainSettings


def _training(minutes: float, seed: int) -> TrainSettings:
    return TrainSettings(seconds=60 * minutes, seed=seed, patience=None)


def _graph(about: str, layout_name: str, **chosen: Any) -> Any:
    """The network on a graph of markers and joints, or Holden's, on a named layout."""

    def run(ground: Ground, minutes: float, key: str, progress: Progress) -> list[Row]:
        from markerscope.solver.neural.layout import named_layout
        from markerscope.solver.neural.per_layout.build import Choice
        from markerscope.solver.neural.per_layout.named import solve, train_solver
        from markerscope.solver.neural.per_layout.solving import samplers
        from markerscope.solver.neural.training.library import RATE

        layout = named_layout(ground.body, layout_name)  # type: ignore[arg-type]
        both = samplers(ground.body, ground.learnt, ground.seen, seed=ground.seed)
        solver, found = train_solver(
            ground.body,
            layout,
            both,
            Choice(batch=_BATCH, **({"sizes": _sizes()} | chosen)),
            _training(minutes, ground.seed),
            checkpoint=ground.folder / f"{key}.checkpoint",
            progress=progress,
        )
        trained = sum(one.seconds for one in found.values()) / 60
        row = Row(about, f"{len(layout)}, {layout_name}", minutes=trained, steps=found["body"].steps)

        def answer(recording: Recording) -> Any:
            said = solve(solver, recording.markers, RATE, ground.body)
            return said.rotations, said.joints

        return [scored(row, answer, exams(ground, layout))]

    return run


def _shipped(ground: Ground, minutes: float, key: str, progress: Progress) -> list[Row]:
    """As it ships, on a named layout and on a new one, and refined."""
    from markerscope.solver.neural.layout import named_layout
    from markerscope.solver.neural.layout_free.agnostic_solve import load

    ready = load()
    rows = []
    for name, layout in (
        ("full_body", named_layout(ground.body, "full_body")),
        ("new", new_layout(ground.body, ground.seed)),
    ):
        both, where = exams(ground, layout), f"{len(layout)}, {name}"
        rows.append(scored(Row("agnostic, as it ships", where), agnostic_answer(ready), both))
        refined = agnostic_answer(ready, ground.body)
        rows.append(scored(Row("agnostic, as it ships, then refined", where), refined, both))
    return rows


def _tuned(ground: Ground, minutes: float, key: str, progress: Progress) -> list[Row]:
    """A minute on the new layout."""
    from markerscope.solver.neural.layout_free.agnostic_solve import load

    return _on_new(ground, minutes, key, progress, load(), "agnostic, tuned to the layout", True)


def _scratch(ground: Ground, minutes: float, key: str, progress: Progress) -> list[Row]:
    """The same minute without what was learnt before."""
    from markerscope.solver.neural.layout_free.agnostic_solve import load

    ready = load()
    new = replace(ready, params=ready.network.initial(ground.seed))
    return _on_new(ground, minutes, key, progress, new, "agnostic, on the layout alone", False)


def _on_new(
    ground: Ground, minutes: float, key: str, progress: Progress, ready: Any, about: str, refined: bool
) -> list[Row]:
    from markerscope.solver.neural.layout_free.finetune import TUNING, finetune
    from markerscope.solver.neural.layout_free.finetune import Ground as Tuned

    layout = new_layout(ground.body, ground.seed)
    seconds = 60 * min(TUNING_MINUTES, minutes)
    rate = TUNING.rate if refined else 1.5e-3
    training = replace(TUNING, seconds=seconds, seed=ground.seed, rate=rate)
    found = finetune(
        ready,
        Tuned(ground.body, layout=layout),
        ground.learnt,
        training,
        checkpoint=ground.folder / f"{key}.checkpoint",
        progress=progress,
    )
    tuned, both = replace(ready, params=found.params), exams(ground, layout)
    row = Row(about, f"{len(layout)}, new", minutes=found.seconds / 60, steps=found.steps)
    rows = [scored(row, agnostic_answer(tuned), both)]
    if refined:
        row = replace(row, network=f"{about}, then refined")
        rows.append(scored(row, agnostic_answer(tuned, ground.body), both))
    return rows


def _fills(about: str, filled_first: bool) -> Any:
    """The occlusion network, on gaps of heavy-tailed lengths; OMPE of it and of the filling by distances alone."""

    def run(ground: Ground, minutes: float, key: str, progress: Progress) -> list[Row]:
        from markerscope.solver.neural.layout import named_layout
        from markerscope.solver.neural.per_layout.filling import FillTask, fill_bank, new_occlusion
        from markerscope.solver.neural.per_layout.occlusion import COMPACT_HIDDEN
        from markerscope.solver.neural.per_layout.solving import samplers
        from markerscope.solver.neural.training.train import train

        layout = named_layout(ground.body, "full_body")
        rest = layout.rest(ground.body)
        learnt, judged = samplers(ground.body, ground.learnt, ground.seen, seed=ground.seed)
        network = new_occlusion(learnt, layout, rest, hidden=COMPACT_HIDDEN, filled_first=filled_first)
        progress(0.0, "filling what is learnt from")
        bank = fill_bank(learnt, layout, rest, 48, ground.seed)
        task = FillTask(network, bank, fill_bank(judged, layout, rest, 12, ground.seed + 1))
        found = train(
            network.initial(ground.seed),
            task.loss,
            task.judge,
            _training(minutes / 2, ground.seed),
            checkpoint=ground.folder / f"{key}.checkpoint",
            what=key,
            progress=progress,
        )
        return [
            Row(
                about,
                f"{len(layout)}, full_body",
                ompe_cm=found.figures["ompe"],
                start_cm=task.start_cm,
                minutes=found.seconds / 60,
                steps=found.steps,
            )
        ]

    return run


_BATCH = 96


def _sizes(**changed: Any) -> Any:
    """Those for a training of a few minutes."""
    from markerscope.solver.neural.per_layout.heterogeneous import COMPACT

    return replace(COMPACT, **changed)


ENTRIES = (
    Entry("shipped", "the layout-agnostic network as it ships", _shipped),
    Entry("tuned", "the same after a minute on a new layout", _tuned),
    Entry("scratch", "a minute on that layout alone", _scratch),
    Entry("graph", "markers and joints as a graph", _graph("graph (Pan 2023)", "full_body")),
    Entry(
        "graph-no-convolution",
        "without marker convolutions",
        _graph("graph, no marker convolution", "full_body", sizes=_sizes(marker_convolution=False)),
    ),
    Entry("holden", "residual blocks", _graph("residual blocks (Holden 2018)", "full_body", kind="holden")),
    Entry("hands-apart", "networks of their own for the hands", _graph("graph, hands apart", "body_hands")),
    Entry(
        "hands-together",
        "one network for body and hands",
        _graph("graph, one for body and hands", "body_hands", split=False),
    ),
    Entry("fill", "gaps filled by distances, then corrected", _fills("occlusion network", True)),
    Entry("fill-no-edm", "gaps corrected from the mean place", _fills("occlusion network, no EDM start", False)),
)
"""Every row, in the order in which they are run."""
