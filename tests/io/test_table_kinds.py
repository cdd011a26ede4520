"""Tables as other programs and people write them: one condition each, over random recordings."""

from __future__ import annotations

import io
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from markerscope.solver.core.errors import InputError
from markerscope.solver.io import list_subjects, load_markers

relaxed = settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
NAMES = ["HEAD", "C7", "LSHO", "RSHO", "LKNE", "RTOE"]


def places(frames: int, seed: int) -> np.ndarray:
    """(T, 6, 3) mm to two decimals, one marker lost for a while and another in the first rows; NaN = lost."""
    rng = np.random.default_rng(seed)
    rest = rng.uniform([100, 100, 50], [900, 400, 1700], (6, 3))
    time = np.arange(frames)[:, None, None] / 100
    xyz = np.round(rest + 40 * np.sin(2 * np.pi * (0.5 * time + rng.random((6, 3)))), 2)
    xyz[10:14, 2] = np.nan
    xyz[: seed % 5, 4] = np.nan
    return xyz


def cells(xyz: np.ndarray, lost: str = "", write: Callable[[float], str] = "{:.2f}".format) -> list[list[str]]:
    return [[write(v) if v == v else lost for v in row] for row in xyz.reshape(len(xyz), -1).tolist()]


def flat(names: Sequence[str] = NAMES, form: str = "{}_{}") -> list[str]:
    return [form.format(name, axis) for name in names for axis in "xyz"]


def above(names: Sequence[str], every: bool = False) -> list[str]:
    return [cell for name in names for cell in ([name] * 3 if every else [name, "", ""])]


def table(lines: Sequence[Sequence[str]], separator: str = ",") -> str:
    return "\n".join(separator.join(line) for line in lines) + "\n"


def timed(rows: Sequence[Sequence[str]], *lead: Callable[[int], str]) -> list[list[str]]:
    return [[*(one(t) for one in (*lead, lambda t: f"{t / 100:.2f}")), *row] for t, row in enumerate(rows)]


def german(value: float) -> str:
    return f"{value:,.2f}".replace(",", "_").replace(".", ",").replace("_", ".")


def french(value: float) -> str:
    return f"{value:,.2f}".replace(",", "\u202f").replace(".", ",")


def german_rows(x: np.ndarray) -> list[list[str]]:
    return [[f"{t / 100:.2f}".replace(".", ","), *row] for t, row in enumerate(cells(x, "", german))]


def swiss(value: float) -> str:
    return f"{value:,.2f}".replace(",", "'")


def r_table(x: np.ndarray) -> str:
    rows = [[f'"{i}"', *row] for i, row in enumerate(timed(cells(x, "NA")), 1)]
    return table([[f'"{name}"' for name in ["time", *flat()]], *rows])


def savetxt(x: np.ndarray) -> str:
    text = io.StringIO()
    rows = np.column_stack([np.arange(len(x)) / 100, x.reshape(len(x), -1)])
    np.savetxt(text, rows, fmt="%.4f", delimiter=",", header=",".join(["time", *flat()]))
    return text.getvalue()


def with_blank_line(x: np.ndarray) -> str:
    rows = [[str(t + 1), "0", *row] for t, row in enumerate(cells(x))]
    head = [["Trajectories"], ["100"], ["", "", *above([f"S:{n}" for n in NAMES])],
            ["Frame", "Sub Frame", *["X", "Y", "Z"] * 6], ["", "", *["mm"] * 18]]  # fmt: skip
    return table([*head, *rows[:15], [], *rows[15:], [], ["Model Outputs"], ["100"], ["Frame", "a"], ["1", "2"]])


def visual3d(x: np.ndarray) -> str:
    head = [["", *[f"c:\\data\\t{1}.c3d"] * 18], ["", *above(NAMES, True)], ["", *["TARGET"] * 18],
            ["", *["PROCESSED"] * 18], ["ITEM", *["X", "Y", "Z"] * 6]]  # fmt: skip
    return table([*head, *[[str(t + 1), *row] for t, row in enumerate(cells(x))]], "\t")


KINDS: dict[str, Callable[[np.ndarray], str]] = {
    "a sharp as first title": lambda x: table([["#", "time", *flat()], *timed(cells(x), lambda t: str(t + 1))]),
    "titles in a remark": savetxt,
    "titles in a Matlab remark": lambda x: savetxt(x).replace("# ", "% ", 1),
    "names of rows": r_table,
    "names of rows that are words": lambda x: r_table(x).replace('\n"', '\n"row'),
    "a column of words": lambda x: table([["trial", "time", *flat()], *timed(cells(x), lambda t: "walk 1")]),
    "a column of truth": lambda x: table(
        [["time", *flat(), "valid"], *[[*row, str(t % 7 != 0)] for t, row in enumerate(timed(cells(x)))]]
    ),
    "a clock": lambda x: table(
        [["time", *flat()], *[[f"12:59:59.{t:02d}", *row] for t, row in enumerate(cells(x))]]
    ),
    "dates": lambda x: table(
        [["timestamp", *flat()], *[[f"2024-05-01T12:00:00.{t:02d}", *row] for t, row in enumerate(cells(x))]]
    ),
    "German thousands": lambda x: table(
        [["time", *flat()], *german_rows(x)], "\t"
    ),
    "German thousands and semicolons": lambda x: table(
        [["time", *flat()], *german_rows(x)], ";"
    ),
    "English thousands": lambda x: table([["time", *flat()], *timed(cells(x, "", "{:,.2f}".format))], "\t"),
    "French thousands": lambda x: table([["time", *flat()], *timed(cells(x, "", french))], ";"),
    "Swiss thousands": lambda x: table([["time", *flat()], *timed(cells(x, "", swiss))]),
    "a row of units between": lambda x: table(
        [["", *above(NAMES)], ["", *["mm"] * 18], ["time", *["x", "y", "z"] * 6], *timed(cells(x))]
    ),
    "a row of units below": lambda x: table([["time", *flat()], ["s", *["mm"] * 18], *timed(cells(x))]),
    "a row of subjects above": lambda x: table(
        [["", *above(["S1"] * 6, True)], ["", *above(NAMES)], ["time", *["x", "y", "z"] * 6], *timed(cells(x))]
    ),
    "a row of subjects between": lambda x: table(
        [["", *above(NAMES, True)], ["", *above(["S1"] * 6, True)], ["time", *["x", "y", "z"] * 6], *timed(cells(x))]
    ),
    "Visual3D": visual3d,
    "a blank line inside": with_blank_line,
    "blanks between all lines": lambda x: table([["time", *flat()], *timed(cells(x))]).replace("\n", "\n\n"),
    "axes first": lambda x: table([["time", *[f"{a}_{n}" for n in NAMES for a in "XYZ"]], *timed(cells(x))]),
    "D-Flow": lambda x: table(
        [["TimeStamp", "FrameNumber", *[f"{n}.Pos{a}" for n in NAMES for a in "XYZ"]],
         *[[row[0], str(5000 + t), *row[1:]] for t, row in enumerate(timed(cells(x)))]], "\t"
    ),
    "D-Flow with turns": lambda x: table(
        [["TimeStamp", *[f"{n}.{k}{a}" for n in NAMES for k in ("Pos", "Rot") for a in "XYZ"]],
         *[[row[0], *[c for i in range(6) for c in (*row[3 * i + 1 : 3 * i + 4], "1.5", "2.5", "3.5")]]
           for row in timed(cells(x))]], "\t"
    ),
    "blanks and decimal commas": lambda x: table(
        [["time", *flat()], *[[c.replace(".", ",") for c in row] for row in timed(cells(x, "NaN"))]], " "
    ),
    "a footer": lambda x: table([["time", *flat()], *timed(cells(x)), [], ["written by somebody"]]),
    "long": lambda x: table(
        [["time", "marker", "x", "y", "z"],
         *[[row[0], n, *row[3 * i + 1 : 3 * i + 4]] for row in timed(cells(x)) for i, n in enumerate(NAMES)]]
    ),
    "long, marker by marker": lambda x: table(
        [["frame", "time", "name", "X", "Y", "Z"],
         *[[str(t), row[0], n, *row[3 * i + 1 : 3 * i + 4]]
           for i, n in enumerate(NAMES) for t, row in enumerate(timed(cells(x)))]]
    ),
    "milliseconds": lambda x: table([["time", *flat()], *[[str(10 * t), *row] for t, row in enumerate(cells(x))]]),
}  # fmt: skip
for _lost in ("#N/A", "-1.#IND", "1.#QNAN00", "-nan(ind)", "nan(ind)", "<NA>", "NULL", "NaN", "n/a", "---", "-1,#IND"):
    KINDS[f"lost as {_lost}"] = lambda x, lost=_lost: table([["time", *flat()], *timed(cells(x, lost))], "\t")


@pytest.mark.parametrize("kind", KINDS)
@relaxed
@given(seed=st.integers(0, 9999), frames=st.integers(20, 60))
def test_every_kind(tmp_path: Path, kind: str, seed: int, frames: int) -> None:
    xyz = places(frames, seed)
    (tmp_path / "a.csv").write_text(KINDS[kind](xyz), encoding="utf-8")
    markers = load_markers(tmp_path / "a.csv", units="mm", up="z", rate=100 if kind == "Visual3D" else None)
    assert list(markers.labels) == NAMES
    assert markers.rate == pytest.approx(100)
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-6)


def test_left_out_columns_are_named(tmp_path: Path) -> None:
    for kind, title in (("a column of words", "trial"), ("a column of truth", "valid")):
        (tmp_path / "a.csv").write_text(KINDS[kind](places(20, 1)))
        assert any(f"left out: {title}" in note for note in load_markers(tmp_path / "a.csv").notes)


@relaxed
@given(seed=st.integers(0, 9999))
def test_names_that_come_again(tmp_path: Path, seed: int) -> None:
    xyz = places(20, seed)
    for titles in (
        flat(["A", "B", "A", "B", "A", "C"]),
        flat(["A", "B"]) + [f"{t}.1" for t in flat(["A", "B"])] + flat(["D", "C"]),
    ):
        (tmp_path / "a.csv").write_text(table([["time", *titles], *timed(cells(xyz))]))
        markers = load_markers(tmp_path / "a.csv", units="mm", up="z")
        assert len(set(markers.labels)) == 6
        np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-6)


@pytest.mark.parametrize("lead", ["individuals", "who", ""])
def test_several_individuals_are_a_choice(tmp_path: Path, lead: str) -> None:
    xyz = places(20, 3)
    people, parts = above(["p1"] * 3 + ["p2"] * 3, True), above(["HEAD", "C7", "LSHO"] * 2, True)
    head = [
        ["scorer", *["DLC"] * 18],
        [lead, *people],
        ["bodyparts" if lead else "", *parts],
        ["time", *["x", "y", "z"] * 6],
    ]
    (tmp_path / "a.csv").write_text(table([*head, *timed(cells(xyz))]))
    assert list_subjects(tmp_path / "a.csv") == ("p1", "p2")
    markers = load_markers(tmp_path / "a.csv", subject="p2", units="mm", up="z")
    assert markers.labels == ("HEAD", "C7", "LSHO")
    np.testing.assert_allclose(markers.positions * 1000, xyz[:, 3:], atol=1e-6)


@pytest.mark.parametrize("kind", ["Rigid Body Marker", "Marker", "both"])
def test_motive_rigid_bodies(tmp_path: Path, kind: str) -> None:
    xyz = places(20, 2)[:, :4]
    names = [f"RB{i // 2}:Marker{i % 2}" for i in range(4)]
    kinds = ["Rigid Body"] * 3 + [("Rigid Body Marker" if kind != "Marker" else "Marker")] * 12
    titles, data = ["RB0"] * 3 + above(names, True), np.concatenate([np.ones((20, 1, 3)), xyz], axis=1)
    if kind == "both":  # as the body puts them, and as they were seen
        kinds, titles = kinds + ["Marker"] * 12, titles + above(names, True)
        data = np.concatenate([data[:, :1], xyz + 5, xyz], axis=1)
    count = data.shape[1]
    head = [
        ["Format Version", "1.23", "Export Frame Rate", "100.0", "Length Units", "Millimeters"], [],
        ["", "Type", *kinds], ["", "Name", *titles], ["", "ID", *["1"] * 3 * count],
        ["", "", *["Position"] * 3 * count], ["Frame", "Time (Seconds)", *["X", "Y", "Z"] * count],
    ]  # fmt: skip
    rows = [[str(t), f"{t / 100:.2f}", *row] for t, row in enumerate(cells(data))]
    (tmp_path / "a.csv").write_text(table([*head, *rows]))
    markers = load_markers(tmp_path / "a.csv", up="z")
    assert len(markers.labels) == 4
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-6)


def test_a_word_among_the_coordinates_is_refused_with_its_line(tmp_path: Path) -> None:
    for line in (1, 2, 3, 12):
        rows = timed(cells(places(20, 0)))
        rows[line - 1][4] = "two"
        (tmp_path / "a.csv").write_text(table([["time", *flat()], *rows]))
        with pytest.raises(InputError, match=f"line {line + 1} holds 'two'"):
            load_markers(tmp_path / "a.csv")


def test_rows_in_which_all_is_lost_keep_their_place(tmp_path: Path) -> None:
    xyz = places(20, 0)
    xyz[7:9] = np.nan
    (tmp_path / "a.csv").write_text(table([flat(), *cells(xyz)]))
    markers = load_markers(tmp_path / "a.csv", units="mm", up="z", rate=100)
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-6)


@pytest.mark.parametrize("lost", ["", "#N/A", "NaN"])
def test_first_rows_in_which_all_is_lost_keep_their_place(tmp_path: Path, lost: str) -> None:
    xyz = places(20, 0)
    xyz[:5] = np.nan
    rows = [["walk", *row] for row in timed(cells(xyz, lost))]
    (tmp_path / "a.csv").write_text(table([["trial", "time", *flat()], *rows]))
    markers = load_markers(tmp_path / "a.csv", units="mm", up="z")
    assert markers.first_time == 0
    np.testing.assert_allclose(markers.positions * 1000, xyz, atol=1e-6)


def test_a_thousand_without_decimals_goes_by_the_other_cells(tmp_path: Path) -> None:
    xyz = places(20, 0)
    xyz[5] = np.round(xyz[5]) + 1000
    rows = timed(cells(xyz, "", lambda value: german(value).removesuffix(",00")))
    (tmp_path / "a.tsv").write_text(
        table([["time", *flat()], *[[row[0].replace(".", ","), *row[1:]] for row in rows]], "\t")
    )
    np.testing.assert_allclose(load_markers(tmp_path / "a.tsv", units="mm", up="z").positions * 1000, xyz, atol=1e-6)
