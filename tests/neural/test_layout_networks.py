"""Networks of one layout from the command line: trained, taken up again, used by a solve and by a cleaning, refused."""

from __future__ import annotations

import json
import signal
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.commands import solve_session
from markerscope.solver.commands import train_site as site
from markerscope.solver.commands import trainings as training
from markerscope.solver.commands.train import train_network
from markerscope.solver.core.errors import Cancelled, InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.progress import silent
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.neural.layout import Layout, named_layout
from markerscope.solver.neural.layout_free.agnostic_solve import Marked
from markerscope.solver.neural.layout_free.agnostic_trust import made_poses
from markerscope.solver.neural.metrics import joe
from markerscope.solver.neural.per_layout import filling, named
from markerscope.solver.neural.per_layout.fill_by_weights import fill_by_weights
from markerscope.solver.neural.per_layout.fill_file import load_fill_network
from markerscope.solver.neural.per_layout.filling import FillNetwork
from markerscope.solver.neural.per_layout.named import NeuralMotion, Solver, load_solver
from markerscope.solver.neural.places import columns_of
from markerscope.solver.neural.posing import OneLayout, pose_network
from markerscope.solver.neural.request import TrainRequest
from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator
from markerscope.solver.neural.training.library import procedural_clips
from markerscope.solver.neural.weights import read_card
from markerscope.solver.pipeline.run import run_stages
from markerscope.solver.pipeline.session import load_session
from markerscope.solver.synth.files import MARKERS, PRIOR, write_session
from markerscope.solver.synth.session import SynthSettings, synthesise

pytest.importorskip("torch", reason="networks need torch")


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def layout(body: Body) -> Layout:
    return named_layout(body, "full_body")


def quick(patch: pytest.MonkeyPatch) -> None:
    """Few bodies, and few recordings with gaps."""
    patch.setattr(site, "_BODIES", (2, 2))
    patch.setattr(training, "_SPANS", 2)
    patch.setattr(training, "_JUDGED_SPANS", 1)


@pytest.fixture(autouse=True)
def few_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    quick(monkeypatch)


def words(network: str, out: Path, *more: object) -> list[str]:
    return ["train", *map(str, more), "--network", network, "--made", "2", "--out", str(out), "--json", "--quiet"]


@pytest.fixture(scope="module")
def graph(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A solver for ``full_body`` that has learnt a little."""
    path = tmp_path_factory.mktemp("weights") / "graph.safetensors"
    with pytest.MonkeyPatch.context() as patch:
        quick(patch)
        assert main([*words("graph", path, "--layout", "full_body"), "--steps", "40"]) == 0
    return path


@pytest.fixture(scope="module")
def occlusion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("weights") / "fill.safetensors"
    with pytest.MonkeyPatch.context() as patch:
        quick(patch)
        assert main([*words("occlusion", path, "--layout", "full_body"), "--steps", "2"]) == 0
    return path


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session of the markers of ``full_body``, solved by the default method."""
    folder = tmp_path_factory.mktemp("session")
    write_session(folder / "files", synthesise("reach", SynthSettings(frames=60, layout="full_body"), 3))
    files = folder / "files"
    asked = SolveRequest(files / MARKERS, out=folder / "out", prior=files / PRIOR, offset=0.0)
    solve_session(asked, silent)
    return folder / "out"


def recording(body: Body, layout: Layout, frames: int = 60) -> tuple[np.ndarray, np.ndarray]:
    """Markers (T, M, 3) m and rotations (T, 24, 3, 3) of the body itself, each marker in its place."""
    settings = ExampleSettings(spread=0.0, bones=0.0, placement_mm=0.0, height_mm=0.0).plain()
    drawn = Sampler(procedural_clips(4, 7), body_pool(body, 0, 0), settings).draw(layout, 1, generator(3), frames)
    return drawn.markers.numpy().astype(float), drawn.rotations.numpy()


def person(body: Body, layout: Layout, chosen: np.ndarray) -> Marked:
    return Marked(layout.rest(body)[chosen], body.weights[layout.vertex[chosen]], body.joint_template.copy())


def posed(path: Path, body: Body, layout: Layout, chosen: np.ndarray) -> OneLayout:
    """The solver told of some of the layout's markers, in some order."""
    found = pose_network(path, with_bone_lengths(body), person(body, layout, chosen), layout.vertex[chosen])
    assert isinstance(found, OneLayout)
    return found


def test_the_card_says_what_was_trained(graph: Path, occlusion: Path, layout: Layout) -> None:
    for path, kind, names in (
        (graph, "solver", {"joe_deg", "jpe_cm"}),
        (occlusion, "occlusion", {"ompe_cm", "start_cm"}),
    ):
        card = read_card(path)
        assert card.network == kind and card.layout == layout.digest and card.labels == layout.labels
        assert set(card.figures) == names and card.seed == 0 and card.seconds > 0 and card.date
        assert card.data == ("2 made motions of Markerscope (Apache-2.0)",)
    assert read_card(graph).steps == 40 and read_card(occlusion).steps == 2


def test_markers_in_any_order_and_among_others_are_solved_alike(graph: Path, body: Body, layout: Layout) -> None:
    markers, _ = recording(body, layout)
    markers[10:15, 3] = np.nan
    plain = posed(graph, body, layout, np.arange(47)).poses(markers, 60.0)
    order = np.random.default_rng(0).permutation(47)
    assert (order != np.arange(47)).any()
    shuffled = posed(graph, body, layout, order).poses(markers[:, order], 60.0)
    assert np.abs(shuffled.rotations - plain.rotations).max() < 1e-6
    assert np.abs(shuffled.trans - plain.trans).max() < 1e-6
    # A marker that the layout does not have is nobody's.
    more = np.append(order, 5)
    found = posed(graph, body, layout, more).poses(
        np.concatenate([markers[:, order], markers[:, [5]] + 0.02], axis=1), 60.0
    )
    assert (found.rotations == shuffled.rotations).all() or joe(found.rotations, plain.rotations) < 3.0


def test_markers_that_there_are_none_of_count_as_lost(graph: Path, body: Body, layout: Layout) -> None:
    markers, rotations = recording(body, layout)
    there = np.delete(np.arange(47), [4, 20, 33])
    network = posed(graph, body, layout, there)
    assert (np.flatnonzero(network.columns < 0) == [4, 20, 33]).all() and "44 of its 47 markers" in network.about
    found = network.poses(markers[:, there], 60.0)
    lost = markers.copy()
    lost[:, [4, 20, 33]] = np.nan
    same = posed(graph, body, layout, np.arange(47)).poses(lost, 60.0)
    assert np.array_equal(found.rotations, same.rotations) and found.seen.all()
    whole = posed(graph, body, layout, np.arange(47)).poses(markers, 60.0)
    turned, usual = joe(found.rotations, rotations), joe(whole.rotations, rotations)
    assert turned < usual + 4.0, f"{turned:.1f} degrees with three markers missing, {usual:.1f} with none"


def test_it_is_tried_on_the_markers_that_there_are(
    graph: Path, body: Body, layout: Layout, monkeypatch: pytest.MonkeyPatch
) -> None:
    there = np.delete(np.arange(47), [4, 20, 33])
    network, given = posed(graph, body, layout, there), []

    def still(solver: Solver, positions: np.ndarray, rate: float, body: Body) -> NeuralMotion:
        """A body that never bends a joint."""
        given.append(positions)
        rotations = np.tile(np.eye(3), (len(positions), 24, 1, 1))
        return NeuralMotion(rotations, np.zeros((len(positions), 24, 3)), np.zeros((24, 3)), positions[..., 0] > 0)

    monkeypatch.setattr(named, "solve", still)
    errors = np.degrees(np.sqrt(np.trace(network.expected_errors(), axis1=1, axis2=2)))
    lost = np.isnan(np.concatenate(given)).all(axis=2)
    assert lost[:, [4, 20, 33]].all() and 0.005 < np.delete(lost, [4, 20, 33], axis=1).mean() < 0.05
    # As far as made motions bend an elbow, times how unlike them a recording is.
    elbow = np.concatenate([clip.rotations[:, INDEX["left_elbow"]] for clip in made_poses(body).clips])
    bent = 5 * np.degrees(np.sqrt(np.square(log_so3(elbow.astype(float))).sum(axis=1).mean()))
    assert 0.6 < errors[INDEX["left_elbow"]] / bent < 1.6, (errors[INDEX["left_elbow"]], bent)


def test_a_layout_that_does_not_fit_is_refused(graph: Path, body: Body, layout: Layout) -> None:
    with pytest.raises(InputError, match="only 30 of its 47 markers sit where these 30 do"):
        posed(graph, body, layout, np.arange(30))
    with pytest.raises(InputError, match="another body model"):
        posed(graph, replace(body, digest="other"), layout, np.arange(47))
    assert (columns_of(body, layout.vertex, layout, None) == np.arange(47)).all()


def test_a_session_is_solved_by_it_and_what_cannot_be_is_refused(
    graph: Path, occlusion: Path, session: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    default = run_stages(load_session(session), ("fit",))["fit"]
    command = ["solve", str(session), "--method", "neural", "--weights"]
    assert main([*command, str(graph)]) == 0
    said = capsys.readouterr().out
    assert "graph.safetensors, 40 steps" in said and "of its 47 markers are there" in said, said
    solved = load_session(session)
    run = run_stages(solved, ("network", "fit"))
    assert not run.computed and run["network"].seen.all()
    # It has hardly learnt anything, so it is not believed.
    turned = joe(run["fit"].rotations, default.rotations)
    assert 0 < turned < 8 and run["network"].share.mean() < 0.5, (turned, run["network"].share)
    tuned = replace(solved, settings={**solved.settings, "network": {"tune_steps": 5}})
    with pytest.raises(InputError, match="cannot be tuned to a session before it solves; set tune_steps to 0"):
        run_stages(tuned, ("network",))
    assert main([*command, str(occlusion)]) == 2
    told = capsys.readouterr().err
    assert 'network of the kind "occlusion"' in told.strip().splitlines()[-1], told


def test_both_are_trained_for_a_sessions_own_markers_and_body(session: Path, tmp_path: Path) -> None:
    path = tmp_path / "own.safetensors"
    fit = run_stages(load_session(session), ("fit",))["fit"]
    used = np.flatnonzero(fit.marker_joint >= 0)
    assert main([*words("graph", path, session), "--steps", "2"]) == 0
    solver, card = load_solver(path)
    assert np.array_equal(solver.layout.vertex, fit.marker_vertex[used]) and len(card.labels) == len(used)
    # It stands on the fitted body, not on the mean one: its hips are as far apart as that body's.
    body = with_bone_lengths(Body.load())
    skin = body.surface(fit.betas, fit.marker_vertex[used])
    away = np.linalg.norm(solver.rest - skin, axis=1)
    assert np.median(away) < 0.02, f"{1000 * np.median(away):.0f} mm from the skin of the fitted body"
    assert main([*words("occlusion", path, session), "--steps", "2"]) == 0
    assert load_fill_network(path)[0].layout.digest == solver.layout.digest


def test_a_training_is_stopped_resumed_and_begun_from_weights(
    graph: Path, occlusion: Path, tmp_path: Path, layout: Layout
) -> None:
    for network in ("graph", "occlusion"):
        asked = TrainRequest(tmp_path / f"{network}.safetensors", layout="full_body", network=network, made=2, steps=12)

        def stopped(fraction: float, text: str) -> None:
            if text.startswith("step"):
                assert "loss" in text and "left" in text
                raise Cancelled

        with pytest.raises(Cancelled):
            train_network(asked, stopped)
        assert asked.checkpoint.is_file() and not asked.out.exists()
        with pytest.raises(InputError, match="add --resume"):
            train_network(asked)
        with pytest.raises(InputError, match="of another training"):
            train_network(replace(asked, resume=True, made=3))
        assert train_network(replace(asked, resume=True)).summary["steps"] == 12
        whole = replace(asked, out=tmp_path / "whole.safetensors")
        train_network(whole)
        one, other = (asked.out.read_bytes(), whole.out.read_bytes())
        assert one[-1000:] == other[-1000:], "a training that was resumed gives what one without a pause does"
        assert not asked.checkpoint.exists()
        start, wrong = (graph, occlusion) if network == "graph" else (occlusion, graph)
        with pytest.raises(InputError, match="holds the weights of a network of the kind"):
            train_network(replace(asked, start=wrong))
        with pytest.raises(InputError, match="was trained for another layout of 47 markers"):
            train_network(replace(asked, start=start, layout="body_53"))
        train_network(replace(asked, start=start, steps=1, seed=5))
        assert read_card(asked.out).seed == 5


def test_ctrl_c_keeps_the_best_and_a_hand_that_was_not_begun_stays_straight(tmp_path: Path) -> None:
    asked = TrainRequest(tmp_path / "hands.safetensors", layout="body_hands", network="graph", made=2, steps=50)

    def pressed(fraction: float, text: str) -> None:
        if text.startswith("step 10"):
            signal.raise_signal(signal.SIGINT)

    stopped = train_network(asked, pressed)
    assert stopped.summary["stopped"] and stopped.summary["steps"] == 10 and "--resume" in stopped.warnings[0]
    assert [part.group for part in load_solver(asked.out)[0].parts] == ["body"] and asked.checkpoint.is_file()
    done = train_network(replace(asked, resume=True))
    assert [part.group for part in load_solver(asked.out)[0].parts] == ["body", "left_hand", "right_hand"]
    assert done.summary["steps"] == 40 and "right_hand_joe_deg" in done.summary["figures"]
    assert not list(tmp_path.glob("*.checkpoint"))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--network", "agnostic", "--layout", "body_hands"], "solves no fingers"),
        (["--network", "agnostic", "--layout", "full_body", "--size", "published"], "has one size"),
        (["--network", "graph", "--layout", "full_body", "--start", "w", "--size", "published"], "say the size"),
        (["--network", "graph", "--layout", "full_body", "--start", "nowhere"], "there is no such file"),
        (["--network", "occlusion", "nowhere"], "there is no such session"),
        (["--network", "tail", "--layout", "full_body"], "--network"),
    ],
)
def test_what_cannot_be_trained_is_refused(
    more: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["train", *more, "--out", str(tmp_path / "w.safetensors")]) == 2
    told = capsys.readouterr().err
    assert said in told and len(told.strip().splitlines()) == 1, told
    assert not list(tmp_path.iterdir())


def test_without_torch_it_is_one_sentence(
    graph: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "torch", None)
    assert main(words("graph", tmp_path / "w.safetensors", "--layout", "full_body")) == 2
    assert "networks need torch, which is not installed" in capsys.readouterr().err
    with pytest.raises(InputError, match="networks need torch"):
        load_solver(graph)


class Truth:
    """Puts back what was hidden, but for an error (m); markers are found by where the layout says they are."""

    def __init__(self, truth: np.ndarray, error: float) -> None:
        self.truth, self.error = truth, error

    def __call__(self, found: FillNetwork, positions: np.ndarray, rate: float) -> np.ndarray:
        there = np.isfinite(positions).all(axis=2, keepdims=True)
        return np.where(there, positions, self.truth[: len(positions)] + self.error / np.sqrt(3))


@pytest.fixture
def trial(body: Body, layout: Layout, tmp_path: Path) -> tuple[Path, np.ndarray]:
    """Markers of the layout by name in another order, two of them missing and one of no layout; and all of them."""
    truth, _ = recording(body, layout, 150)
    order = np.random.default_rng(1).permutation(np.arange(2, 47))
    positions = np.concatenate([truth[:, order], truth[:, [9]] + 0.05], axis=1)
    positions[60:75, 4] = np.nan
    path = tmp_path / "trial.c3d"
    write_c3d(path, Markers(positions, 60.0, (*(layout.labels[i] for i in order), "wand")))
    return path, truth


@pytest.mark.parametrize("good", [True, False])
def test_a_recording_is_filled_by_the_network_only_where_it_is_better(
    good: bool,
    occlusion: Path,
    trial: tuple[Path, np.ndarray],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path, truth = trial
    monkeypatch.setattr(filling, "say", Truth(truth, 0.0002 if good else 0.1))
    out = tmp_path / "clean.c3d"
    command = ["clean", str(path), "--fill", "network", "--weights", str(occlusion), "--outliers", "none"]
    assert main([*command, "--out", str(out), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out.splitlines()[-1])
    (fill,) = summary["fills"]
    assert fill["method"] == ("network" if good else "regression"), fill
    (note,) = [line for line in summary["notes"] if "hidden on purpose" in line]
    assert note.endswith(f"the {'network' if good else 'default'} filled the gaps."), note
    assert f"the network is {0.2 if good else 100:.1f} mm off" in note, note
    before, after = load_markers(path), load_markers(out)
    assert after.labels == before.labels and after.filled is not None and after.filled.sum() == 15
    label = before.labels[4]
    if good:
        place = named_layout(Body.load(), "full_body").labels.index(label)
        off = np.linalg.norm(after.positions[60:75, 4] - truth[60:75, place], axis=1)
        assert off.max() < 0.0003, f"{label} is {1000 * off.max():.2f} mm off"
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    assert listed["weights"]["file"] == occlusion.name and listed["notes"] == summary["notes"]


def test_the_real_network_goes_through_the_command_line(
    occlusion: Path, trial: tuple[Path, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["clean", str(trial[0]), "--fill", "network", "--weights", str(occlusion)]
    assert main([*command, "--out", str(tmp_path / "c.trc")]) == 0
    assert "samples hidden on purpose the network is" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("--fill network", "no weights are named"),
        ("--weights {w}", "weights are for --fill network alone"),
        ("--fill network --weights {g}", 'of a network of the kind "solver", not "occlusion"'),
        ("--fill network --weights {w}", "0 of its 47 have a name in this recording, left_front_head has none"),
        ("--fill network --weights nowhere", "there is no such file"),
    ],
)
def test_what_cannot_be_filled_so_is_one_sentence(
    more: str, said: str, graph: Path, occlusion: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "t.c3d"
    write_c3d(path, Markers(np.random.default_rng(0).normal(size=(40, 5, 3)), 60.0, tuple("ABCDE")))
    options = more.format(w=occlusion, g=graph).split()
    assert main(["clean", str(path), *options, "--out", str(tmp_path / "out.c3d"), "--quiet"]) == 2
    told = capsys.readouterr().err
    assert said in told and len(told.strip().splitlines()) == 1, told
    assert sorted(p.name for p in tmp_path.iterdir()) == ["t.c3d"]


def test_four_in_five_of_the_names_are_enough(occlusion: Path, layout: Layout) -> None:
    def recorded(labels: tuple[str, ...]) -> Markers:
        return Markers(np.zeros((2, len(labels), 3)), 60.0, labels)

    assert fill_by_weights(occlusion, recorded(layout.labels[:38]))
    with pytest.raises(InputError, match="37 of its 47"):
        fill_by_weights(occlusion, recorded(layout.labels[:37]))
