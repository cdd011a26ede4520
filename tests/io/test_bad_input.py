"""No file, however damaged, ends in anything but markers or one clear sentence."""

from __future__ import annotations

import os
import subprocess
import sys
import textwrap
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import list_subjects, load_markers
from markerscope.solver.io.asf_amc import read_asf_amc
from markerscope.solver.io.bvh import read_bvh
from markerscope.solver.io.export_bvh import write_bvh
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.export_csv import write_markers_csv
from markerscope.solver.io.export_mot import write_mot
from markerscope.solver.io.export_smpl import write_smpl_npz
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.mot import read_mot

WRITERS: dict[str, Callable[[Path, Markers], None]] = {
    ".c3d": write_c3d,
    ".trc": write_trc,
    ".csv": write_markers_csv,
}
relaxed = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.fixture(scope="module")
def whole(recording: Callable[..., Markers], tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], bytearray]:
    """The bytes of a small valid file, by format."""
    folder = tmp_path_factory.mktemp("whole")
    for suffix, write in WRITERS.items():
        write(folder / f"a{suffix}", recording(1))
    return lambda suffix: bytearray((folder / f"a{suffix}").read_bytes())


def outcome(path: Path) -> Markers | None:
    """Markers, or None after a proper refusal; warnings count as failures, since users would see them."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            list_subjects(path)
            markers = load_markers(path)
        except InputError as error:
            assert "\n" not in str(error) and str(error).endswith(".")
            assert path.name in str(error)
            return None
    assert len(set(markers.labels)) == len(markers.labels) == markers.positions.shape[1]
    assert np.isfinite(markers.rate) and markers.rate > 0
    return markers


@pytest.mark.parametrize("suffix", WRITERS)
@relaxed
@given(data=st.data())
def test_truncated_files(tmp_path: Path, whole: Callable[[str], bytearray], suffix: str, data: st.DataObject) -> None:
    content = whole(suffix)
    stop = data.draw(st.integers(0, len(content) - 1))
    path = tmp_path / f"cut{suffix}"
    path.write_bytes(content[:stop])
    markers = outcome(path)
    if suffix == ".c3d":
        assert markers is None or not any(content[stop:]), "data were lost unnoticed"
    elif markers is not None and len(markers.positions) != 12:
        assert any("promises 12 frames" in note for note in markers.notes), "frames were lost unnoticed"


@pytest.mark.parametrize("suffix", WRITERS)
@relaxed
@given(data=st.data())
def test_garbage_in_files(tmp_path: Path, whole: Callable[[str], bytearray], suffix: str, data: st.DataObject) -> None:
    content = whole(suffix)
    for _ in range(data.draw(st.integers(1, 4))):
        near_the_head = data.draw(st.booleans())
        start = data.draw(st.integers(0, min(len(content) - 1, 700) if near_the_head else len(content) - 1))
        stop = start + data.draw(st.integers(0, 8))
        content[start:stop] = data.draw(
            st.binary(min_size=stop - start, max_size=stop - start)
            | st.sampled_from([b"", b"\t", b"\n", b",", b'"', b"nan", b"1e308", b"-", b"\0\0", b"\xff\xff", b"9" * 30])
        )
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(bytes(content))
    outcome(path)


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv", ".tsv", ".txt", ""])
@relaxed
@given(content=st.binary(max_size=2000))
def test_pure_garbage(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    outcome(path)


@pytest.mark.parametrize("suffix", WRITERS)
def test_missing_empty_and_folders(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"a{suffix}"
    with pytest.raises(InputError, match="no such file"):
        load_markers(path)
    path.write_bytes(b"")
    with pytest.raises(InputError, match="empty"):
        load_markers(path)
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(InputError, match="folder"):
        load_markers(tmp_path / f"folder{suffix}")
    with pytest.raises(InputError):
        load_markers(path / "below")
    with pytest.raises(InputError):
        load_markers(tmp_path / "with\0zero")


def test_files_that_may_not_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.trc"
    path.write_text("x")
    path.chmod(0)
    if os.access(path, os.R_OK):  # the superuser may read anything

        def refuse(self: Path) -> bytes:
            raise PermissionError(13, "Permission denied")

        monkeypatch.setattr(Path, "read_bytes", refuse)
    with pytest.raises(InputError, match="may not be read"):
        load_markers(path)


@pytest.mark.parametrize("suffix", WRITERS)
def test_never_a_position(tmp_path: Path, recording: Callable[..., Markers], suffix: str) -> None:
    WRITERS[suffix](tmp_path / f"a{suffix}", recording(1, lost=1.1))
    markers = load_markers(tmp_path / f"a{suffix}")
    assert markers.positions.shape == (12, 7, 3)
    assert not markers.present.any()
    assert any("Never seen" in note for note in markers.notes)


def write_everything(folder: Path, markers: Markers) -> None:
    for suffix, write in WRITERS.items():
        write(folder / f"a{suffix}", markers)
    rotations = np.broadcast_to(np.eye(3), (4, 2, 3, 3))
    write_mot(folder / "a.mot", np.arange(4) / 10, {"knee_angle_r": np.arange(4.0)})
    write_bvh(folder / "a.bvh", ["a", "b"], [-1, 0], np.ones((2, 3)), rotations, np.ones((4, 3)), 10)
    write_smpl_npz(folder / "a.npz", np.zeros((4, 72)), np.zeros((4, 3)), np.zeros(10), 10)


def test_nothing_is_left_where_nothing_can_be_written(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="cannot be written"):
        write_everything(tmp_path / "nowhere", recording(1))
    with pytest.raises(InputError, match="cannot be written"):
        write_everything(tmp_path / "file", recording(1))
    assert [p.name for p in tmp_path.iterdir()] == ["file"]


def test_a_disk_that_is_full(tmp_path: Path) -> None:
    """A limit on file size fails in the middle of a write just as a full disk does."""
    pytest.importorskip("resource", reason="this system sets no limits")
    code = """
        import resource, sys
        from pathlib import Path
        import numpy as np
        from markerscope.solver.core.errors import InputError
        from markerscope.solver.io.export_c3d import write_c3d
        from markerscope.solver.io.export_csv import write_markers_csv
        from markerscope.solver.io.export_smpl import write_smpl_npz
        from markerscope.solver.io.export_trc import write_trc
        from markerscope.solver.core.markers import Markers
        resource.setrlimit(resource.RLIMIT_FSIZE, (4000, 4000))
        markers = Markers(np.random.default_rng(0).normal(size=(300, 9, 3)), 100.0, tuple("abcdefghi"))
        out = Path(sys.argv[1])
        for work in (
            lambda: write_c3d(out / "a.c3d", markers),
            lambda: write_trc(out / "a.trc", markers),
            lambda: write_markers_csv(out / "a.csv", markers),
            lambda: write_smpl_npz(out / "a.npz", markers.positions, np.zeros(3), np.zeros(10), 100),
        ):
            try:
                work()
            except InputError as error:
                assert "cannot be written" in str(error) and "larger" in str(error), error
            else:
                raise SystemExit("written in spite of the limit")
    """
    root = Path(__file__).parents[2]
    done = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code), str(tmp_path)], cwd=root, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert list(tmp_path.iterdir()) == []


@pytest.fixture(scope="module")
def whole_motion(recording: Callable[..., Markers], tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a small valid file of every format of motion."""
    folder = tmp_path_factory.mktemp("motion")
    write_everything(folder, recording(1))
    (folder / "a.asf").write_text(
        ":units\n length 0.45\n angle deg\n:root\n order TX TY TZ RX RY RZ\n axis XYZ\n position 0 0 0\n"
        " orientation 0 0 0\n:bonedata\n begin\n id 1\n name leg\n direction 0 -1 0\n length 5\n axis 0 0 20 XYZ\n"
        " dof rx ry rz\n end\n:hierarchy\n begin\n root leg\n end\n"
    )
    (folder / "a.amc").write_text(":FULLY-SPECIFIED\n:DEGREES\n1\nroot 1 2 3 4 5 6\nleg 7 8 9\n")
    return folder


@relaxed
@given(data=st.data())
def test_damaged_motion_files(tmp_path: Path, whole_motion: Path, data: st.DataObject) -> None:
    for good in ("a.asf", "a.amc"):
        (tmp_path / good).write_bytes((whole_motion / good).read_bytes())
    name = data.draw(st.sampled_from(["a.mot", "a.bvh", "a.asf", "a.amc"]))
    content = bytearray((whole_motion / name).read_bytes())
    if data.draw(st.booleans()):
        del content[data.draw(st.integers(0, len(content) - 1)) :]
    else:
        start = data.draw(st.integers(0, len(content) - 1))
        content[start : start + data.draw(st.integers(0, 5))] = data.draw(st.binary(max_size=6))
    (tmp_path / name).write_bytes(bytes(content))
    try:
        if name == "a.mot":
            read_mot(tmp_path / name)
        elif name == "a.bvh":
            read_bvh(tmp_path / name).end_positions()
        else:
            read_asf_amc(tmp_path / "a.asf", tmp_path / "a.amc").end_positions()
    except InputError as error:
        assert name in str(error)
