"""TRC: strict out, lenient in, and what OpenSim makes of it."""

from __future__ import annotations

import locale
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.filled_list import filled_list_path
from markerscope.solver.io.trc import read_trc

relaxed = settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def strictly(path: Path) -> tuple[dict[str, str], list[str], np.ndarray, np.ndarray]:
    """Header, names, times (T,) and positions (T, M, 3) by the letter of the format."""
    lines = path.read_bytes().decode().split("\n")
    assert lines[0].startswith("PathFileType\t4\t(X/Y/Z)\t")
    assert len(lines[1].split("\t")) == len(lines[2].split("\t")) == 8
    header = dict(zip(lines[1].split("\t"), lines[2].split("\t")))
    count = int(header["NumMarkers"])
    names = lines[3].split("\t")
    assert names[:2] == ["Frame#", "Time"] and len(names) == 2 + 3 * count
    assert lines[4] == "\t\t" + "\t".join(f"X{i}\tY{i}\tZ{i}" for i in range(1, count + 1))
    assert lines[5] == "" and lines[-1] == ""
    rows = [line.split("\t") for line in lines[6:-1]]
    assert len(rows) == int(header["NumFrames"])
    assert all(len(row) == 2 + 3 * count + (row[-2:] == ["", ""]) for row in rows)
    table = np.array([[float(cell or "nan") for cell in row[: 2 + 3 * count]] for row in rows])
    return header, names[2::3], table[:, 1], table[:, 2:].reshape(len(rows), count, 3)


@relaxed
@given(seed=st.integers(0, 2**32), count=st.integers(1, 300), first=st.integers(0, 5000), mm=st.booleans())
def test_round_trip_and_by_the_letter(
    tmp_path: Path, recording: Callable[..., Markers], seed: int, count: int, first: int, mm: bool
) -> None:
    out = recording(seed, frames=6, count=count, first=first, rate=[100.0, 59.94, 240.0][seed % 3])
    path = tmp_path / "a.trc"
    write_trc(path, out, units="mm" if mm else "m")
    back = load_markers(path, up="y")
    assert back.labels == out.labels
    assert back.rate == out.rate
    assert back.first_time == pytest.approx(out.first_time, abs=1e-6)
    np.testing.assert_array_equal(back.present, out.present)
    np.testing.assert_array_equal(np.zeros_like(out.filled) if back.filled is None else back.filled, out.filled)
    error = np.nanmax(np.abs(back.positions - out.positions), initial=0)
    assert error < 1.1e-7, f"{error} m"
    header, names, time, positions = strictly(path)
    assert tuple(names) == out.labels
    assert header["Units"] == ("mm" if mm else "m")
    np.testing.assert_allclose(time, out.time, atol=1e-6)
    x, y, z = np.moveaxis(out.positions, 2, 0)
    np.testing.assert_allclose(positions / (1000 if mm else 1), np.stack([x, z, -y], axis=2), atol=1e-6)


@pytest.mark.parametrize("units", ["m", "mm"])
def test_opensim_reads_the_same(tmp_path: Path, recording: Callable[..., Markers], units: str) -> None:
    opensim = pytest.importorskip("opensim", reason="the package opensim is not installed")
    out = recording(5, frames=40, count=12, first=30, lost=0.4)
    write_trc(tmp_path / "a.trc", out, units=units)
    table = opensim.TimeSeriesTableVec3(str(tmp_path / "a.trc"))
    assert tuple(table.getColumnLabels()) == out.labels
    np.testing.assert_allclose(table.getIndependentColumn(), out.time)
    assert table.getTableMetaDataString("Units") == units
    values = np.array([[[table.getRowAtIndex(t)[m][k] for k in range(3)] for m in range(12)] for t in range(40)])
    x, y, z = np.moveaxis(out.positions, 2, 0)
    np.testing.assert_allclose(values / (1000 if units == "mm" else 1), np.stack([x, z, -y], axis=2), atol=1e-6)


@relaxed
@given(labels=st.lists(st.text(max_size=60), min_size=1, max_size=12))
def test_names_with_odd_characters(tmp_path: Path, recording: Callable[..., Markers], labels: list[str]) -> None:
    labels = [label.replace(":", "") for label in labels]
    write_trc(tmp_path / "a.trc", recording(1, count=len(labels), labels=labels, filled=0))
    names = strictly(tmp_path / "a.trc")[1]
    assert len(set(names)) == len(labels)
    assert read_trc(tmp_path / "a.trc").labels == tuple(names)


def test_an_old_list_of_filled_spans_does_not_stay(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    write_trc(tmp_path / "a.trc", recording(1))
    assert filled_list_path(tmp_path / "a.trc").name == "a.filled.csv"
    assert filled_list_path(tmp_path / "a.trc").is_file()
    write_trc(tmp_path / "a.trc", recording(1, filled=0))
    assert [p.name for p in tmp_path.iterdir()] == ["a.trc"]


def test_a_list_of_filled_spans_that_does_not_fit_is_left_aside(
    tmp_path: Path, recording: Callable[..., Markers]
) -> None:
    write_trc(tmp_path / "a.trc", recording(1))
    for text in ("marker,first_row,last_row\n99,1,2\n", "what\n", "\0\1", "marker,first_row,last_row\n1,1\n"):
        filled_list_path(tmp_path / "a.trc").write_text(text)
        markers = load_markers(tmp_path / "a.trc")
        assert markers.filled is None
        assert any("a.filled.csv" in note for note in markers.notes)


BASE = [
    "PathFileType\t4\t(X/Y/Z)\tsome.trc",
    "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
    "50\t50\t4\t3\tmm\t50\t1\t4",
    "Frame#\tTime\tKnee\t\t\tAnkle\t\t\tToe\t\t",
    "\t\tX1\tY1\tZ1\tX2\tY2\tZ2\tX3\tY3\tZ3",
    "",
    "1\t0.5\t100\t900\t30\t110\t500\t40\t120\t100\t50",
    "2\t0.52\t101\t901\t31\t\t\t\t121\t101\t51",
    "3\t0.54\t102\t902\t32\t112\t502\t42\t122\t102\t52",
    "4\t0.56\t103\t903\t33\t113\t503\t43\t\t\t",
]
EXPECTED = np.array([
    [[100, 900, 30], [110, 500, 40], [120, 100, 50]],
    [[101, 901, 31], [np.nan] * 3, [121, 101, 51]],
    [[102, 902, 32], [112, 502, 42], [122, 102, 52]],
    [[103, 903, 33], [113, 503, 43], [np.nan] * 3],
])  # fmt: skip


def swap(index: int, text: str) -> list[str]:
    return [text if i == index else line for i, line in enumerate(BASE)]


MESSY: dict[str, bytes] = {
    "as it should be": "\n".join([*BASE, ""]).encode(),
    "no end of the last line": "\n".join(BASE).encode(),
    "CRLF": "\r\n".join([*BASE, ""]).encode(),
    "CR": "\r".join([*BASE, ""]).encode(),
    "byte order mark": b"\xef\xbb\xbf" + "\n".join([*BASE, ""]).encode(),
    "UTF-16": "\n".join([*BASE, ""]).encode("utf-16"),
    "trailing tabs": "\n".join([line + "\t\t\t" for line in BASE] + [""]).encode(),
    "trailing blanks": "\n".join([line + "  " for line in BASE] + [""]).encode(),
    "tabs cut off": "\n".join([line.rstrip("\t") for line in BASE] + [""]).encode(),
    "commas": "\n".join([*BASE, ""]).replace("\t", ",").encode(),
    "semicolons": "\n".join([*BASE, ""]).replace("\t", ";").encode(),
    "decimal commas": "\n".join([*BASE, ""]).replace("0.5", "0,5").encode(),
    "blanks in the first line": "\n".join([*swap(0, "PathFileType  4\t(X/Y/Z) C:\\a b\\c.trc"), ""]).encode(),
    "no blank line 6": "\n".join([*BASE[:5], *BASE[6:], ""]).encode(),
    "more blank lines": "\n".join([*BASE[:3], "", *BASE[3:6], "", "", *BASE[6:8], "", *BASE[8:], "", "", ""]).encode(),
    "tabs in the blank line": "\n".join([*swap(5, "\t\t\t"), ""]).encode(),
    "lost as nan": "\n".join([*swap(7, "2\t0.52\t101\t901\t31\tnan\tNaN\tNAN\t121\t101\t51"), ""]).encode(),
    "lost as zeros": "\n".join([*swap(7, "2\t0.52\t101\t901\t31\t0\t0.000\t0\t121\t101\t51"), ""]).encode(),
    "lost as sentinel": "\n".join([*swap(7, BASE[7].replace("\t\t\t", "\t9999999\t9999999\t9999999")), ""]).encode(),
    "half a position": "\n".join([*swap(7, BASE[7].replace("\t\t\t\t", "\t5\t\t\t")), ""]).encode(),
    "names without blanks": "\n".join([*swap(3, "Frame#\tTime\tKnee\tAnkle\tToe"), ""]).encode(),
    "no axis line": "\n".join([*BASE[:4], *BASE[5:], ""]).encode(),
    "more frames promised": "\n".join([*swap(2, "50\t50\t9\t3\tmm\t50\t1\t9"), ""]).encode(),
    "other markers promised": "\n".join([*swap(2, "50\t50\t4\t7\tmm\t50\t1\t4"), ""]).encode(),
    "header with commas": "\n".join([*swap(2, "50,50,4,3,mm,50,1,4"), ""]).encode(),
    "wrong rate": "\n".join([*swap(2, "100\t100\t4\t3\tmm\t50\t1\t4"), ""]).encode(),
    "no rate": "\n".join([*swap(2, "\t\t4\t3\tmm\t\t1\t4"), ""]).encode(),
}


@pytest.mark.parametrize("kind", MESSY)
def test_real_files_break_the_rules(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "a.trc"
    path.write_bytes(MESSY[kind])
    markers = load_markers(path, up="y", units="mm")
    assert markers.labels == ("Knee", "Ankle", "Toe")
    assert markers.rate == 50
    assert markers.first_time == 0.5
    np.testing.assert_allclose(markers.positions @ markers.R_lab_internal.T * 1000, EXPECTED)
    if "promised" in kind or "wrong" in kind:
        assert markers.notes, "a contradiction must be said"


def test_contradictions_are_said(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    path.write_bytes(MESSY["more frames promised"])
    assert "The header promises 9 frames; the file holds 4." in load_markers(path).notes
    path.write_bytes(MESSY["other markers promised"])
    assert "The header promises 7 markers; the file holds 3." in load_markers(path).notes
    path.write_bytes(MESSY["wrong rate"])
    assert any("100 Hz" in note and "50 Hz" in note for note in load_markers(path).notes)


def test_repeated_and_missing_names(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    path.write_text("\n".join([*swap(3, "Frame#\tTime\tKnee\t\t\tKnee\t\t\t\t\t"), ""]))
    assert load_markers(path).labels == ("Knee", "Knee_2", "unnamed")


def test_rows_left_out_of_the_middle_count_as_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    path.write_text("\n".join([*BASE[:7], *BASE[8:], ""]))
    markers = load_markers(path, up="y", units="mm")
    assert markers.positions.shape == (4, 3, 3)
    assert not markers.present[1].any()
    assert any("no row" in note for note in markers.notes)


def test_blanks_between_values_cannot_tell_which_one_is_lost(tmp_path: Path) -> None:
    path = tmp_path / "a.trc"
    path.write_text("\n".join([*BASE, ""]).replace("\t", " "))
    with pytest.raises(InputError, match="line 8 has 8 values"):
        load_markers(path)


def test_the_locale_does_not_matter(tmp_path: Path, recording: Callable[..., Markers]) -> None:
    before = locale.setlocale(locale.LC_ALL)
    for name in ("de_DE.UTF-8", "fr_FR.UTF-8", "de_DE", "German_Germany"):
        try:
            locale.setlocale(locale.LC_ALL, name)
            break
        except locale.Error:
            continue
    else:
        pytest.skip("this machine has no locale with decimal commas")
    try:
        out = recording(6)
        write_trc(tmp_path / "a.trc", out)
        np.testing.assert_allclose(load_markers(tmp_path / "a.trc", up="y").positions, out.positions, atol=1e-6)
    finally:
        locale.setlocale(locale.LC_ALL, before)
