"""The command ``synth``: options, endings, and files that ``solve`` and ``evaluate`` take."""

from __future__ import annotations

import json
import re
from dataclasses import fields
from pathlib import Path

import pytest

from markerscope.app.cli import synth as cli_synth
from markerscope.app.cli.commands import Services
from markerscope.app.cli.main import main
from markerscope.solver.core.progress import Progress
from markerscope.solver.core.request import Outcome, SynthRequest
from markerscope.solver.synth.acts import ACTS
from markerscope.solver.synth.session import SynthSettings


def test_the_command_makes_what_solve_and_evaluate_take(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for motion, more in (("squat", ""), ("reach", "--lost 0.02 --video-lost 0.1 --shape inside")):
        made, solved = tmp_path / motion, tmp_path / f"{motion}-solved"
        assert main(f"synth {motion} --out {made} --frames 45 --seed 2 --quiet --json {more}".split()) == 0
        about = json.loads(capsys.readouterr().out)
        assert (about["frames"], about["markers"], about["motion"]) == (45, 40, motion)
        words = f"solve {made}/markers.c3d --prior {made}/prior.npz --out {solved} --offset 0 --quiet"
        assert main(words.split()) == 0, capsys.readouterr().err
        assert main(f"evaluate {solved} {made}/reference.npz --quiet --json".split()) == 0
        found = json.loads(capsys.readouterr().out.splitlines()[-1])
        assert found["mpjpe_mm"] < 60 and found["v2v_mm"] < 70, f"{motion}: {found['mpjpe_mm']:.0f} mm"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("synth swim --out OUT", "swim: it is neither a file nor a motion of the program's own; name a file, or walk"),
        ("synth walk", "the following arguments are required: --out"),
        ("synth walk --out OUT --lost 2", "--lost: 2 is not possible; give a number from 0 to 0.9."),
        ("synth walk --out OUT --part tail", '--part: "tail" is not known'),
        ("synth walk --out OUT --seed -1", "--seed: -1 is not possible"),
        ("synth walk --out OUT --frames x", "invalid int value: 'x'"),
        ("synth walk --out OUT --gap-statistics OUT.npz", "there is no such file"),
        ("synth walk --out OUT --part left_leg --markers 5", "5 markers are too few for 4 bones"),
    ],
)
def test_what_cannot_be_made_is_one_sentence(words: str, says: str, tmp_path: Path, capsys) -> None:
    assert main([*words.replace("OUT", str(tmp_path / "out")).split(), "--quiet"]) == 2
    printed = capsys.readouterr()
    assert says in printed.err and len(printed.err.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_every_setting_is_an_option_whose_help_tells_its_default(capsys: pytest.CaptureFixture[str]) -> None:
    options = {name: text for group in cli_synth._GROUPS.values() for name, _, _, text in group}
    settings = {field.name: field.default for field in fields(SynthSettings)}
    assert set(options) | {"nested", "video_wrong_shape"} == set(settings)
    words = {"still": "as it is", "part": "all", "gap_statistics": "none"}
    for name, text in options.items():
        default = settings[name]
        told = re.search(r"\(default: ([^)]*)\)", text).group(1)
        assert told == words.get(name, default if isinstance(default, str) else f"{default or 0:g}"), name


def test_the_manual_names_every_motion() -> None:
    docs = Path(__file__).parents[2] / "docs"
    for name in ACTS:
        assert f"| `{name}` |" in (docs / "synthetic.md").read_text(encoding="utf-8")
        assert f"`{name}`" in (docs / "command-line.md").read_text(encoding="utf-8")


def test_every_option_reaches_the_generator(tmp_path: Path) -> None:
    asked = []

    def note(request: SynthRequest, progress: Progress) -> Outcome:
        asked.append(request)
        return Outcome(summary={})

    given = {name: (kind, "0.25") for group in cli_synth._GROUPS.values() for name, kind, *_ in group}
    values = {name: kind("2" if kind is int else text) for name, (kind, text) in given.items()}
    values |= {"part": "left_leg", "layout": "full_body", "shape": "inside", "desync_frames": -2, "longest_gap": -1.5}
    words = [word for name, value in values.items() for word in (f"--{name.replace('_', '-')}", str(value))]
    more = [
        "--seed",
        "7",
        "--skeleton",
        "a.asf",
        "--motion-rate",
        "60",
        "--no-nested",
        "--video-wrong-shape",
        "--quiet",
    ]
    assert main(["synth", "a.amc", "--out", str(tmp_path), *words, *more], Services(synth=note)) == 0
    settings = {**values, "nested": False, "video_wrong_shape": True}
    assert asked == [SynthRequest("a.amc", tmp_path, 7, Path("a.asf"), 60.0, settings)]


def test_what_is_not_given_has_its_default(tmp_path: Path) -> None:
    asked = []
    services = Services(synth=lambda request, progress: asked.append(request) or Outcome(summary={}))
    assert main(["synth", "walk", "--out", str(tmp_path), "--quiet"], services) == 0
    assert asked == [SynthRequest("walk", tmp_path)]
