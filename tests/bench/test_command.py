"""The real command on the short suite: its table against its records, resumed, and carried into a README."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.insert import PAGES, put
from markerscope.app.cli.main import main
from markerscope.solver.bench import motions
from markerscope.solver.bench.cases import SUITES, cases_of
from markerscope.solver.bench.motions import find_motions, read_source
from markerscope.solver.bench.registry import VARIANTS, with_ablations
from markerscope.solver.bench.request import BenchRequest
from markerscope.solver.bench.table import BINS
from markerscope.solver.core.errors import InputError
from markerscope.solver.io.motion import SkeletonMotion

WORDS = ["bench", "short", "--frames", "60", "--motion-count", "2", "--cases", "left-leg", "--workers", "2"]


def ran(out: Path, capsys, *words: str) -> dict[str, Any]:
    assert main([*WORDS, *words, "--out", str(out), "--json", "--quiet"]) == 0
    return json.loads(capsys.readouterr().out)


@pytest.fixture(scope="module")
def out(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("bench") / "out"
    assert main([*WORDS, "--out", str(folder), "--quiet"]) == 0
    return folder


def test_the_table_is_what_the_records_say(out: Path) -> None:
    told = json.loads((out / "bench.json").read_text())
    records = [json.loads((out / "runs" / f"{key}.json").read_text()) for key in told["runs"]]
    assert len(records) == 2
    (row,) = told["rows"]
    assert (row["case"], row["method"], row["runs"]) == ("left-leg", "bundle", 2)
    for name in ("mpjpe_mm", "part_mpjpe_mm", "mpjve_mm_s", "v2v_mm", "m2s_mm", "warm_s", "memory_gb"):
        values = [record[name] for record in records]
        assert row["figures"][name] == {"median": np.median(values), "worst": max(values), "count": 2}, name
    assert row["figures"]["cold_s"]["median"] > 0
    assert row["shares"]["right_part"] == [sum(record["right_part"] for record in records), 2]
    assert sum(entry["count"] for entry in told["calibration"]) == 2
    text = (out / "bench.md").read_text()
    values = [record["mpjpe_mm"] for record in records]
    median, worst = (f"{value:#.3g}".rstrip(".") for value in (np.median(values), max(values)))
    assert f"| {median} ({worst}) |" in text
    for word in ("markerscope bench short", "--cases left-leg", told["date"], "cores", "Synthetic", "walk", "tour"):
        assert word in text
    for record in records:
        assert record["part_mpjpe_mm"] < 100, "no answer at all"
        assert record["confidence"] is not None
        assert set(record["seconds"]) >= {"sync", "segment", "localize", "orient", "fit"}


def test_a_second_call_computes_only_what_is_missing(out: Path, capsys) -> None:
    before = (out / "bench.json").read_text()
    again = ran(out, capsys)
    assert again["computed"] == 0
    assert (out / "bench.json").read_text() == before
    (out / "runs" / f"{again['runs'][1]}.json").unlink()
    once_more = ran(out, capsys)
    assert once_more["computed"] == 1
    assert once_more["rows"][0]["figures"]["mpjpe_mm"] == pytest.approx(again["rows"][0]["figures"]["mpjpe_mm"])


def test_runs_out_of_time_are_counted(tmp_path: Path, capsys) -> None:
    summary = ran(tmp_path / "out", capsys, "--limit", "0.05", "--motion-count", "1")
    assert summary["counts"] == {"done": 0, "failed": 0, "timed out": 1}
    text = (tmp_path / "out" / "bench.md").read_text()
    assert "1 (1 timed out)" in text
    assert "1 x bundle, timed out: It took more than 0.05 s." in text


def test_the_page_gets_the_table_between_its_marks(out: Path, tmp_path: Path) -> None:
    readme = tmp_path / "README.md"
    readme.write_text("# Title\n<!-- bench:short begin -->\nearlier\n<!-- bench:short end -->\nrest\n")
    other = tmp_path / "other.md"
    other.write_text("# Other\n")
    assert put(out, [other, readme]) == ("short", readme)
    text = readme.read_text()
    assert "earlier" not in text
    assert (out / "bench.md").read_text().strip() in text
    assert text.startswith("# Title\n<!-- bench:short begin -->\n")
    assert text.endswith("\n<!-- bench:short end -->\nrest\n")
    readme.write_text("# Title\n")
    with pytest.raises(InputError, match="no page has marks"):
        put(out, [other, readme])


def test_every_table_has_one_place() -> None:
    names = [name for page in PAGES for name in re.findall(r"<!-- bench:([\w-]+) begin -->", page.read_text())]
    assert len(names) == len(set(names))
    assert {"accuracy", "parts", "scaling", "ablation", "clean", "neural", "squat", "window"} <= set(names)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["fast"], "accuracy, parts, layouts, bodies, scaling"),
        (["short", "--methods", "mosh"], "bundle, paper"),
        (["short", "--cases", "right-leg"], "left-leg"),
        (["short", "--motions", "nowhere"], "no such folder"),
        (["short", "--seeds", "0"], "--seeds"),
        (["short", "--frames", "5"], "--frames"),
        (["accuracy", "--gaps", "nothing.npz"], "--gaps"),
    ],
)
def test_what_cannot_be_run_is_said_in_one_sentence(words: list[str], says: str, tmp_path: Path, capsys) -> None:
    assert main(["bench", *words, "--out", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert says in line
    assert not (tmp_path / "out").exists()


def test_every_suite_has_cases_of_different_names_that_can_be_drawn(tmp_path: Path) -> None:
    gaps = tmp_path / "gaps.npz"
    for suite in SUITES:
        names = [case.name for case in cases_of(suite, (), 450, gaps)]
        assert len(set(names)) == len(names) > 0
        assert not [name for name in names if " " in name or "," in name]
    assert "real-gaps" in {case.name for case in cases_of("accuracy", (), 450, gaps)}
    assert {case.settings.part for case in cases_of("parts", ())} == {
        f"{side}_{part}" for side in ("left", "right") for part in ("arm", "leg", "shoulder")
    }
    assert max(case.settings.frames for case in cases_of("scaling", ())) == 45_000


def test_ablations_are_beside_their_method() -> None:
    assert with_ablations(("paper",))[0] == "paper"
    assert {"paper-1-yaw", "paper-stages"} <= set(with_ablations(("paper",)))
    assert all(name.startswith("bundle") for name in with_ablations(("bundle",)))
    assert with_ablations(("registration", "mosh=results")) == ("registration", "mosh=results")


def test_motions_of_a_folder_are_spread_evenly(shared_data: Path) -> None:
    every = find_motions(shared_data / "motion", 1000)
    assert len({motion.digest for motion in every}) == len(every) > 10
    names = [motion.name for motion in every]
    some = [motion.name for motion in find_motions(shared_data / "motion", 5)]
    assert len(some) == 5
    assert (some[0], some[-1]) == (names[0], names[-1])
    assert {motion.path.suffix for motion in find_motions(shared_data / "motion", 5)} == {".bvh", ".amc"}
    assert isinstance(read_source(every[-1]), SkeletonMotion)


def test_an_amc_finds_its_skeleton(tmp_path: Path) -> None:
    for name in ("02.asf", "021.asf", "02_01.amc", "021_05.amc", "03_01.amc"):
        (tmp_path / name).touch()
    pairs = {name: motions._skeleton_of(tmp_path / f"{name}.amc") for name in ("02_01", "021_05", "03_01")}
    assert pairs == {"02_01": tmp_path / "02.asf", "021_05": tmp_path / "021.asf", "03_01": None}


def test_the_command_in_the_header_names_no_folder_of_this_machine() -> None:
    request = BenchRequest("accuracy", motions=Path("/home/somebody/recordings"), methods=("bundle", "paper"), seeds=5)
    assert request.command == "markerscope bench accuracy --motions recordings --methods bundle,paper --seeds 5"


def test_the_manual_names_every_suite_method_and_bin() -> None:
    text = (Path(__file__).parents[2] / "docs" / "benchmark.md").read_text()
    for name in SUITES:
        assert f"| `{name}` |" in text
    for name in VARIANTS:
        assert f"`{name}`" in text, name
    assert BINS[-1][0] == 0.99
