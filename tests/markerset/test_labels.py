"""Names of a marker set given to trajectories whose truth is known: synthetic, broken, exchanged, with ghosts."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.body.bones import load_body
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.fit import anatomical
from markerscope.solver.fit.kinematics import Pose
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.markerset.columns import contradictions, in_order
from markerscope.solver.markerset.held import where
from markerscope.solver.markerset.label import Labelled, label
from markerscope.solver.markerset.learn import learn_from_pose
from markerscope.solver.markerset.marker_set import MarkerSet
from markerscope.solver.markerset.shipped import shipped

UPRIGHT = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
RATE, FRAMES = 25.0, 60


def walk(body: Body) -> Pose:
    """Two seconds of something like a walk, in no special direction."""
    phase = np.linspace(0, 4 * np.pi, FRAMES)
    rotations = np.repeat(anatomical.mean_pose()[None], FRAMES, axis=0)
    rotations[:, 0] = exp_so3(np.array([0, 0, 2.1])) @ UPRIGHT
    for joint, size, lag in (
        ("left_hip", 25, 0), ("right_hip", 25, np.pi), ("left_knee", -20, 1), ("right_knee", -20, np.pi + 1),
    ):  # fmt: skip
        turn = np.zeros((FRAMES, 3))
        turn[:, 0] = np.radians(size) * np.sin(phase + lag)
        rotations[:, INDEX[joint]] = rotations[:, INDEX[joint]] @ exp_so3(turn)
    trans = np.stack([0.02 * np.arange(FRAMES), -0.01 * np.arange(FRAMES), np.full(FRAMES, 0.95)], axis=1)
    return Pose(rotations, trans, np.zeros(body.shape_count))


@dataclass(frozen=True)
class Trial:
    """A set, trajectories of it, and (T, N) whose each sample truly is."""

    body: Body
    marker_set: MarkerSet
    markers: Markers
    truth: np.ndarray
    at: int


@pytest.fixture(scope="module")
def trial() -> Trial:
    """Shuffled, with a break, an exchange and a ghost at frame ``at``; noise 1 mm."""
    body = load_body()
    marker_set = replace(shipped("rajagopal"), origin="learnt")
    pose = walk(body)
    rng = np.random.default_rng(4)
    clean = where(body, marker_set.points(body), pose) + rng.normal(0, 1e-3, (FRAMES, len(marker_set.names), 3))
    columns = [clean[:, u].copy() for u in range(clean.shape[1])]
    owners = [np.full(FRAMES, u) for u in range(clean.shape[1])]
    at = 27
    u, v, w = (marker_set.names.index(name) for name in ("LLFC", "LMFC", "RTOE"))
    for rows in (columns, owners):
        rows[u][at:], rows[v][at:] = rows[v][at:].copy(), rows[u][at:].copy()
    later = np.full((FRAMES, 3), np.nan)
    later[at:] = columns[w][at:]
    columns[w][at:] = np.nan
    columns.append(later)
    owners.append(np.full(FRAMES, w))
    ghost = np.full((FRAMES, 3), np.nan)
    ghost[10:18] = clean[10:18, marker_set.names.index("C7")] + np.array([0.05, 0.06, 0.04])
    columns.append(ghost)
    owners.append(np.full(FRAMES, -1))
    order = rng.permutation(len(columns))
    positions = np.stack([columns[i] for i in order], axis=1)
    truth = np.stack([owners[i] for i in order], axis=1)
    truth = np.where(np.isfinite(positions).all(axis=2), truth, -1)
    labels = tuple(f"*{i}" for i in range(len(order)))
    return Trial(body, marker_set, Markers(positions, RATE, labels), truth, at)


@pytest.fixture(scope="module")
def named(trial: Trial) -> Labelled:
    return label(trial.body, trial.marker_set, trial.markers)


def test_every_sample_gets_its_name_and_a_ghost_none(trial: Trial, named: Labelled) -> None:
    assert named.same_person
    wrong = (named.name != trial.truth).sum()
    assert wrong == 0, f"{wrong} of {trial.truth.size} samples (synthetic)"
    assert np.nanmin(named.probability[trial.truth >= 0]) > 0.95
    assert np.isnan(named.probability[named.name < 0]).all()


def test_breaks_are_joined_and_exchanges_mended(trial: Trial, named: Labelled) -> None:
    ordered = in_order(trial.markers, named)
    points = where(trial.body, trial.marker_set.points(trial.body), walk(trial.body))
    for u, name in enumerate(trial.marker_set.names):
        track = ordered.markers.positions[:, ordered.markers.labels.index(name)]
        assert np.isfinite(track).all(), f"{name} is whole"
        assert np.linalg.norm(track - points[:, u], axis=1).max() < 0.01, name
    what = [one.what for one in ordered.stretches]
    assert (what.count("exchanged"), what.count("joined"), what.count("unlabelled")) == (2, 1, 1)
    cut = {one.first for one in ordered.stretches if one.what in ("exchanged", "joined")}
    assert cut <= {0, trial.at}
    before, after = trial.markers.positions, ordered.markers.positions
    assert np.isfinite(before).sum() == np.isfinite(after).sum(), "not a sample was lost"
    assert len(set(ordered.markers.labels)) == len(ordered.markers.labels)


def test_sound_trajectories_are_left_alone(trial: Trial) -> None:
    """No false repair: every trajectory comes back as it came, under its name."""
    points = where(trial.body, trial.marker_set.points(trial.body), walk(trial.body))
    names = trial.marker_set.names
    u = np.arange(len(names))
    sound = Labelled(
        names, np.tile(u, (FRAMES, 1)), np.ones((FRAMES, len(u))), walk(trial.body),
        trial.marker_set.points(trial.body), True,
    )  # fmt: skip
    ordered = in_order(Markers(points, RATE, tuple(f"x{i}" for i in u)), sound)
    assert ordered.markers.labels == names and not ordered.added and not ordered.emptied
    assert np.array_equal(ordered.markers.positions, points)
    assert {one.what for one in ordered.stretches} == {"named"}


def test_what_is_not_sure_moves_nothing(trial: Trial, named: Labelled) -> None:
    doubtful = replace(named, probability=np.where(named.name >= 0, 0.6, np.nan))
    ordered = in_order(trial.markers, doubtful)
    what = {one.what for one in ordered.stretches}
    assert "proposed" in what and not what & {"joined", "exchanged"}
    assert np.isfinite(ordered.markers.positions).sum() == np.isfinite(trial.markers.positions).sum()


def test_a_file_whose_names_are_exchanged_is_told(trial: Trial, named: Labelled) -> None:
    own = list(trial.markers.labels)
    column = {name: int((named.name == u).sum(axis=0).argmax()) for u, name in enumerate(trial.marker_set.names)}
    own[column["RASI"]], own[column["LASI"]] = "LASI", "RASI"
    own[column["C7"]] = "C7"
    own[column["RACR"]] = "CLAV"
    said = contradictions(replace(trial.markers, labels=tuple(own)), named)
    assert len(said) == 2
    assert "RASI and LASI exchanged" in said[0] or "LASI and RASI exchanged" in said[0]
    assert any("calls CLAV lies where the marker set has RACR" in one for one in said)


def test_places_are_learnt_from_a_fitted_trial(trial: Trial) -> None:
    pose = walk(trial.body)
    points = where(trial.body, trial.marker_set.points(trial.body), pose)
    learnt = learn_from_pose(trial.body, Markers(points, RATE, trial.marker_set.names), pose, "again")
    assert learnt.names == trial.marker_set.names
    off = np.linalg.norm(learnt.places - trial.marker_set.places, axis=1)
    assert np.median(off) < 0.005 and off.max() < 0.02, f"{1000 * off.max():.0f} mm"
    stray = Markers(np.concatenate([points, np.zeros((FRAMES, 1, 3)) + 3.0], axis=1), RATE, (*learnt.names, "wall"))
    again = learn_from_pose(trial.body, stray, pose, "again")
    assert "wall" not in again.names and "wall" in again.notes[0]


def test_nobody_is_refused(trial: Trial) -> None:
    lost = Markers(np.full((5, 4, 3), np.nan), RATE, ("a", "b", "c", "d"))
    with pytest.raises(InputError, match="at no time"):
        label(trial.body, trial.marker_set, lost)


def test_the_command_writes_the_file_and_what_it_did(
    trial: Trial, named: Labelled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, out = tmp_path / "in.trc", tmp_path / "out.c3d"
    write_trc(source, trial.markers)
    monkeypatch.setattr("markerscope.solver.commands.label.label", lambda *_: named)
    assert main(["label", str(source), "--marker-set", "rajagopal", "--out", str(out), "--up", "y", "--json"]) == 0
    said = capsys.readouterr().out
    about = json.loads(said.splitlines()[-1])
    assert "Joined: " in said and said.count("Exchanged back: ") == 2
    assert about["samples"]["unlabelled"] == 8 and about["not_found"] == []
    back = load_markers(out)
    assert set(trial.marker_set.names) <= set(back.labels)
    rows = (tmp_path / "out.labels.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("trajectory,first_frame") and len(rows) == 1 + len(about["stretches"])
    assert json.loads((tmp_path / "out.labels.json").read_text(encoding="utf-8"))["samples"] == about["samples"]
    assert main(["label", str(source), "--marker-set", "rajagopal", "--out", str(source)]) == 2
    assert "would be overwritten" in capsys.readouterr().err


def test_a_solve_begins_with_the_names(
    trial: Trial, named: Labelled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from markerscope.solver.commands.named import named_first

    source = tmp_path / "in.trc"
    write_trc(source, trial.markers)
    monkeypatch.setattr("markerscope.solver.commands.label.label", lambda *_: named)
    request, said = named_first(SolveRequest(source, out=tmp_path / "out", marker_set="rajagopal", up="y"))
    assert request.marker_set is None and request.markers == tmp_path / "out" / "named_markers.trc"
    assert set(trial.marker_set.names) <= set(load_markers(request.markers, up="y").labels)
    assert request.prior is not None and "no video" in said[-1]
    with np.load(request.prior) as poses:
        assert np.allclose(exp_so3(poses["poses"].reshape(-1, 24, 3)), named.pose.rotations, atol=1e-6)
    video = tmp_path / "v.mp4"
    request, _ = named_first(SolveRequest(source, out=tmp_path / "out2", marker_set="rajagopal", up="y", video=video))
    assert request.prior is None and request.video == video


SQUAT = Path(__file__).parents[3] / "shared" / "data" / "fullbody" / "labval_walk.trc"


@pytest.mark.skipif(not SQUAT.is_file(), reason="the real recordings are not part of this repository")
def test_a_real_walk_learnt_by_its_names_is_labelled_again() -> None:
    from markerscope.solver.markerset.by_names import pose_by_names

    body = load_body()
    markers = load_markers(SQUAT)
    found = pose_by_names(body, markers)
    assert found.known == "opencap"
    learnt = learn_from_pose(body, markers, found.pose, "walk")
    short = markers.select(slice(30, 70))
    again = label(body, learnt, replace(short, labels=tuple(f"m{i}" for i in range(len(short.labels)))))
    expected = np.array([learnt.names.index(name) for name in short.labels])
    right = (again.name == expected)[short.present].mean()
    assert right > 0.995, f"{100 * right:.1f} % (learnt on the same trial)"
