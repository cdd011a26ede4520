"""Whatever is wrong with what the user gives: one sentence, exit code 2, nothing run and nothing left behind."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.commands.solve import session_of
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.request import SolveRequest
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_csv import write_markers_csv
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.pipeline.digest import file_digest
from markerscope.solver.pipeline.session import save_session
from tests.fit.conftest import simulate
from tests.synthetic import Recording, know, record, watched

TINY = {"localize": {"yaws": 6, "few": 4, "many": 6, "keep": 3}, "orient": {"refine": 1}}
WRITERS: dict[str, Callable[[Path, Markers], None]] = {
    ".c3d": write_c3d,
    ".trc": write_trc,
    ".csv": write_markers_csv,
}
GARBAGE = np.random.default_rng(0).bytes(3000)


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    scene = simulate(with_bone_lengths(Body.load()), 5, frames=80, markers=24)
    return record(tmp_path_factory.mktemp("good"), scene)


@dataclass
class Shell:
    """Runs commands and judges how they end."""

    good: Recording
    folder: Path
    capsys: pytest.CaptureFixture[str]

    @property
    def out(self) -> Path:
        return self.folder / "out"

    def file(self, name: str, content: bytes | str = b"") -> Path:
        path = self.folder / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    def run(self, *words: object) -> tuple[int, str]:
        code = main(["solve", *map(str, words), "--quiet"])
        return code, self.capsys.readouterr().err

    def refused(self, *words: object, names: object = "", out: bool = True) -> str:
        """The one sentence of a refusal, which must name a file and leave no trace."""
        before = set(self.folder.rglob("*"))
        code, said = self.run(*words, *(("--out", self.out) if out else ()))
        assert code == 2, f"exit code {code}: {said}"
        assert said.count("\n") == 1 and said.endswith(".\n"), f"not one sentence: {said!r}"
        assert "Traceback" not in said and str(names) in said
        assert set(self.folder.rglob("*")) == before, "something was left behind"
        return said


@pytest.fixture
def shell(good: Recording, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Shell:
    return Shell(good, tmp_path, capsys)


def whole(shell: Shell, suffix: str, change: Callable[[Markers], Markers] = lambda markers: markers) -> Path:
    """The good recording's markers, changed, in a format."""
    path = shell.folder / f"trial{suffix}"
    WRITERS[suffix](path, change(load_markers(shell.good.markers, up="z")))
    return path


# markers


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(
    ("content", "says"), [(None, "no such file"), (b"", "is empty"), (GARBAGE, "is"), (b"\0" * 600, "is")]
)
def test_markers_that_are_no_markers(shell: Shell, suffix: str, content: bytes | None, says: str) -> None:
    path = shell.folder / f"trial{suffix}"
    if content is not None:
        path.write_bytes(content)
    assert says in shell.refused(path, "--prior", shell.good.prior, names=path)


@pytest.mark.parametrize(("suffix", "share"), [(".c3d", 0.5), (".c3d", 0.02), (".trc", 0.02), (".csv", 0.002)])
def test_markers_that_are_cut_off(shell: Shell, suffix: str, share: float) -> None:
    path = whole(shell, suffix)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    shell.refused(path, "--prior", shell.good.prior, names=path)


@pytest.mark.parametrize("suffix", WRITERS)
@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda m: replace(m, positions=np.full_like(m.positions, np.nan)), "every sample is lost"),
        (lambda m: m.select(markers=slice(0, 2)), "2 markers .* at least 3; record with more markers"),
        (lambda m: m.select(frames=slice(30, 31)), "1 frame .* at least 10"),
        (lambda m: replace(m, positions=np.ones_like(m.positions)), "all its markers in one place"),
    ],
    ids=["never seen", "two markers", "one frame", "one place"],
)
def test_markers_that_say_nothing(shell: Shell, suffix: str, change: Callable[[Markers], Markers], says: str) -> None:
    path = whole(shell, suffix, change)
    said = shell.refused(path, "--prior", shell.good.prior, "--up", "z", "--units", "m", names=path)
    assert re.search(says, said), said


def test_a_c3d_without_points(shell: Shell) -> None:
    path = whole(shell, ".c3d", lambda markers: markers.select(markers=slice(0, 0)))
    assert "without points" in shell.refused(path, "--prior", shell.good.prior, names=path)


def test_a_range_beyond_the_recording(shell: Shell) -> None:
    said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--range", "100:", names=shell.good.markers)
    assert "the recording runs from 0 s to" in said


def test_a_folder_that_is_no_session(shell: Shell) -> None:
    assert "without a session" in shell.refused(shell.folder, names=shell.folder)


def test_neither_video_nor_poses(shell: Shell) -> None:
    assert "--video or --prior" in shell.refused(shell.good.markers, names=shell.good.markers)


# video


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "no such file"),
        (b"", "is empty"),
        (GARBAGE, "not a video"),
        (b"\0\0\0\x18ftypmp42" + GARBAGE, "not a video"),
    ],
)
def test_a_video_that_does_not_decode(shell: Shell, content: bytes | None, says: str) -> None:
    path = shell.folder / "video.mp4"
    if content is not None:
        path.write_bytes(content)
    assert says in shell.refused(shell.good.markers, "--video", path, names=path)


def test_a_folder_for_a_video(shell: Shell) -> None:
    assert "is a folder" in shell.refused(shell.good.markers, "--video", shell.good.markers.parent)


def grey_video(path: Path, frames: int) -> Path:
    av = pytest.importorskip("av", reason="the package av is not installed")
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mpeg4", rate=Fraction(30))
        stream.width, stream.height, stream.pix_fmt = 160, 120, "yuv420p"
        for _ in range(frames):
            picture = av.VideoFrame.from_ndarray(np.full((120, 160, 3), 128, np.uint8), format="rgb24")
            container.mux(stream.encode(picture))
        container.mux(stream.encode())
    return path


def test_a_video_without_a_person(shell: Shell) -> None:
    path = grey_video(shell.folder / "grey.mp4", 3)
    said = shell.refused(shell.good.markers, "--video", path, names=path)
    assert "no person is found" in said and "whole subject" in said


def seen_for(shell: Shell, start: float, stop: float) -> list[object]:
    """Words for a solve whose video, already watched, lasts from one second to another of the good one's."""
    request = SolveRequest(shell.good.markers, out=shell.out, video=shell.good.video)
    made = replace(session_of(request), settings=TINY)
    full = watched(shell.good)
    part = slice(*np.searchsorted(full.time, (start, stop)))
    arrays = {name: getattr(full, name)[part] for name in ("image", "world", "visibility", "tracked")}
    time = full.time[part] - full.time[part][0]
    know(made, shell.good, replace(full, **arrays, time=time, frame=np.arange(len(time))))
    save_session(made)
    return [shell.out]


def test_a_video_that_is_much_shorter_is_used_for_what_it_shows(shell: Shell) -> None:
    code = main(["solve", *map(str, seen_for(shell, 0.8, 2.8)), "--offset", str(shell.good.offset + 0.8), "--json"])
    told = shell.capsys.readouterr()
    assert code == 0, told.err
    assert re.search(r"video shows the person for only \d\d % of the markers' time", told.out), told.out
    with np.load(shell.out / "motion.npz") as motion:
        error = 1000 * np.linalg.norm(motion["joints"] - shell.good.joints, axis=2)[:, :22].mean()
    assert error < 40, f"joints are {error:.1f} mm off"


def test_a_video_that_is_too_short_to_find_the_offset(shell: Shell) -> None:
    code, said = shell.run(*seen_for(shell, 1.0, 1.5))
    assert code == 2 and "1 s of movement are needed" in said and "give the offset" in said, said
    assert not (shell.out / "motion.npz").exists()


def test_a_video_of_another_time(shell: Shell) -> None:
    code, said = shell.run(*seen_for(shell, 0.0, 4.0), "--offset", "60")
    assert code == 2 and "at no time of the markers" in said and "from 60.00 to" in said, said


# poses of another program


class Evil:
    """What a stranger's pickle may ask for."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[object, ...]:
        return os.system, (f"touch {self.path}",)


def test_a_pickle_that_wants_to_run_something(shell: Shell) -> None:
    marker = shell.folder / "ran"
    for option, name in (("--prior", "wham.pkl"), ("--body", "SMPL.pkl")):
        path = shell.file(name, pickle.dumps({"pose": Evil(marker)}))
        said = shell.refused(shell.good.markers, "--prior", shell.good.prior, option, path, names=path)
        assert "was not opened" in said
    assert not marker.exists()


@pytest.mark.parametrize("name", ["prior.npz", "wham.pkl", "gvhmr.pt", "tram.npy"])
@pytest.mark.parametrize(("content", "says"), [(None, "no such file"), (b"", "is empty"), (GARBAGE, "")])
def test_poses_that_are_no_poses(shell: Shell, name: str, content: bytes | None, says: str) -> None:
    path = shell.folder / name
    if content is not None:
        path.write_bytes(content)
    assert says in shell.refused(shell.good.markers, "--prior", path, names=path)


def test_poses_that_are_cut_off(shell: Shell) -> None:
    path = shell.file("prior.npz", shell.good.prior.read_bytes()[:2000])
    shell.refused(shell.good.markers, "--prior", path, names=path)


def shorter_prior(shell: Shell, frames: int) -> Path:
    path = shell.folder / "short.npz"
    with np.load(shell.good.prior) as file:
        np.savez(path, **{**file, "poses": file["poses"][:frames], "trans": file["trans"][:frames]})
    return path


def test_poses_that_are_too_few_to_find_the_offset(shell: Shell) -> None:
    for frames in (1, 8):
        path = shorter_prior(shell, frames)
        assert "give the offset" in shell.refused(shell.good.markers, "--prior", path, names=path)


def test_poses_of_another_length_are_used_for_what_they_show(shell: Shell) -> None:
    path = shorter_prior(shell, 50)
    request = SolveRequest(shell.good.markers, out=shell.out, prior=path, offset=shell.good.offset)
    save_session(replace(session_of(request), settings={**TINY, "sync": {"offset": shell.good.offset}}))
    code = main(["solve", str(shell.out)])
    told = shell.capsys.readouterr()
    assert code == 0, told.err
    assert re.search(r"shows the person for only \d\d % of the markers' time", told.out), told.out


# camera, body, session


def camera(**wrong: object) -> bytes:
    """A camera file with something wrong in it."""
    content = {"R_lab_cam": np.eye(3).tolist(), "position_m": [0, 0, 0], "focal_px": 9.0, "image_size_px": [9, 9]}
    return json.dumps({**content, **wrong}).encode()


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "is empty"),
        (GARBAGE, "not a camera file"),
        (b"[]", "not a camera file"),
        (b"{}", "not a camera file"),
        (b"[" * 100000, "not a camera file"),
        (b'{"R_lab_cam": 3, "position_m": 3, "focal_px": 3, "image_size_px": [1e999, 9]}', "not a camera file"),
        (camera(focal_px=-3), "no proper camera"),
        (camera(focal_px=float("inf")), "no proper camera"),
        (camera(image_size_px=[0, 9]), "no proper camera"),
        (camera(position_m=[0, 0]), "no proper camera"),
        (camera(R_lab_cam=[[1, 0, 0], [0, 1, 0], [0, 0, 2]]), "no proper camera"),
        (camera(R_lab_cam=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]), "no proper camera"),
        (camera(reprojection_px="far"), "not a camera file"),
    ],
)
def test_a_camera_that_is_none(shell: Shell, content: bytes, says: str) -> None:
    path = shell.file("camera.json", content)
    said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--camera", path, names=path)
    assert says in said


def test_a_result_without_a_camera(shell: Shell) -> None:
    said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--camera", shell.folder, names=shell.folder)
    assert "holds no camera.json" in said


@pytest.mark.parametrize("name", ["SMPL.npz", "SMPL.pkl"])
@pytest.mark.parametrize(("content", "says"), [(None, "no such file"), (b"", "is empty"), (GARBAGE, "")])
def test_a_body_that_is_none(shell: Shell, name: str, content: bytes | None, says: str) -> None:
    path = shell.folder / name
    if content is not None:
        path.write_bytes(content)
    said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--body", path, names=path)
    assert says in said


def test_a_body_is_looked_at_before_the_video_is_watched(shell: Shell) -> None:
    body = shell.file("SMPL.npz", GARBAGE)
    shell.refused(shell.good.markers, "--video", shell.good.video, "--body", body, names=body)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (b"", "does not say which schema"),
        (GARBAGE, "not a session file"),
        ("schema = 1\n[settings.fitt]\n", 'unknown stage "fitt"'),
        ("schema = 1\n[settings.sync]\noffset = 'late'\n", "'late' is not what is expected"),
        ("schema = 1\n[settings.sync]\noffset = nan\n", "not a time"),
        ("schema = 1\n[settings.landmarks]\nrate = 0\n", "above 0"),
        ("schema = 1\n[edits.fit]\ncandidate = 'best'\n", "'best' is not what is expected"),
        ("schema = 1\n[edits.clean]\nswaps = [[3, 3, 10]]\n", "names marker 3 twice"),
        ("schema = 1\n[edits.clean]\nswaps = [[3, 4, -10]]\n", "frames count up from 0"),
        ("schema = 1\n[edits.clean]\njoins = [[3, 4, 9, 5]]\n", "from frame 9 to 5"),
        ("schema = 1\n[edits.clean]\nkeep = [[3, 9, 5]]\n", "from frame 9 to 5"),
        ("schema = 1\n[run]\nmethod = 'magic'\n", "'magic' is not what is expected"),
        ("schema = 1\nrun = 3\n", "[run] is not a table"),
        ("schema = 99\nprogram = 'markerscope 9'\n", "update Markerscope"),
    ],
)
def test_a_session_that_is_none(shell: Shell, text: bytes | str, says: str) -> None:
    if isinstance(text, str) and "schema = 1\n" in text:
        text += (
            f"[inputs.marker_file]\npath = '{shell.good.markers}'\n[inputs.prior_file]\npath = '{shell.good.prior}'\n"
        )
    shell.file("session.toml", text)
    assert says in shell.refused(shell.folder, names="session.toml", out=False)


def test_edits_of_tracks_are_not_moved_to_other_frames_by_another_range(shell: Shell) -> None:
    shell.file(
        "session.toml",
        "schema = 1\n[settings.markers]\nstart = 0.5\n[edits.clean]\nkeep = [[3, 5, 9]]\n"
        f"[inputs.marker_file]\npath = '{shell.good.markers}'\n[inputs.prior_file]\npath = '{shell.good.prior}'\n",
    )
    for words in ([shell.folder, "--range", "1:"], [shell.good.markers, "--prior", shell.good.prior]):
        request = [str(word) for word in words]
        code = main(["solve", *request, "--out", str(shell.folder)])
        said = shell.capsys.readouterr().err
        assert code == 2 and "counts frames from the start of the range" in said, said
    kept = SolveRequest(shell.folder, range=(0.5, 3.0))
    assert session_of(kept).edits == {"clean": {"keep": [[3, 5, 9]]}}


def test_edits_by_number_are_not_carried_to_other_markers(shell: Shell) -> None:
    mine = whole(shell, ".trc")
    digest = file_digest(mine)
    text = (
        "schema = 1\n[edits.segment]\nleft_out = [0]\n"
        f"[inputs.prior_file]\npath = '{shell.good.prior}'\n[inputs.marker_file]\npath = '{mine}'\n"
    )
    shell.file("session.toml", f"{text}sha256 = '{digest}'\n")
    assert session_of(SolveRequest(shell.folder)).edits
    whole(shell, ".trc", lambda markers: replace(markers, labels=markers.labels[::-1]))
    said = shell.refused(shell.folder, names=mine, out=False)
    assert "edits.segment" in said and "names its markers by number" in said
    shell.file("session.toml", text)
    assert session_of(SolveRequest(shell.folder)).edits, "somebody has looked and says so"


@pytest.mark.parametrize("role", ["marker", "video", "prior"])
def test_a_session_whose_input_is_gone(shell: Shell, role: str) -> None:
    inputs = {"marker": shell.good.markers, "prior": shell.good.prior} | {role: shell.folder / "gone"}
    rows = [f"[inputs.{name}_file]\npath = '{path}'\n" for name, path in inputs.items()]
    shell.file("session.toml", "schema = 1\n" + "".join(rows))
    said = shell.refused(shell.folder, names=shell.folder / "gone", out=False)
    assert f"the {role} file" in said and "move it back" in said


# where results go


def test_an_output_folder_that_is_a_file(shell: Shell) -> None:
    for path in (shell.file("taken"), shell.folder / "taken" / "below"):
        said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--out", path, out=False)
        assert "a file of that name" in said


def test_an_output_folder_that_cannot_be_written(shell: Shell) -> None:
    place = Path("/proc/markerscope")
    if not place.parent.is_dir():
        pytest.skip("this system has no /proc, and root may write everywhere else")
    said = shell.refused(shell.good.markers, "--prior", shell.good.prior, "--out", place, names=place, out=False)
    assert "cannot be written" in said


def test_results_that_would_replace_their_own_input(shell: Shell) -> None:
    shell.out.mkdir()
    path = shell.out / "markers_labelled.c3d"
    path.write_bytes(shell.good.markers.read_bytes())
    assert "would be overwritten" in shell.refused(path, "--prior", shell.good.prior, names=path)


@contextmanager
def small_files(limit: int) -> Iterator[str]:
    """Python statements under which no file may grow beyond ``limit`` bytes, as on a disk that is full."""
    pytest.importorskip("resource", reason="this system sets no limits")
    yield f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit}))"


@pytest.mark.parametrize(("limit", "place"), [(10_000, "out"), (80_000, "results")])
def test_a_disk_that_is_full(shell: Shell, limit: int, place: str) -> None:
    """Before anything is written, and in the middle of the work."""
    words = ["solve", str(shell.good.markers), "--prior", str(shell.good.prior), "--out", str(shell.out), "--quiet"]
    with small_files(limit) as limited:
        code = textwrap.dedent(
            f"""
            import sys
            from markerscope.app.cli.main import main
            {limited}
            sys.exit(main({words!r}))
            """
        )
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=Path(__file__).parents[1], capture_output=True, text=True
        )
    assert done.returncode == 2, done.stderr
    assert done.stderr.count("\n") == 1 and "cannot be written" in done.stderr and place in done.stderr, done.stderr
    assert not shell.out.exists()


def test_as_a_program_of_its_own(shell: Shell) -> None:
    path = shell.file("trial.c3d", GARBAGE)
    words = [sys.executable, "-m", "markerscope.app", "solve", path, "--prior", shell.good.prior, "--out", shell.out]
    done = subprocess.run(list(map(str, words)), cwd=Path(__file__).parents[1], capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stdout == "" and "Traceback" not in done.stderr
    assert (
        done.stderr.splitlines()[-1]
        == f"{path}: is not a C3D file; export it again or give the file its right extension."
    )


def test_weights_for_a_method_that_reads_none(shell: Shell) -> None:
    good = shell.good
    said = shell.refused(good.markers, "--prior", good.prior, "--weights", shell.file("w.safetensors"))
    assert "weights are for --method neural alone" in said
