"""One loop trains all: it can be killed and taken up, and its weights are only used for what they are for."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.neural.training.train import Params, TrainSettings, train
from markerscope.solver.neural.weights import Card, load_weights, read_card, save_weights

torch = pytest.importorskip("torch", reason="torch is not installed here")

SLOPE = torch.tensor([[1.0, -2.0], [0.5, 3.0], [2.0, 0.0]])


def start() -> Params:
    return {"w": torch.zeros(3, 2), "b": torch.zeros(2)}


def loss(params: Params, generator: torch.Generator) -> dict[str, torch.Tensor]:
    x = torch.randn(64, 3, generator=generator)
    return {"square": ((x @ params["w"] + params["b"] - x @ SLOPE - 1) ** 2).mean()}


def judge(params: Params) -> dict[str, float]:
    return {"score": float((params["w"] - SLOPE).abs().max())}


SETTINGS = TrainSettings(steps=300, seconds=None, rate=0.1, warm=5, average=0.9, check=50, patience=None)


def test_finds_what_made_the_data() -> None:
    found = train(start(), loss, judge, SETTINGS)
    assert found.figures["score"] < 1e-3, found.figures
    assert found.steps == 300 and [row["step"] for row in found.history] == [50, 100, 150, 200, 250, 300]
    assert torch.allclose(found.params["b"], torch.ones(2), atol=1e-2), found.params["b"]


def test_a_killed_training_ends_with_the_weights_of_one_that_was_left_alone(tmp_path: Path) -> None:
    whole = train(start(), loss, judge, SETTINGS)
    file = tmp_path / "a.checkpoint"

    def killed(fraction: float, text: str) -> None:
        if fraction >= 0.4:
            raise Cancelled()

    with pytest.raises(Cancelled):
        train(start(), loss, judge, SETTINGS, checkpoint=file, what="line", progress=killed)
    assert file.is_file()
    resumed = train(start(), loss, judge, SETTINGS, checkpoint=file, what="line")
    assert not file.exists()
    for name in whole.params:
        assert torch.equal(whole.params[name], resumed.params[name]), name
    assert [row["score"] for row in whole.history] == [row["score"] for row in resumed.history]


def test_a_checkpoint_of_something_else_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "a.checkpoint"

    def killed(fraction: float, text: str) -> None:
        raise Cancelled()

    with pytest.raises(Cancelled):
        train(start(), loss, judge, SETTINGS, checkpoint=file, what="line", progress=killed)
    with pytest.raises(InputError, match="another training"):
        train(start(), loss, judge, SETTINGS, checkpoint=file, what="circle")
    file.write_bytes(b"nothing")
    with pytest.raises(InputError, match="no checkpoint"):
        train(start(), loss, judge, SETTINGS, checkpoint=file, what="line")


def test_stops_when_it_gets_no_better_and_keeps_the_best() -> None:
    scores = iter([3.0, 2.0, 5.0, 6.0, 7.0, 1.0])
    settings = TrainSettings(steps=10_000, seconds=None, check=10, patience=3)
    found = train(start(), loss, lambda params: {"score": next(scores)}, settings)
    assert found.figures == {"score": 2.0} and found.steps == 50


def test_progress_tells_losses_and_time_left() -> None:
    told = []
    train(start(), loss, judge, SETTINGS, progress=lambda fraction, text: told.append((fraction, text)))
    assert all("square" in text and "left" in text for _, text in told[:-1]), told[0]
    assert "held out" in told[-2][1] and told[-1][0] == 1.0


def test_a_training_without_an_end_is_refused() -> None:
    with pytest.raises(InputError, match="neither"):
        TrainSettings(steps=None, seconds=None)


CARD = Card("heterogeneous", {"sizes": [4, 8]}, "abc", ("a", "b"), ("made: 3 clips",), {"joe": 1.5}, 7, 10, 2.0)


def test_weights_come_back_with_their_card(tmp_path: Path) -> None:
    file = tmp_path / "net.safetensors"
    params = {"w": torch.randn(3, 2), "v": torch.arange(4.0).reshape(2, 2).T}
    written = save_weights(file, params, CARD)
    found, card = load_weights(file, network="heterogeneous", layout="abc")
    assert card == written and card.figures == {"joe": 1.5} and card.date
    assert read_card(file) == card
    for name, value in params.items():
        assert torch.equal(found[name], value), name


@pytest.mark.parametrize(("wanted", "said"), [({"layout": "xyz"}, "another layout"), ({"network": "holden"}, "kind")])
def test_weights_for_something_else_are_refused_with_a_sentence(
    tmp_path: Path, wanted: dict[str, str], said: str
) -> None:
    file = tmp_path / "net.safetensors"
    save_weights(file, {"w": torch.zeros(1)}, CARD)
    with pytest.raises(InputError, match=said):
        load_weights(file, **wanted)


def test_damaged_weights_are_refused_with_a_sentence(tmp_path: Path) -> None:
    file = tmp_path / "net.safetensors"
    save_weights(file, {"w": torch.zeros(100)}, CARD)
    whole = file.read_bytes()
    rng = np.random.default_rng(0)
    for damaged in (b"", whole[:5], whole[:60], whole[:-40], b"\x80\x05" + whole, rng.bytes(500)):
        file.write_bytes(damaged)
        with pytest.raises(InputError):
            load_weights(file)
    header = json.dumps({"__metadata__": {"card": "[1]"}}).encode()
    file.write_bytes(len(header).to_bytes(8, "little") + header)
    with pytest.raises(InputError, match="no weights"):
        read_card(file)
    with pytest.raises(InputError, match="no such file"):
        read_card(tmp_path / "none.safetensors")
