"""The command line: what is asked reaches the solver, and every ending is one sentence and its exit code."""

from __future__ import annotations

import errno
import io
import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli import commands as cli_commands
from markerscope.app.cli.commands import Services
from markerscope.app.cli.main import COMMANDS, main
from markerscope.app.cli.output import ProgressBar, json_line
from markerscope.solver import __version__
from markerscope.solver.core.errors import Cancelled, InputError, MarkerscopeError
from markerscope.solver.core.progress import Progress
from markerscope.solver.core.request import EvaluateRequest, Outcome, SolveOutcome, SolveRequest
from markerscope.solver.datasets.request import DatasetRequest, Options
from markerscope.solver.io import output_folder as output


class Fake:
    """Services that note what they were asked; ``fails`` is raised after something was begun in the folder."""

    def __init__(self, fails: BaseException | None = None) -> None:
        self.solves: list[SolveRequest] = []
        self.evaluations: list[EvaluateRequest] = []
        self.demos: list[Path] = []
        self.fails = fails
        self.windows: list[tuple[Path | None, bool]] = []
        self.display = ""

    def solve(self, request: SolveRequest, progress: Progress) -> SolveOutcome:
        self.solves.append(request)
        out = request.out or request.markers
        (out / "results" / "fit").mkdir(parents=True)
        progress(0.5, "fit: keyframes")
        if self.fails:
            raise self.fails
        summary = {"seconds": {"fit": np.float64(1.5)}, "energy": float("nan"), "frames": np.int64(3)}
        return SolveOutcome(summary=summary, lines=("47 markers on 14 bones.",), warnings=("A tie.",), out=out)

    def evaluate(self, request: EvaluateRequest, progress: Progress) -> Outcome:
        self.evaluations.append(request)
        return Outcome(summary={"mpjpe_mm": 12.0}, lines=("MPJPE 12.0 mm.",))

    def judge_demo(self, result: Path, progress: Progress) -> Outcome:
        self.demos.append(result)
        return Outcome(summary={"mpjpe_mm": 12.0}, lines=("MPJPE 12.0 mm.",))

    @property
    def services(self) -> Services:
        return Services(self.solve, self.evaluate, self.judge_demo, no_window=lambda: self.display, window=self.window)

    def window(self, path: Path | None, example: bool) -> int:
        self.windows.append((path, example))
        return 0


@pytest.fixture
def markers(tmp_path: Path) -> Path:
    path = tmp_path / "trial.trc"
    path.write_text("markers")
    return path


def test_every_option_reaches_the_solver(markers: Path, tmp_path: Path) -> None:
    for name in ("v.mp4", "p.npz", "body.npz", "person.npz"):
        (tmp_path / name).touch()
    (tmp_path / "full").mkdir()
    fake = Fake()
    words = (
        f"solve {markers} --video {tmp_path}/v.mp4 --prior {tmp_path}/p.npz --camera {tmp_path}/full "
        f"--body {tmp_path}/body.npz --up y --units mm --marker-rate 100 --subject Ann --range -1.5:4 --offset -1e-3 "
        f"--rate-ratio 1.001 --method bundle --convention isb --seed 7 --landmark-pull off --standard-errors "
        f"--known {tmp_path}/person.npz --markers-moved --out {tmp_path}/out"
    )
    assert main(words.split(), fake.services) == 0
    assert fake.solves == [
        SolveRequest(
            markers,
            out=tmp_path / "out",
            video=tmp_path / "v.mp4",
            prior=tmp_path / "p.npz",
            camera=tmp_path / "full",
            offset=-0.001,
            rate_ratio=1.001,
            up="y",
            units="mm",
            subject="Ann",
            marker_rate=100.0,
            range=(-1.5, 4.0),
            method="bundle",
            seed=7,
            body=tmp_path / "body.npz",
            convention="isb",
            landmark_pull="off",
            known=tmp_path / "person.npz",
            markers_moved=True,
            standard_errors=True,
        )
    ]


def test_every_option_reaches_the_datasets() -> None:
    asked: list[DatasetRequest] = []

    def cut(request: DatasetRequest, progress: Progress) -> Outcome:
        asked.append(request)
        return Outcome(summary={})

    words = "dataset kitchen in --out out --priors p --offsets o.json --parts left_arm right_leg --windows 2 --backpack"
    assert main(words.split(), replace(Fake().services, dataset=cut)) == 0
    assert main("dataset moyo in --out out --split train".split(), replace(Fake().services, dataset=cut)) == 0
    assert asked == [
        DatasetRequest(
            "kitchen",
            Path("in"),
            Path("out"),
            parts=("left_arm", "right_leg"),
            windows=2,
            priors=Path("p"),
            offsets=Path("o.json"),
            options=Options(backpack=True),
        ),
        DatasetRequest("moyo", Path("in"), Path("out"), options=Options(split="train")),
    ]


def test_what_was_found_is_printed_and_json_is_the_last_line(markers: Path, tmp_path: Path, capsys) -> None:
    assert main(["solve", str(markers), "--out", str(tmp_path / "out"), "--json"], Fake().services) == 0
    printed = capsys.readouterr()
    assert printed.out.splitlines()[:2] == ["47 markers on 14 bones.", "Warning: A tie."]
    assert json.loads(printed.out.splitlines()[-1]) == {
        "warnings": ["A tie."],
        "seconds": {"fit": 1.5},
        "energy": None,
        "frames": 3,
    }
    assert "fit: keyframes" in printed.err


def test_quiet_prints_the_json_alone(markers: Path, tmp_path: Path, capsys) -> None:
    words = ["solve", str(markers), "--out", str(tmp_path / "out"), "--json", "--quiet"]
    assert main(words, Fake().services) == 0
    printed = capsys.readouterr()
    assert len(printed.out.splitlines()) == 1
    assert printed.err == ""


def test_demo_solves_the_embedded_session_and_compares_with_the_truth(tmp_path: Path, capsys) -> None:
    fake = Fake()
    assert main(["demo", "--headless", "--out", str(tmp_path / "out"), "--json"], fake.services) == 0
    assert fake.solves == [SolveRequest(cli_commands.DEMO_MARKERS, video=cli_commands.DEMO_VIDEO, out=tmp_path / "out")]
    assert fake.demos == [tmp_path / "out"]
    printed = capsys.readouterr().out
    assert "Against the known truth:\nMPJPE 12.0 mm." in printed
    assert json.loads(printed.splitlines()[-1])["evaluation"] == {"mpjpe_mm": 12.0}


def test_evaluate_compares(markers: Path, tmp_path: Path, capsys) -> None:
    fake = Fake()
    assert main(["evaluate", str(tmp_path), str(markers)], fake.services) == 0
    assert fake.evaluations == [EvaluateRequest(tmp_path, markers)]
    assert capsys.readouterr().out == "MPJPE 12.0 mm.\n"


def test_without_a_command_the_window_opens(markers: Path, tmp_path: Path) -> None:
    fake = Fake()
    for words, asked in (([], (None, False)), ([str(markers)], (markers, False)), (["demo"], (None, True))):
        assert main(words, fake.services) == 0
        assert fake.windows.pop() == asked
    assert not fake.solves and not fake.windows


def test_demo_stays_in_the_terminal_where_there_is_no_display(tmp_path: Path) -> None:
    fake = Fake()
    fake.display = "there is no display"
    assert main(["demo", "--out", str(tmp_path / "out")], fake.services) == 0
    assert fake.demos == [tmp_path / "out"] and not fake.windows


def test_a_window_without_a_display_is_one_sentence(monkeypatch: pytest.MonkeyPatch, capsys) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("markerscope.app.window.start.sys.platform", "linux")
    assert main([]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "there is no display" in said and "demo --headless" in said


def test_a_session_is_solved_into_its_own_folder(tmp_path: Path) -> None:
    (tmp_path / "session.toml").write_text("schema = 1\n")
    fake = Fake()
    assert main(["solve", str(tmp_path)], fake.services) == 0
    assert fake.solves == [SolveRequest(tmp_path)]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("slove MARKERS", '"slove" is neither a command nor a file'),
        ("MARKERS MARKERS", "one session or marker file at a time"),
        ("solve", "arguments are required: MARKERS|SESSION"),
        ("solve MARKERS", "no folder for the results was named; add --out DIR."),
        ("solve absent.trc --out OUT", "absent.trc: there is no such file; check the name"),
        ("solve MARKERS --video absent.mp4 --out OUT", r"absent.mp4: there is no such file \(--video\)"),
        ("solve MARKERS --camera absent --out OUT", r"there is no such file \(--camera\)"),
        ("evaluate absent MARKERS", "absent: there is no such file;"),
        ("solve MARKERS --out MARKERS", "a file of that name is there"),
        ("solve MARKERS --out MARKERS/deeper", "a file of that name is there"),
        ("solve MARKERS --out OUT --range 4", '--range: "4" is not understood; give A:B'),
        ("solve MARKERS --out OUT --range a:b", '--range: "a:b" is not understood'),
        ("solve MARKERS --out OUT --range 4:2", "--range: it ends at 2 s and starts at 4 s"),
        ("solve MARKERS --out OUT --range nan:2", "--range: it cannot end at nan"),
        ("solve MARKERS --out OUT --offset nan", "--offset: nan is not possible"),
        ("solve MARKERS --out OUT --rate-ratio 0", "--rate-ratio: 0 is not possible"),
        ("solve MARKERS --out OUT --marker-rate -100", "--marker-rate: -100 is not possible"),
        ("solve MARKERS --out OUT --seed -1", "--seed: -1 is not possible"),
        ("solve MARKERS --out OUT --rate-ratio -1e-3", "--rate-ratio: -0.001 is not possible"),
        ("solve MARKERS --out OUT --neutral -4:-5", "--neutral: it ends at -5 s and starts at -4 s"),
        ("solve MARKERS --json -5", "unrecognized arguments: -5|ignored explicit argument '-5'"),
        ("solve MARKERS --out OUT --up w", "argument --up: invalid choice: 'w'"),
        ("solve MARKERS --out OUT --offset soon", "argument --offset: invalid float value: 'soon'"),
        ("solve MARKERS --colour red", "unrecognized arguments: --colour red"),
    ],
)
def test_what_cannot_be_done_is_one_sentence_and_exit_code_2(
    words: str, says: str, markers: Path, tmp_path: Path, capsys
) -> None:
    fake = Fake()
    before = sorted(tmp_path.iterdir())
    line = words.replace("MARKERS", str(markers)).replace("OUT", str(tmp_path / "out"))
    says = says.replace("MARKERS|SESSION", re.escape("MARKERS|SESSION"))
    assert main(line.split(), fake.services) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert re.search(says, printed.err)
    assert len(printed.err.splitlines()) == 1
    assert not fake.solves
    assert sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("error", "code", "says"),
    [
        (InputError("has no points", "a.c3d", "export it again"), 2, "^a.c3d: has no points; export it again.$"),
        (OSError(errno.ENOSPC, "No space left on device", "/mnt/x"), 2, "^/mnt/x: No space left on device; free some"),
        (Cancelled("Cancelled."), 130, "^Cancelled.$"),
        (KeyboardInterrupt(), 130, "^Cancelled.$"),
        (MarkerscopeError("The worker process ended."), 1, "^The worker process ended.$"),
        (MemoryError(), 1, "not enough memory"),
        (KeyError("hip\nknee"), 1, r"^Markerscope made a mistake \(KeyError: .*\); the details are in .*\.log"),
    ],
)
def test_every_other_ending_is_one_sentence_too(error, code, says, markers: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "new" / "out"
    assert main(["solve", str(markers), "--out", str(out), "--quiet"], Fake(error).services) == code
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.splitlines()) == 1
    assert re.search(says, printed.err.strip())
    assert not out.exists()
    if code == 1 and "details" in printed.err:
        log = Path(re.search(r"in (\S+\.log)", printed.err).group(1))
        assert "Traceback" in log.read_text()
        log.unlink()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="the system has no /dev/full")
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_a_full_standard_output_is_named_and_not_the_folder_for_temporary_files(unbuffered: str) -> None:
    code = (
        "import argparse, os; from markerscope.app.cli.endings import ended; "
        "from markerscope.app.cli.output import Terminal; from markerscope.solver.core.request import Outcome\n"
        "try: Terminal(argparse.Namespace(json=True, quiet=True)).show(Outcome(summary={}, lines=()))\n"
        "except OSError as error: os._exit(ended(error))"
    )
    environment = {**os.environ, "PYTHONUNBUFFERED": unbuffered}
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [sys.executable, "-c", code], env=environment, stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert run.returncode == 2
    assert run.stderr.startswith("the standard output: No space left on device; free some"), run.stderr


def test_debug_shows_the_traceback(markers: Path, tmp_path: Path, capsys) -> None:
    words = ["solve", str(markers), "--out", str(tmp_path / "out"), "--debug"]
    assert main(words, Fake(KeyError("hip")).services) == 1
    printed = capsys.readouterr().err
    assert "Traceback" in printed
    assert printed.splitlines()[-1].endswith("the details are shown above.")


def test_results_that_were_there_survive_a_failure(markers: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "angles.csv").write_text("old")
    main(["solve", str(markers), "--out", str(out)], Fake(InputError("no")).services)
    assert (out / "angles.csv").read_text() == "old"


def test_a_folder_that_cannot_be_written_is_said_before_the_work(markers: Path, tmp_path, monkeypatch, capsys) -> None:
    def full(handle: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(output.os, "fsync", full)
    fake = Fake()
    assert main(["solve", str(markers), "--out", str(tmp_path / "out")], fake.services) == 2
    assert "cannot be written: the disk is full" in capsys.readouterr().err
    assert not fake.solves
    assert list(tmp_path.iterdir()) == [markers]


def test_version_and_help(capsys) -> None:
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"markerscope {__version__}\n"
    for words in ([], *([command] for command in COMMANDS)):
        assert main([*words, "--help"]) == 0
        assert "--help" in capsys.readouterr().out


def test_the_manual_describes_exactly_the_options_there_are(capsys) -> None:
    manual = (Path(__file__).parents[1] / "docs" / "command-line.md").read_text(encoding="utf-8")
    options = set()
    for words in ([], *([command] for command in COMMANDS), ["markerset", "learn"]):
        main([*words, "--help"])
        options |= set(re.findall(r"--[a-z][a-z-]+", capsys.readouterr().out))
    assert options == set(re.findall(r"(?<!\w)--[a-z][a-z-]+", manual))


@pytest.mark.skipif(os.name != "posix", reason="signals are sent otherwise elsewhere")
def test_control_c_ends_a_real_run(markers: Path, tmp_path: Path) -> None:
    code = (
        "import signal, sys, time\n"
        "from markerscope.app.cli.main import main; from markerscope.app.cli.commands import Services\n"
        # a shell's background jobs ignore the signal, and hand that down
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "def solve(request, progress): print('ready', flush=True); time.sleep(60)\n"
        f"sys.exit(main(['solve', {str(markers)!r}, '--out', {str(tmp_path / 'out')!r}], Services(solve)))"
    )
    root = Path(__file__).parents[1]
    with subprocess.Popen([sys.executable, "-c", code], cwd=root, stdout=-1, stderr=-1, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        process.send_signal(signal.SIGINT)
        _, err = process.communicate()
    assert process.returncode == 130
    assert err.splitlines()[-1] == "Cancelled."
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(os.name != "posix", reason="pipes end otherwise elsewhere")
def test_a_reader_that_leaves_ends_the_command_without_a_word(markers: Path) -> None:
    root = Path(__file__).parents[1]
    code = (
        "import sys; from markerscope.app.cli.main import main; from markerscope.app.cli.commands import Services\n"
        "from markerscope.solver.core.request import Outcome\n"
        "services = Services(evaluate=lambda request, progress: Outcome(summary={}, lines=('MPJPE 12 mm.',)))\n"
        f"sys.exit(main(['evaluate', {str(markers)!r}, {str(markers)!r}, '--json'], services))"
    )
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as pipe:
        run = subprocess.run([sys.executable, "-c", code], cwd=root, stdout=pipe, stderr=-1, text=True)
    assert run.stderr == ""
    assert run.returncode == 1


class Screen(io.StringIO):
    def __init__(self, live: bool) -> None:
        super().__init__()
        self.live = live

    def isatty(self) -> bool:
        return self.live


def test_the_bar_shows_the_time_left_and_goes_away() -> None:
    now = [0.0]
    screen = Screen(live=True)
    bar = ProgressBar(screen, lambda: now[0])
    for second in range(0, 31):
        now[0] = float(second)
        bar(second / 120, f"fit {second}")
    last = screen.getvalue().split("\r")[-1]
    assert last.rstrip() == "[#####...............]  25 %  1:30 left  fit 30"
    bar.close()
    assert screen.getvalue().endswith(f"\r{' ' * len(last.rstrip())}\r")


def test_where_nobody_watches_lines_are_few() -> None:
    now = [0.0]
    screen = Screen(live=False)
    bar = ProgressBar(screen, lambda: now[0])
    for step in range(1000):
        now[0] = step * 0.03
        bar(step / 1000, "landmarks")
    bar.close()
    lines = screen.getvalue().splitlines()
    assert lines == ["  0 %  landmarks", " 33 %  landmarks", " 67 %  landmarks"]


def test_the_summary_is_strict_json() -> None:
    summary = {"a": (np.inf, np.float32(0.5)), 3: Path("x"), "b": np.arange(2), "c": None, "d": True}
    line = json_line(summary)
    assert json.loads(line) == {"a": [None, 0.5], "3": "x", "b": [0, 1], "c": None, "d": True}
    assert "\n" not in line


def test_a_request_can_be_changed_only_to_what_is_possible(markers: Path) -> None:
    request = SolveRequest(markers)
    with pytest.raises(InputError, match="--up"):
        replace(request, up="w")
