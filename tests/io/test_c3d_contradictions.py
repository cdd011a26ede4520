"""C3D files whose header and parameters disagree: the size of the file says who is right, and it is said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.io import load_markers
from tests.io.c3d_bytes import c3d_bytes

relaxed = settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def walk(frames: int, count: int, seed: int = 0) -> np.ndarray:
    """(T, M, 3) mm of points that sway smoothly about a body's places, on a grid of 0.1 mm."""
    rng = np.random.default_rng(seed)
    rest = rng.uniform([-300, -200, 50], [300, 200, 1700], (count, 3))
    time = np.arange(frames)[:, None, None] / 100
    swing = rng.uniform(20, 60, (count, 3)) * np.sin(2 * np.pi * (0.4 * time + rng.random((count, 3))))
    return np.round(rest + swing, 1)


def read(path: Path, data: bytes) -> Any:
    path.write_bytes(data)
    return load_markers(path)


def by_ezc3d(path: Path) -> np.ndarray:
    """(T, M, 3) mm, NaN where invalid."""
    whole = pytest.importorskip("ezc3d").c3d(str(path))
    return whole["data"]["points"][:3].transpose(2, 1, 0)


# What the header or the group POINT says instead of what is right; every one leaves enough to read the points.
LIES = {
    "count in the header": lambda n, a, k: ({"count": max(1, n - k)}, {}),
    "more in the header": lambda n, a, k: ({"count": n + k}, {}),
    "count in the parameters": lambda n, a, k: ({}, {"USED": np.array(n + k)}),
    "analog words in the header": lambda n, a, k: ({"analog": a + k}, {}),
    "sign of the header's scale": lambda n, a, k: ({"scale": "-"}, {}),
    "sign of the parameter's scale": lambda n, a, k: ({}, {"SCALE": "-"}),
    "first block in the header": lambda n, a, k: ({"block": 2 + k}, {}),
    "first block in the parameters": lambda n, a, k: ({}, {"DATA_START": np.array(60 + k)}),
    "last frame in the header": lambda n, a, k: ({"last": 7 + k}, {}),
    "frames in the parameters": lambda n, a, k: ({}, {"FRAMES": np.array(9 + k)}),
    "no count in the parameters": lambda n, a, k: ({}, {"USED": None, "DATA_START": None, "FRAMES": None}),
}
QUIET = ("no count in the parameters",)


@pytest.mark.parametrize("lie", LIES)
@relaxed
@given(
    seed=st.integers(0, 9999), count=st.integers(2, 12), frames=st.integers(40, 90), k=st.integers(1, 3),
    channels=st.integers(0, 5), samples=st.integers(1, 10), scale=st.sampled_from([-0.1, -1.0, 0.1]),
    first=st.integers(1, 300), more=st.integers(0, 2),
)  # fmt: skip
def test_one_fact_contradicted(
    tmp_path: Path, lie: str, seed: int, count: int, frames: int, k: int, channels: int, samples: int, scale: float,
    first: int, more: int,
) -> None:  # fmt: skip
    xyz = walk(frames, count, seed)
    rng = np.random.default_rng(seed)
    analog = rng.integers(-500, 500, (frames, samples, channels)) if channels else None
    header, point = LIES[lie](count, samples * channels, k)
    header = {key: -scale if value == "-" else value for key, value in header.items()}
    point = {key: np.array(-scale) if isinstance(value, str) else value for key, value in point.items()}
    if "last" in header:
        header["last"] += first
    data = c3d_bytes(
        xyz, analog=analog, scale=scale, first=first, header=header, point=point, more_blocks=more,
    )  # fmt: skip
    true = c3d_bytes(xyz, analog=analog, scale=scale, first=first, more_blocks=more)
    assume(data != true)
    markers = read(tmp_path / "a.c3d", data)
    assert markers.positions.shape == xyz.shape
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)
    assert markers.rate == 100
    if lie not in QUIET:
        assert any("C3D header" in note for note in markers.notes), "a contradiction must be said"


@relaxed
@given(
    seed=st.integers(0, 9999), count=st.integers(1, 12), frames=st.integers(2, 60), channels=st.integers(0, 4),
    scale=st.sampled_from([-0.1, 0.1]),
)  # fmt: skip
def test_nothing_is_said_of_a_file_that_agrees(
    tmp_path: Path, seed: int, count: int, frames: int, channels: int, scale: float
) -> None:
    xyz = walk(frames, count, seed)
    analog = np.ones((frames, 4, channels)) if channels else None
    markers = read(tmp_path / "a.c3d", c3d_bytes(xyz, analog=analog, scale=scale))
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)
    np.testing.assert_allclose(by_ezc3d(tmp_path / "a.c3d"), xyz, atol=1e-3)
    assert not any("C3D header" in note for note in markers.notes), markers.notes


@pytest.mark.parametrize("count", [3, 9])
def test_scale_of_whole_numbers_is_the_parameters(tmp_path: Path, count: int) -> None:
    xyz = walk(40, count)
    markers = read(tmp_path / "a.c3d", c3d_bytes(xyz, scale=0.1, header={"scale": 1.0}))
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)
    np.testing.assert_allclose(by_ezc3d(tmp_path / "a.c3d"), xyz, atol=1e-3)
    assert any("1 for the scale and the parameters 0.1" in note for note in markers.notes)


def test_of_two_readings_of_one_size_the_smooth_one_is_taken(tmp_path: Path) -> None:
    xyz = walk(40, 6)
    noise = np.random.default_rng(0).integers(-800, 800, (40, 1, 8))
    nothing = {"ANALOG": {"USED": np.array(0), "RATE": np.array(100.0)}}
    markers = read(tmp_path / "a.c3d", c3d_bytes(xyz, analog=noise, point={"USED": np.array(8)}, groups=nothing))
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)


@pytest.mark.parametrize(("header", "parameter"), [(9, 11), (2, 3), (5, 4)])
def test_where_nothing_fits_it_is_refused(tmp_path: Path, header: int, parameter: int) -> None:
    data = c3d_bytes(walk(40, 6), header={"count": header}, point={"USED": np.array(parameter)})
    with pytest.raises(InputError, match=r"disagree on the number of points, and neither fits"):
        read(tmp_path / "a.c3d", data)


def test_the_rate_is_the_parameters_unless_the_analog_rate_agrees_with_the_header(tmp_path: Path) -> None:
    xyz = walk(40, 4)
    told = read(tmp_path / "a.c3d", c3d_bytes(xyz, point={"RATE": np.array(50.0)}))
    assert told.rate == 50
    assert any("100 Hz" in note and "50 Hz" in note for note in told.notes)
    analog = np.zeros((40, 10, 2))
    told = read(tmp_path / "b.c3d", c3d_bytes(xyz, analog=analog, point={"RATE": np.array(99.0)}))
    assert told.rate == 100


TURNS = {"ROTATION": {"USED": np.array(1), "RATE": np.array(100.0), "LABELS": ["a_4X4"]}}


@pytest.mark.parametrize("frames", [65535, 65536, 65537, 65600, 131072, 131100])
@pytest.mark.parametrize("turning", [False, True])
def test_more_frames_than_sixteen_bits_count(tmp_path: Path, frames: int, turning: bool) -> None:
    time = np.arange(frames) / 100
    xyz = np.stack([100 * np.sin(time), 50 * np.cos(time), 1000 + 10 * np.sin(3 * time)], axis=1)[:, None]
    turn = np.append(np.eye(4).ravel(), 0.0).astype("<f4").tobytes() * frames if turning else b""
    for header, point in (
        ({"last": 65535}, {"FRAMES": np.array(65535)}),  # as far as it goes
        ({"last": frames % 65536}, {"FRAMES": np.array(frames % 65536)}),  # wrapped round
    ):
        if not point["FRAMES"]:
            continue
        data = c3d_bytes(xyz, header=header, point=point, groups=TURNS if turning else None, behind=turn)
        markers = read(tmp_path / "a.c3d", data)
        assert markers.positions.shape == xyz.shape, (header, markers.notes)
        np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)


def test_points_marked_invalid_that_hold_coordinates_are_refused_with_the_reason(tmp_path: Path) -> None:
    xyz = walk(20, 4)
    with pytest.raises(InputError, match="marks every point as invalid"):
        read(tmp_path / "a.c3d", c3d_bytes(xyz, word=np.full((20, 4), -1)))


def test_a_text_that_begins_like_a_c3d_is_text(tmp_path: Path) -> None:
    for lead in ("\t", "\n", "\r\n", "\f"):
        path = tmp_path / "a.tsv"
        rows = "".join(f"{t / 100}\t{t}\t2\t3\n" for t in range(5))
        path.write_bytes(f"{lead}Pelvis\t\t\ntime\tx\ty\tz\n{rows}".encode())
        assert len(load_markers(path, units="mm", up="z").positions) == 5


@pytest.mark.parametrize("damage", ["link of one", "link far away", "shape too large"])
def test_a_damaged_record_costs_no_points(tmp_path: Path, damage: str) -> None:
    xyz = walk(30, 5)
    data = bytearray(c3d_bytes(xyz, groups={"LAST": {"ONE": np.array(1.0), "TWO": ["abc"]}, "END": {"X": np.array(2)}}))
    at = data.index(b"ONE") + 3
    if damage == "link of one":
        data[at : at + 2] = b"\1\0"
    elif damage == "link far away":
        data[at : at + 2] = b"\xff\xff"
    else:
        data[at + 2 : at + 5] = b"\x04\x01\xff"
    markers = read(tmp_path / "a.c3d", bytes(data))
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-3)
    assert markers.labels == ("M0", "M1", "M2", "M3", "M4")
    assert any("damaged" in note and "ONE" in note for note in markers.notes)
