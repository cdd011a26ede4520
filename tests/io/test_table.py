"""CSV and TSV in every customary layout, and our own out and in."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import list_subjects, load_markers
from markerscope.solver.io.export_csv import write_markers_csv

relaxed = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])

# Two markers over three frames at 100 Hz, mm; the second is lost in the second frame.
KNEE = [(100.5, 200, 900), (101, 201, 901), (102, 202, 902)]
TOE = [(300, 310, 50), None, (302, 312, 52)]
EXPECTED = np.array([[KNEE[t], TOE[t] or [np.nan] * 3] for t in range(3)], dtype=float)


def cells(t: int) -> list[str]:
    return [f"{v:g}" for v in KNEE[t]] + [f"{v:g}" for v in TOE[t] or ()] + ([] if TOE[t] else [""] * 3)


def rows(separator: str, lead: Callable[[int], list[str]]) -> list[str]:
    return [separator.join([*lead(t), *cells(t)]) for t in range(3)]


def titled(titles: str, separator: str = ",", lead: Callable[[int], list[str]] = lambda t: [f"{t / 100:g}"]) -> str:
    return "\n".join([separator.join(titles.split("|")), *rows(separator, lead), ""])


NEXUS = "\n".join([
    "Devices", "1000", ",,Force,,", "Frame,Sub Frame,Fx,Fy,Fz", ",,N,N,N", "1,0,1,2,3", "1,1,4,5,6", "",
    "Trajectories", "100", ",,Anna:Knee,,,Anna:Toe,,", "Frame,Sub Frame,X,Y,Z,X,Y,Z", ",,mm,mm,mm,mm,mm,mm",
    *rows(",", lambda t: [str(t + 1), "0"]), "",
])  # fmt: skip
QUALISYS = "\n".join([
    "NO_OF_FRAMES\t3", "NO_OF_CAMERAS\t8", "NO_OF_MARKERS\t2", "FREQUENCY\t100", "NO_OF_ANALOG\t0",
    "ANALOG_FREQUENCY\t0", "DESCRIPTION\t--", "TIME_STAMP\t2020-01-01, 12:00:00\t1234.5", "DATA_INCLUDED\t3D",
    "MARKER_NAMES\tKnee\tToe",
])  # fmt: skip
MOTIVE = "\n".join([
    "Format Version,1.23,Take Name,T1,Capture Frame Rate,100.0,Export Frame Rate,100.0,Rotation Type,Quaternion,"
    "Total Frames in Take,3,Length Units,Millimeters,Coordinate Space,Global",
    "",
    ",Type,Marker,Marker,Marker,Bone,Bone,Bone,Bone,Bone,Bone,Bone,Marker,Marker,Marker",
    ",Name,Anna:Knee,Anna:Knee,Anna:Knee,Hip,Hip,Hip,Hip,Hip,Hip,Hip,Anna:Toe,Anna:Toe,Anna:Toe",
    ",ID,1,1,1,2,2,2,2,2,2,2,3,3,3",
    ",,Position,Position,Position,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,"
    "Position,Position,Position",
    "Frame,Time (Seconds),X,Y,Z,X,Y,Z,W,X,Y,Z,X,Y,Z",
    *(",".join([str(t), f"{t / 100:g}", *cells(t)[:3], *"0001789", *cells(t)[3:]]) for t in range(3)), "",
])  # fmt: skip

WITH_RATE = {
    "name_x": titled("time|Knee_x|Knee_y|Knee_z|Toe_x|Toe_y|Toe_z"),
    "name.X": titled("Time|Knee.X|Knee.Y|Knee.Z|Toe.X|Toe.Y|Toe.Z"),
    "name X": titled("t|Knee X|Knee Y|Knee Z|Toe X|Toe Y|Toe Z"),
    "nameX": titled("time (s)|KneeX|KneeY|KneeZ|ToeX|ToeY|ToeZ"),
    "name_1": titled("time|Knee_1|Knee_2|Knee_3|Toe_1|Toe_2|Toe_3"),
    "unit in the title": titled("time [s]|Knee_x (mm)|Knee_y (mm)|Knee_z (mm)|Toe_x (mm)|Toe_y (mm)|Toe_z (mm)"),
    "unit behind the axis": titled("time_s|Knee_x_mm|Knee_y_mm|Knee_z_mm|Toe_x_mm|Toe_y_mm|Toe_z_mm"),
    "time in ms": titled("time_ms|Knee_x|Knee_y|Knee_z|Toe_x|Toe_y|Toe_z", lead=lambda t: [str(10 * t)]),
    "semicolons and decimal commas": titled(
        "time;Knee_x;Knee_y;Knee_z;Toe_x;Toe_y;Toe_z".replace(";", "|"), ";"
    ).replace(".", ","),
    "tabs and decimal commas": titled("time|Knee_x|Knee_y|Knee_z|Toe_x|Toe_y|Toe_z", "\t").replace("0.", "0,"),
    "quoted": titled('"time"|"Knee_x"|"Knee_y"|"Knee_z"|"Toe_x"|"Toe_y"|"Toe_z"'),
    "names above axes": "\n".join([",Knee,,,Toe,,", "time,x,y,z,x,y,z", *rows(",", lambda t: [f"{t / 100:g}"]), ""]),
    "names above every axis": "\n".join(
        [
            "bodyparts,Knee,Knee,Knee,Toe,Toe,Toe",
            "time,x,y,z,x,y,z",
            *rows(",", lambda t: [f"{t / 100:g}"]),
            "",
        ]
    ),
    "frame and time": titled(
        "Frame|Time|Knee_x|Knee_y|Knee_z|Toe_x|Toe_y|Toe_z", lead=lambda t: [str(t + 1), f"{t / 100:g}"]
    ),
    "Nexus": NEXUS,
    "Qualisys, bare": "\n".join([QUALISYS, *rows("\t", lambda t: []), ""]),
    "Qualisys, zeros for lost": "\n".join([QUALISYS, *rows("\t", lambda t: []), ""]).replace("\t\t\t", "\t0\t0\t0"),
    "Qualisys, frame and time": "\n".join(
        [
            QUALISYS,
            "Frame\tTime\tKnee X\tKnee Y\tKnee Z\tToe X\tToe Y\tToe Z",
            *rows("\t", lambda t: [str(t + 1), f"{t / 100:.5f}"]),
            "",
        ]
    ),
    "Motive": MOTIVE,
}


@pytest.mark.parametrize("ending", ["\n", "\r\n"])
@pytest.mark.parametrize("kind", WITH_RATE)
def test_layouts(tmp_path: Path, kind: str, ending: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(WITH_RATE[kind].replace("\n", ending).encode("utf-8-sig"))
    markers = load_markers(path, up="z", units="mm")
    assert markers.labels == ("Knee", "Toe")
    assert markers.rate == pytest.approx(100)
    assert markers.first_time == 0
    np.testing.assert_allclose(markers.positions * 1000, EXPECTED)
    assert list_subjects(path) == (("Anna",) if kind in ("Nexus", "Motive") else ())


def test_declared_units_are_used(tmp_path: Path) -> None:
    for kind in ("Nexus", "Motive", "unit in the title", "unit behind the axis"):
        (tmp_path / "a.csv").write_text(WITH_RATE[kind])
        np.testing.assert_allclose(load_markers(tmp_path / "a.csv", up="z").positions * 1000, EXPECTED, err_msg=kind)


@pytest.mark.parametrize("title", ["frame", "Frame#", ""])
def test_without_time_the_rate_must_be_given(tmp_path: Path, title: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(titled(f"{title}|Knee_x|Knee_y|Knee_z|Toe_x|Toe_y|Toe_z", lead=lambda t: [str(t + 11)]))
    with pytest.raises(InputError, match="give the rate"):
        load_markers(path)
    markers = load_markers(path, rate=50, units="mm", up="z")
    np.testing.assert_allclose(markers.positions * 1000, EXPECTED)
    assert markers.rate == 50
    assert markers.first_time == (0.2 if title else 0)


def test_other_columns_are_left_out_and_named(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(titled("time|Knee_x|Knee_y|Knee_z|force|emg|note", lead=lambda t: [f"{t / 100:g}"]))
    markers = load_markers(path, up="z", units="mm")
    assert markers.labels == ("Knee",)
    assert any("force, emg, note" in note for note in markers.notes)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time,a,b,c\n0,1,2,3\n1,2,3,4\n", "no header that names markers"),
        ("0,1,2,3\n1,2,3,4\n", "no header that names markers"),
        ("time,K_x,K_y,K_z\n", "no rows of numbers"),
        ("time,K_x,K_y,K_z\n0,1,2,3\n0.1,1,two,3\n", "line 3 holds 'two'"),
        ("hello\n", "no rows of numbers"),
    ],
)
def test_refusals_say_where(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(InputError, match=words):
        load_markers(tmp_path / "a.csv")


@relaxed
@given(
    seed=st.integers(0, 2**32), count=st.integers(1, 300), up=st.sampled_from("xyz"), first=st.integers(0, 5000),
    units=st.sampled_from(["m", "mm"]),
)  # fmt: skip
def test_round_trip(
    tmp_path: Path, recording: Callable[..., Markers], seed: int, count: int, up: Any, first: int, units: Any
) -> None:
    out = recording(seed, frames=6, count=count, up=up, first=first, rate=[100.0, 59.94, 240.0][seed % 3])
    path = tmp_path / "a.csv"
    write_markers_csv(path, out, units=units)
    back = load_markers(path)
    assert back.labels == out.labels
    assert back.rate == out.rate
    assert back.first_time == pytest.approx(out.first_time, abs=1e-6)
    np.testing.assert_array_equal(back.R_lab_internal, out.R_lab_internal)
    np.testing.assert_array_equal(back.present, out.present)
    np.testing.assert_array_equal(np.zeros_like(out.filled) if back.filled is None else back.filled, out.filled)
    error = np.nanmax(np.abs(back.positions - out.positions), initial=0)
    assert error < 1.1e-7, f"{error} m"


def test_the_csv_module_reads_the_same(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    out = recording(3, up="y", lost=0.3)
    write_markers_csv(tmp_path / "a.csv", out, units="mm")
    with (tmp_path / "a.csv").open(newline="") as file:
        assert next(file).startswith("# units=mm; up=y; rate=100; frames=12")
        table = list(csv.DictReader(file))
    x, y, z = np.moveaxis(out.positions, 2, 0)
    for m, label in enumerate(out.labels):
        for axis, values in (("x", x), ("y", z), ("z", -y)):
            read = [float(row[f"{label}_{axis}"] or "nan") for row in table]
            np.testing.assert_allclose(read, values[:, m] * 1000, atol=1e-4)
        flags = [row.get(f"{label}_filled", "0") == "1" for row in table]
        assert flags == out.filled[:, m].tolist()


@relaxed
@given(labels=st.lists(st.text(max_size=60), min_size=1, max_size=12))
def test_names_with_odd_characters(tmp_path: Path, recording: Callable[..., Markers], labels: list[str]) -> None:
    write_markers_csv(tmp_path / "a.csv", recording(1, count=len(labels), labels=labels, lost=0))
    back = load_markers(tmp_path / "a.csv", subject=None)
    assert len(set(back.labels)) == len(back.labels)
    for label in labels:
        if label.isalnum() and labels.count(label) == 1 and label.isascii():
            assert label in back.labels
