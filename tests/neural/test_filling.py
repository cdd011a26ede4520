"""The occlusion network corrects what was filled, leaves what was seen, and is used only where it is better."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.cleaning.fill import fill
from markerscope.solver.cleaning.gap_model import draw_gaps, heavy_tailed
from markerscope.solver.cleaning.gaps import FillSettings
from markerscope.solver.core.errors import InputError
from markerscope.solver.neural.layers import Params
from markerscope.solver.neural.layout import Layout, named_layout
from markerscope.solver.neural.per_layout import filling
from markerscope.solver.neural.per_layout.fill_by_weights import fill_by_network
from markerscope.solver.neural.per_layout.fill_file import load_fill_network, save_fill_network
from markerscope.solver.neural.per_layout.filling import (
    FillNetwork,
    FillTask,
    completed,
    fill_bank,
    fill_network,
    new_occlusion,
    say,
    worth,
)
from markerscope.solver.neural.per_layout.occlusion import OVERLAP, WINDOW, Occlusion, corrected, windows
from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator
from markerscope.solver.neural.training.library import procedural_clips
from markerscope.solver.neural.training.train import TrainSettings, train
from markerscope.solver.neural.weights import Card

torch = pytest.importorskip("torch", reason="torch is not installed here")


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def layout(body: Body) -> Layout:
    return named_layout(body, "full_body").select(np.arange(0, 47, 2))


@pytest.fixture(scope="module")
def sampler(body: Body) -> Sampler:
    return Sampler(procedural_clips(4, 0, seconds=3.0), body_pool(body, 1, 0), ExampleSettings())


@pytest.fixture(scope="module")
def network(sampler: Sampler, layout: Layout, body: Body) -> Occlusion:
    return new_occlusion(sampler, layout, layout.rest(body), hidden=24)


def stirred(network: Occlusion) -> Params:
    """Numbers with which it corrects something."""
    params = network.initial(0)
    return {**params, "out.w": 0.1 * torch.randn(params["out.w"].shape, generator=generator(0))}


@pytest.mark.parametrize("frames", [10, WINDOW, WINDOW + 1, 150, 640])
def test_windows_cover_a_recording_and_share_half(frames: int) -> None:
    starts = windows(frames)
    assert starts[0] == 0 and (np.diff(starts) <= WINDOW - OVERLAP).all()
    covered = {t for start in starts for t in range(start, start + WINDOW)}
    assert covered >= set(range(frames)) and (frames <= WINDOW or max(covered) == frames - 1)


def test_windows_that_overlap_are_averaged_and_what_is_seen_stays(network: Occlusion) -> None:
    class Shifting:
        """Says the number of the window that it is asked about."""

        asked = 0.0

        def __call__(self, params: object, markers: torch.Tensor, visible: torch.Tensor) -> torch.Tensor:
            out = markers.clone()
            for window in out:
                self.asked += 1
                window[:] = self.asked
            return out

    local = np.zeros((96, 2, 3))
    visible = np.zeros((96, 2), dtype=bool)
    visible[:, 1] = True
    found = corrected(Shifting(), {}, local, visible)  # type: ignore[arg-type]
    assert np.allclose(found[:32, 0], 1) and np.allclose(found[32:64, 0], 1.5) and np.allclose(found[64:, 0], 2)
    assert (found[:, 1] == 0).all()


def test_the_network_looks_both_ways_and_every_number_is_learnt(network: Occlusion) -> None:
    again = Occlusion.from_config(json.loads(json.dumps(network.config())))
    assert again.links == network.links and all(len(row) == 7 for row in again.links)
    params = {name: value.requires_grad_(True) for name, value in stirred(network).items()}
    markers = torch.randn(2, 20, 24, 3) * 0.2
    visible = torch.ones(2, 20, 24)
    visible[:, 5, 3] = visible[:, 12, 3] = 0
    said = network(params, markers, visible)
    assert torch.equal(said[visible > 0], markers[visible > 0])
    for other in (2, 18):  # what happened before and what happens after tells where a marker is
        moved = markers.clone()
        moved[:, other] += 0.1
        assert (network(params, moved, visible) - said)[:, 5, 3].abs().max() > 0
    said[visible == 0].square().sum().backward()
    assert all(value.grad is not None and value.grad.abs().max() > 0 for value in params.values())
    blind = replace(network, filled_first=False)
    moved = markers.clone()
    moved[:, 5, 3] += 1.0
    assert torch.equal(blind(params, moved, visible), blind(params, markers, visible)), (
        "filled places are not looked at"
    )


def test_it_is_the_recurrent_layer_that_torch_has(network: Occlusion) -> None:
    params = network.initial(0)
    layer = torch.nn.LSTM(24 * 16, 24, bidirectional=True, batch_first=True)
    state = {}
    for way, suffix in (("forth", ""), ("back", "_reverse")):
        for ours, theirs in (("ih", "weight_ih"), ("hh", "weight_hh"), ("bih", "bias_ih"), ("bhh", "bias_hh")):
            state[f"{theirs}_l0{suffix}"] = params[f"lstm.{way}.{ours}"]
    layer.load_state_dict(state)
    seen: list[torch.Tensor] = []
    real = torch.lstm

    def spy(x: torch.Tensor, *rest: object) -> object:
        found = real(x, *rest)
        seen.extend((x, found[0]))
        return found

    torch.lstm = spy
    try:
        network(params, torch.randn(1, 9, 24, 3), torch.ones(1, 9, 24))
    finally:
        torch.lstm = real
    assert torch.allclose(layer(seen[0])[0], seen[1], atol=1e-6)


def test_it_learns_to_correct_what_distances_get_wrong(
    network: Occlusion, sampler: Sampler, layout: Layout, body: Body
) -> None:
    bank = fill_bank(sampler, layout, layout.rest(body), 2, 0, frames=64, shares=(0.15,))
    assert torch.equal(bank.local[bank.visible > 0], bank.truth[bank.visible > 0]) or (
        (bank.local - bank.truth)[bank.visible > 0].abs().max() < 1e-5
    )
    task = FillTask(network, bank, bank, batch=2)
    settings = TrainSettings(steps=60, seconds=None, rate=6e-3, warm=5, average=0.8, check=60, patience=None)
    found = train(network.initial(0), task.loss, task.judge, settings)
    assert found.figures["start"] == task.start_cm > 0.1
    assert found.figures["ompe"] < 0.8 * task.start_cm, found.figures


def test_nothing_is_left_open_even_where_no_method_can_tell(layout: Layout, sampler: Sampler, body: Body) -> None:
    markers = sampler.draw(layout, 1, generator(0), 40).markers.numpy().astype(float)
    given = markers.copy()
    given[:, 4] = np.nan  # never seen
    given[10:20, 8:] = np.nan
    whole = completed(given, 60.0, "edm", layout, layout.rest(body))
    there = np.isfinite(given).all(axis=2)
    assert np.isfinite(whole).all() and np.array_equal(whole[there], given[there])
    off = np.linalg.norm(whole[:, 4] - markers[:, 4], axis=1).mean()
    assert off < 0.12, f"a marker that was never seen is put {off:.2f} m away"
    # A marker of a limb rides with the others of that limb.
    elbow, given = layout.labels.index("left_elbow_medial"), markers.copy()
    given[:, elbow] = np.nan
    away = completed(given, 60.0, "edm", layout, layout.rest(body))[:, elbow] - markers[:, elbow]
    off = np.linalg.norm(away, axis=1).mean()
    assert off < 0.08, f"the elbow's marker is put {off:.2f} m away"


class _Oracle:
    """Puts back what was hidden, with an error."""

    def __init__(self, truth: np.ndarray, error: float) -> None:
        self.truth, self.error = truth, error

    def __call__(self, found: FillNetwork, positions: np.ndarray, rate: float) -> np.ndarray:
        there = np.isfinite(positions).all(axis=2, keepdims=True)
        return np.where(there, positions, self.truth + self.error / np.sqrt(3))


@pytest.mark.parametrize("good", [True, False])
def test_it_is_used_only_where_it_beats_the_default_on_gaps_of_the_recording_itself(
    good: bool, network: Occlusion, layout: Layout, sampler: Sampler, body: Body, monkeypatch: pytest.MonkeyPatch
) -> None:
    truth = sampler.draw(layout, 1, generator(0), 150).markers.numpy().astype(float)
    oracle = _Oracle(truth, 0.0005 if good else 0.5)
    monkeypatch.setattr(filling, "say", oracle)
    used = FillNetwork(network, network.initial(0), layout, layout.rest(body))
    used = replace(used, layout=replace(layout, columns=np.arange(len(layout))))
    hidden = draw_gaps(np.ones(truth.shape[:2], dtype=bool), heavy_tailed(), 0.05, 3)
    given = np.where(hidden[..., None], np.nan, truth)
    judged = worth(given, 60.0, used)
    assert judged.accepted is good and judged.hidden > 50
    assert np.isclose(judged.network_cm, 0.05 if good else 50.0, rtol=0.01)
    settings = FillSettings(min_confidence=0.0, max_gap=None)
    usual, found = fill(given, 60.0, settings), fill_network(given, 60.0, settings, used)
    assert np.array_equal(found.filled, usual.filled)
    if good:
        assert {span.method for span in found.fills} == {"network"}
        assert np.allclose(found.positions[found.filled], (truth + 0.0005 / np.sqrt(3))[found.filled])
        assert all(a.error < b.error for a, b in zip(found.fills, usual.fills))
    else:
        assert np.array_equal(found.positions, usual.positions, equal_nan=True) and found.fills == usual.fills


def test_what_it_says_is_in_the_lab_and_at_any_rate(
    network: Occlusion, layout: Layout, sampler: Sampler, body: Body
) -> None:
    truth = sampler.draw(layout, 1, generator(0), 60).markers.numpy().astype(float)
    given = truth.copy()
    given[20:30, 7] = np.nan
    used = FillNetwork(network, network.initial(0), layout, layout.rest(body))  # corrects nothing yet
    start = completed(given, 60.0, "edm", layout, layout.rest(body))
    for rate in (60.0, 120.0):
        found = say(used, given, rate)
        assert np.abs(found - start).max() < 1e-5


def test_a_recording_without_the_layouts_markers_is_left_to_the_default(
    network: Occlusion, layout: Layout, body: Body
) -> None:
    used = FillNetwork(network, network.initial(0), layout, layout.rest(body))
    assert not worth(np.zeros((50, 5, 3)), 60.0, used).accepted


def test_it_is_kept_in_a_file_and_is_a_way_of_filling_like_any_other(
    network: Occlusion, layout: Layout, sampler: Sampler, body: Body, tmp_path: Path
) -> None:
    used = FillNetwork(network, stirred(network), layout, layout.rest(body), "rigid")
    used = replace(used, layout=replace(layout, columns=np.arange(len(layout))))
    file = tmp_path / "fill.safetensors"
    save_fill_network(file, used, Card("", {}, "", (), ("made",), {"ompe": 1.0}, 0, 1, 1.0))
    again, card = load_fill_network(file, used.layout)
    assert card.network == "occlusion" and again.start == "rigid"
    given = sampler.draw(layout, 1, generator(0), 80).markers.numpy().astype(float)
    given[30:40, 2] = np.nan
    assert np.allclose(say(again, given, 60.0), say(used, given, 60.0), atol=1e-6)
    one, other = (fill_by_network(n)(given, 60.0, FillSettings()) for n in (used, again))
    assert np.allclose(one.positions, other.positions, atol=1e-6) and one.filled.sum() == 10
    with pytest.raises(InputError, match="another layout"):
        load_fill_network(file, layout.select(np.arange(5)))


def test_markers_speak_for_themselves_beside_the_recurrent_layer(
    network: Occlusion, sampler: Sampler, layout: Layout, body: Body
) -> None:
    """With the recurrent layer silent, a marker's correction is told by what it hears from its neighbours alone."""
    beside = replace(network, beside=True, correction_m=0.01)
    again = Occlusion.from_config(json.loads(json.dumps(beside.config())))
    assert again.beside and again.correction_m == 0.01 and "beside.w" not in network.initial(0)
    params = beside.initial(0)
    markers, visible = 0.2 * torch.randn(2, 20, 24, 3), torch.ones(2, 20, 24)
    visible[:, 5, 3] = 0
    assert torch.equal(beside(params, markers, visible), markers), "it corrects nothing at first"
    params["beside.w"] = torch.randn(params["beside.w"].shape, generator=generator(0))
    said = beside(params, markers, visible)
    assert (said - markers)[:, 5, 3].abs().max() > 0
    reached, frontier = {3}, {3}
    for _ in network.features:  # as far as its neighbours' neighbours' neighbours
        frontier = {k for m in frontier for k in network.links[m]}
        reached |= frontier
    for marker in range(24):
        moved = markers.clone()
        moved[:, 5, marker] += 0.1
        changed = not torch.equal((beside(params, moved, visible) - moved)[:, 5, 3], (said - markers)[:, 5, 3])
        assert changed <= (marker in reached), marker
    old = {name: value for name, value in network.config().items() if name not in ("beside", "correction_m")}
    assert Occlusion.from_config(old).correction_m == 0.03 and not Occlusion.from_config(old).beside
