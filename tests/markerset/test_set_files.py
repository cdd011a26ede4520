"""Marker sets as files, the ones that ship, and the commands."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.skeleton import INDEX, mirror_index
from markerscope.solver.markerset.assign import Pieces, assign, margins
from markerscope.solver.markerset.file import read_marker_set, write_marker_set
from markerscope.solver.markerset.fragments import cut_up
from markerscope.solver.markerset.marker_set import MarkerSet, SetMarker
from markerscope.solver.markerset.search import connected_parts
from markerscope.solver.markerset.shipped import marker_set_of, shipped, shipped_names


def test_a_set_comes_back_as_it_was_written(tmp_path: Path) -> None:
    markers = (
        SetMarker('L"K\\é', INDEX["left_knee"], (0.1, -0.4, 0.01), 0.02, "plate 1", "where ever"),
        SetMarker("b", INDEX["pelvis"], (0.0, 0.09, -0.1), 0.0105),
        SetMarker("c", INDEX["head"], (0.07, 0.7, 0.1), 0.03),
    )
    one = MarkerSet("mine", markers, (0.5, -1.25), "learnt", "trial.c3d", ("look at it",))
    write_marker_set(tmp_path / "set.toml", one)
    assert read_marker_set(tmp_path / "set.toml") == one
    assert marker_set_of(tmp_path / "set.toml") == one


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("no toml", "cannot be read as TOML"),
        ("a = 1", "no list"),
        ('markers = [{name = "a"}]', "bone"),
        ('markers = [{name = "a", bone = "head", place_mm = [1, 2]}]', "three numbers"),
        ('markers = [{name = "a", bone = "head", place_mm = [1, 2, 90000]}]', "more than 2 m"),
        ('markers = [{name = "a", bone = "head", place_mm = [1, 2, 3], spread_mm = 0}]', "spread"),
        ('markers = [{name = "a", bone = "head", place_mm = [1, 2, 3]}]', "has 1 markers"),
        ("markers = [" + 3 * '{name = "a", bone = "head", place_mm = [1, 2, 3]},' + "]", "twice"),
    ],
)
def test_what_is_no_set_is_refused_in_one_sentence(text: str, said: str, tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    file.write_text(text)
    with pytest.raises(InputError, match=said):
        read_marker_set(file)


def test_shipped_sets_are_whole_and_alike_on_both_sides() -> None:
    assert {"plug-in-gait", "ior-cast", "rajagopal", "opencap", "helen-hayes", "cmu-41"} == set(shipped_names())
    mirror = mirror_index()
    for name in shipped_names():
        one = shipped(name)
        assert one.origin == "shipped" and one.source and all(marker.landmark for marker in one.markers)
        by_words = {marker.landmark: marker for marker in one.markers}
        for marker in one.markers:
            if marker.landmark.startswith("left "):
                other = by_words["right " + marker.landmark.removeprefix("left ")]
                assert other.bone == mirror[marker.bone]
                assert np.allclose(np.array(other.place) * (-1, 1, 1), marker.place, atol=0.003), marker.name
    assert len(shipped("cmu-41").markers) == 41
    assert shipped("cmu-41") == marker_set_of("CMU") and shipped("plug-in-gait") == marker_set_of("cgm2")


def test_an_unknown_set_is_refused_with_those_there_are() -> None:
    with pytest.raises(InputError, match=r"no such marker set.*plug-in-gait"):
        marker_set_of("nothing")


def test_trajectories_are_cut_at_gaps_and_jumps_only() -> None:
    time = np.arange(100) / 100
    smooth = np.stack([np.sin(3 * time), np.cos(2 * time), 1 + 0 * time], axis=1)
    positions = np.stack([smooth, smooth + 0.5, smooth + 1.0], axis=1)
    positions[40:45, 1] = np.nan
    positions[60:, 2] += 0.08
    fragments = cut_up(positions, 100.0)
    assert fragments.column.tolist() == [0, 1, 1, 2, 2]
    assert fragments.first.tolist() == [0, 0, 45, 0, 60]
    assert fragments.last.tolist() == [99, 39, 99, 59, 99]


def test_names_are_one_to_one_in_time() -> None:
    """Two pieces in a row may share a name, two at once may not; the ghost is nobody's."""
    cost = np.array([[0.1, 0.9], [0.15, 0.9], [0.3, 0.2], [0.5, 0.9]])
    first, last = np.array([0, 50, 0, 10]), np.array([49, 99, 99, 30])
    pieces = Pieces(np.arange(4), first, last, np.arange(4), last - first + 1, cost)
    assert assign(pieces).tolist() == [0, 0, 1, -1]


def test_a_margin_is_what_the_next_answer_costs_more() -> None:
    rng = np.random.default_rng(0)
    evidence = rng.uniform(0, 5, (4, 4))
    nobody = np.full(4, 4.0)
    pieces = Pieces(np.arange(4), np.zeros(4, int), np.full(4, 9), np.arange(4), np.full(4, 10), evidence / 10)
    from itertools import product

    choices = [c for c in product(range(-1, 4), repeat=4) if len({n for n in c if n >= 0}) == sum(n >= 0 for n in c)]
    total = {c: sum(evidence[i, n] if n >= 0 else nobody[i] for i, n in enumerate(c)) for c in choices}
    best = min(total, key=lambda c: total[c])
    found = margins(pieces, np.array(best), evidence, nobody)
    for i in range(4):
        if best[i] >= 0:
            other = min(cost for c, cost in total.items() if c[i] != best[i])
            assert found[i] >= other - total[best] - 1e-9
            assert found[i] == pytest.approx(other - total[best], abs=1.5)


def test_connected_parts_of_a_set() -> None:
    bones = np.array([INDEX[name] for name in ("pelvis", "left_hip", "left_knee", "left_knee", "right_hip", "head")])
    parts = {tuple(part.tolist()) for part in connected_parts(bones, 3, 4)}
    assert (1, 2, 3) in parts and (0, 1, 4) in parts and (0, 1, 5) in parts
    assert (1, 4, 5) not in parts, "thighs are joined by the pelvis alone"


def test_sets_are_listed_and_shown(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["markerset", "list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert {one["name"] for one in listed["marker_sets"]} == set(shipped_names())
    assert main(["markerset", "show", "plug-in-gait"]) == 0
    shown = tmp_path / "shown.toml"
    shown.write_text(capsys.readouterr().out, encoding="utf-8")
    assert read_marker_set(shown) == shipped("plug-in-gait")


def test_refusals_of_the_commands(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert main(["label", str(tmp_path / "no.c3d"), "--marker-set", "cmu-41", "--out", str(tmp_path / "x.c3d")]) == 2
    assert "there is no such file" in capsys.readouterr().err
    assert main(["label", "a.c3d", "--marker-set", "cmu-41", "--out", "x.docx"]) == 2
    assert "not a format" in capsys.readouterr().err
    assert main(["markerset", "learn", "a.c3d", "--out", "x.csv"]) == 2
    assert "ends in .toml" in capsys.readouterr().err
