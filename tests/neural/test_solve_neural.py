"""A session solved by the network that ships, and networks trained for it: from files to files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.body.model import Body
from markerscope.solver.commands import solve_session
from markerscope.solver.commands.train import train_network
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.neural.layout_free.agnostic_solve import SHIPPED, load
from markerscope.solver.neural.metrics import joe, jpe
from markerscope.solver.neural.places import check_places, places_of
from markerscope.solver.neural.request import TrainRequest
from markerscope.solver.neural.weights import read_card, save_weights
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import load_session
from markerscope.solver.synth.files import MARKERS, PRIOR, write_session
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise

pytest.importorskip("torch", reason="networks need torch")

SETTINGS = SynthSettings(frames=75, markers=40, lost=0.04)


@pytest.fixture(scope="module")
def made() -> SynthSession:
    return synthesise("reach", SETTINGS, 4)


@pytest.fixture(scope="module")
def files(made: SynthSession, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("session") / "files"
    write_session(folder, made)
    return folder


@pytest.fixture(scope="module")
def out(files: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Solved by the network that ships."""
    folder = tmp_path_factory.mktemp("solved") / "out"
    solve_session(request(files, folder), silent)
    return folder


def request(files: Path, out: Path, weights: Path | None = None) -> SolveRequest:
    prior = files / PRIOR
    return SolveRequest(files / MARKERS, out=out, prior=prior, offset=0.0, method="neural", weights=weights)


def errors(made: SynthSession, rotations: np.ndarray, joints: np.ndarray) -> tuple[float, float]:
    """JOE in degrees and JPE in cm of the truth."""
    motion = made.truth.motion
    true = made.truth.body.pose(motion.rotations, made.truth.betas, motion.trans, want_vertices=False)[1]
    return joe(rotations, motion.rotations), jpe(joints, np.asarray(true))


def test_a_session_is_solved_by_the_network_that_ships(made: SynthSession, out: Path) -> None:
    with np.load(out / "motion.npz") as found:
        rotations = exp_so3(found["poses"].reshape(len(found["poses"]), 24, 3))
        turned, misplaced = errors(made, rotations, found["joints"])
    assert turned < 7.0 and misplaced < 5.0, f"{turned:.2f} degrees, {misplaced:.2f} cm"


def test_the_networks_poses_are_near_and_what_it_says_is_kept(made: SynthSession, out: Path) -> None:
    session = load_session(out)
    poses = run_stages(session, ("network",))["network"]
    turned = joe(poses.rotations, made.truth.motion.rotations)
    assert turned < 7.0, f"{turned:.2f} degrees"
    assert poses.gap < 0.012 and poses.seen.all() and poses.chosen == 0, poses.gap
    assert 0.2 < poses.share[3] <= 1 and (poses.spread_deg > 0).all(), poses.share
    assert "shipped" in poses.weights and session.run.method == "neural"


def test_what_was_solved_is_not_solved_again(out: Path) -> None:
    assert solve_session(SolveRequest(out), silent).summary["computed"] == []


def test_the_card_of_what_ships_says_what_it_was_made_of() -> None:
    card = read_card(SHIPPED)
    assert card.network == "agnostic" and card.layout == "" and SHIPPED.stat().st_size < 20e6
    assert any("Apache-2.0" in line for line in card.data) and not any("andai" in line for line in card.data)
    assert card.figures["joe_deg"] < 5 and card.figures["jpe_cm"] < 1


def test_a_network_is_trained_for_the_session_stopped_and_resumed(out: Path, tmp_path: Path) -> None:
    asked = TrainRequest(tmp_path / "own.safetensors", session=out, made=3, steps=12)

    def stopped(fraction: float, text: str) -> None:
        if text.startswith("step"):
            raise Cancelled

    with pytest.raises(Cancelled):
        train_network(asked, stopped)
    with pytest.raises(InputError, match="add --resume"):
        train_network(asked)
    assert asked.checkpoint.is_file() and not asked.out.exists()
    trained = train_network(replace(asked, resume=True))
    card = read_card(asked.out)
    assert not asked.checkpoint.exists() and card.steps == 12, card.steps
    assert trained.summary["layout"] == card.layout and len(card.labels) == len(card.config["places"]["vertex"])
    # Its own markers are where it was trained for.
    vertex = run_stages(load_session(out), ("orient",))["orient"].candidates[0].vertex
    check_places(card, Body.load(), vertex, asked.out)
    with pytest.raises(InputError, match="there is no training to go on with"):
        train_network(replace(asked, resume=True))


def test_weights_for_another_layout_are_refused_in_one_sentence(files: Path, out: Path, tmp_path: Path) -> None:
    ready, body = load(), Body.load()
    feet = np.flatnonzero(body.marker_mask & (body.template[:, 1] < body.template[:, 1].min() + 0.15))[::20]
    other = replace(ready.card, config=dict(ready.card.config) | {"places": places_of(body, feet)}, date="")
    path = tmp_path / "feet.safetensors"
    save_weights(path, ready.params, other)

    def results() -> list[Path]:  # but for what is noted of files, to know them again
        return sorted(path for path in out.rglob("*.json") if path.name != "digests.json")

    before = results()
    with pytest.raises(InputError, match=r"was trained for another layout: only \d+ of these \d+ markers sit"):
        solve_session(request(files, out, path), silent)
    assert results() == before
    card = replace(other, config=dict(other.config) | {"places": {"body": "another", "vertex": [1]}})
    with pytest.raises(InputError, match="another body model"):
        check_places(card, body, feet, path)


def test_weights_that_are_none_are_refused(files: Path, tmp_path: Path) -> None:
    path = tmp_path / "w.safetensors"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(InputError, match="holds no weights of Markerscope"):
        load(path)
    ready = load()
    save_weights(path, ready.params, replace(ready.card, network="solver"))
    with pytest.raises(InputError, match='of a network of the kind "solver", not "agnostic"'):
        load(path)
    sizes = dict(ready.card.config["sizes"]) | {"width": 7}
    save_weights(path, ready.params, replace(ready.card, config={"sizes": sizes}))
    with pytest.raises(InputError, match="another version of the network"):
        load(path)


def test_the_command_line_trains_for_a_layout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    weights = tmp_path / "named.safetensors"
    words = ["train", "--layout", "full_body", "--made", "2", "--steps", "3", "--out", str(weights), "--json"]
    assert main(words) == 0
    said = capsys.readouterr().out.splitlines()
    summary = json.loads(said[-1])
    assert summary["markers"] == 47 and summary["figures"]["joe_deg"] < 8, summary
    assert read_card(weights).config["places"]["body"] == Body.load().digest


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ([], "either a session or a layout is trained for"),
        (["--layout", "tail"], 'there is no layout "tail"'),
        (["--layout", "full_body", "--minutes", "0"], "--minutes: 0 is not possible"),
        (["--layout", "full_body", "--made", "0"], "there is no motion to learn from"),
        (["nowhere"], "there is no such session"),
        (["--layout", "full_body", "--motions", "nowhere"], "there is no such folder"),
    ],
)
def test_what_cannot_be_trained_is_refused(
    words: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", *words, "--out", str(tmp_path / "w.safetensors")]) == 2
    told = capsys.readouterr().err
    assert said in told and len(told.strip().splitlines()) == 1, told
    assert not list(tmp_path.iterdir())
