"""``markerscope clean``: the file, the list beside it, and every way to be refused."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.cli.main import main
from markerscope.solver.cleaning.request import CleanRequest, parse_numbers
from markerscope.solver.commands.clean import clean_file
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_c3d import write_c3d
from tests.cleaning.scenes import RATE, lose, rigid


@pytest.fixture
def trial(tmp_path: Path) -> Path:
    """Marker 1 has a gap, 3 an outlier, 6 was never seen; 4 and 5 are exchanged from row 151 on."""
    positions = lose(rigid(), (1, 30, 60), (6, 0, 239))
    positions[80, 3] += 0.05
    positions[150:, [4, 5]] = positions[150:, [5, 4]]
    path = tmp_path / "trial.c3d"
    write_c3d(path, Markers(positions, RATE, tuple("ABCDEFGH")))
    return path


@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_the_file_has_what_was_filled_flagged_and_what_was_not_lost(trial: Path, tmp_path: Path, suffix: str) -> None:
    before = load_markers(trial)
    outcome = clean_file(CleanRequest(trial, tmp_path / f"clean{suffix}"))
    after = load_markers(tmp_path / f"clean{suffix}")
    assert after.labels == before.labels
    filled = np.zeros(before.present.shape, dtype=bool)
    filled[30:61, 1] = filled[80, 3] = True
    assert np.array_equal(after.filled, filled)
    assert np.isnan(after.positions[:, 6]).all()
    same = before.present & ~filled
    assert np.abs(after.positions[same] - before.positions[same]).max() < 1e-6
    assert outcome.summary["samples_cut"] == 1
    assert outcome.summary["samples_filled"] == 32


def test_every_change_is_listed_in_words_and_in_the_file_beside_it(trial: Path, tmp_path: Path) -> None:
    outcome = clean_file(CleanRequest(trial, tmp_path / "clean.trc"))
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    before = load_markers(trial)
    (cut,) = listed["outliers"]
    assert (cut["marker"], cut["first_row"], cut["last_row"]) == ("D", 81, 81)
    assert cut["measured_m"] == [before.positions[80, 3].tolist()]
    fills = [(f["marker"], f["first_row"], f["last_row"], f["method"]) for f in listed["fills"]]
    assert fills == [("B", 31, 61, "regression"), ("D", 81, 81, "regression")]
    assert listed["never_seen"] == ["G"]
    (edit,) = listed["proposals"]
    assert (edit["kind"], edit["markers"], edit["first_row"]) == ("swap", ["E", "F"], 151)
    assert listed["input"]["file"] == "trial.c3d"
    assert listed["settings"]["fill"]["method"] == "regression"
    text = "\n".join(outcome.lines)
    for word in ("B       31-61", "D       81-81", "cut", "G is never seen", "Proposed edit 1: E and F look exchanged"):
        assert word in text, text
    assert outcome.summary["fills"] == listed["fills"]


def test_every_change_is_a_line_of_a_table(trial: Path, tmp_path: Path) -> None:
    clean_file(CleanRequest(trial, tmp_path / "clean.c3d"))
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    with (tmp_path / "clean.changes.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    kinds = [row["what"] for row in rows]
    assert kinds.count("cut") == len(listed["outliers"]) == 1
    assert kinds.count("filled") == len(listed["fills"]) == 2
    assert kinds.count("left") == len(listed["left"])
    fill = next(row for row in rows if row["what"] == "filled" and row["marker"] == "B")
    assert (fill["first_row"], fill["last_row"], fill["method"]) == ("31", "61", "regression")
    assert float(fill["confidence"]) == listed["fills"][0]["confidence"]
    assert float(fill["expected_error_m"]) == listed["fills"][0]["expected_error_m"]
    assert float(fill["first_s"]) == pytest.approx(30 / RATE, abs=1e-5)
    assert next(row for row in rows if row["what"] == "never seen")["marker"] == "G"
    edit = next(row for row in rows if row["what"] == "edit proposed")
    assert (edit["method"], edit["marker"], edit["other"], edit["first_row"]) == ("swap", "E", "F", "151")
    assert edit["sentence"] == listed["proposals"][0]["sentence"]
    assert len(rows) == sum(
        kinds.count(kind) for kind in ("cut", "filled", "left", "never seen", "edit proposed", "note")
    )
    clean_file(CleanRequest(trial, tmp_path / "clean.c3d", apply=(1,)))
    assert "edit made" in (tmp_path / "clean.changes.csv").read_text()


def test_a_proposed_edit_is_made_when_asked_for(trial: Path, tmp_path: Path) -> None:
    clean_file(CleanRequest(trial, tmp_path / "clean.csv", apply=(1,)))
    after = load_markers(tmp_path / "clean.csv")
    assert np.abs(after.positions[:, [4, 5]] - rigid()[:, [4, 5]]).max() < 1e-5
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    assert len(listed["edits_made"]) == 1
    assert not listed["proposals"]


def test_gaps_stay_where_they_shall(trial: Path, tmp_path: Path) -> None:
    for options in ({"fill": "none"}, {"max_gap": 0.01}):
        clean_file(CleanRequest(trial, tmp_path / "clean.csv", **options))
        after = load_markers(tmp_path / "clean.csv")
        assert np.isnan(after.positions[30:61, 1]).all()
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    assert ("B", 31, 61) in [(row["marker"], row["first_row"], row["last_row"]) for row in listed["left"]]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("{t} --out {d}/clean.xyz", "names no format"),
        ("{t} --out {t}", "would be overwritten"),
        ("{d}/no.c3d --out {d}/clean.c3d", "there is no such file"),
        ("{t} --out {d}/clean.c3d --max-gap -1", "--max-gap"),
        ("{t} --out {d}/clean.c3d --min-confidence 2", "--min-confidence"),
        ("{t} --out {d}/clean.c3d --apply x", "--apply"),
        ("{t} --out {d}/clean.c3d --apply 7", "there is no proposed edit 7, there are 1"),
        ("{t} --out {d}/clean.c3d --fill magic", "--fill"),
    ],
)
def test_what_cannot_be_done_is_one_sentence(words: str, says: str, trial: Path, tmp_path: Path, capsys) -> None:
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    line = words.format(t=trial, d=tmp_path).split()
    assert main(["clean", *line, "--quiet"]) == 2
    printed = capsys.readouterr()
    assert printed.out == ""
    assert len(printed.err.splitlines()) == 1
    assert says in printed.err
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_numbers_are_read() -> None:
    assert parse_numbers("1,3") == (1, 3)
    with pytest.raises(InputError):
        CleanRequest(Path("a.c3d"), Path("b.c3d"), apply=(0,))


@pytest.mark.parametrize("name", ["nick_freeform_001.c3d", "mcgill_HC040A14_raw_unlabeled.c3d"])
def test_the_hardest_real_recordings_come_through(shared_data: Path, tmp_path: Path, name: str) -> None:
    before = load_markers(shared_data / "fullbody" / name)
    clean_file(CleanRequest(shared_data / "fullbody" / name, tmp_path / "clean.c3d"))
    after = load_markers(tmp_path / "clean.c3d")
    listed = json.loads((tmp_path / "clean.changes.json").read_text())
    index = {label: m for m, label in enumerate(before.labels)}
    cut, filled, left = (np.zeros(before.present.shape, dtype=bool) for _ in range(3))
    for mask, key in ((cut, "outliers"), (filled, "fills"), (left, "left")):
        for row in listed[key]:
            mask[row["first_row"] - 1 : row["last_row"], index[row["marker"]]] = True
    never = ~before.present.any(axis=0)
    assert [before.labels[m] for m in np.flatnonzero(never)] == listed["never_seen"]
    assert np.array_equal(after.present, (before.present & ~cut) | filled), "a change that is not listed"
    assert np.array_equal(~after.present[:, ~never], left[:, ~never])
    same = before.present & ~cut
    assert np.abs(after.positions[same] - before.positions[same]).max() < 1e-6
    assert (~after.present).any(), "some of it nobody can know"
    spread = np.nanmax(before.positions, axis=(0, 1)) - np.nanmin(before.positions, axis=(0, 1))
    assert (np.nanmax(after.positions, axis=(0, 1)) - np.nanmin(after.positions, axis=(0, 1)) < 1.2 * spread).all()


def test_an_expected_error_that_is_not_known_is_null(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trial.c3d"
    write_c3d(path, Markers(lose(rigid(), (1, 3, 236)), RATE, tuple("ABCDEFGH")))
    words = ["clean", str(path), "--out", str(tmp_path / "clean.trc"), "--fill", "spline", "--json"]
    assert main([*words, "--min-confidence", "0"]) == 0
    printed = json.loads(capsys.readouterr().out.splitlines()[-1], parse_constant=pytest.fail)
    listed = json.loads((tmp_path / "clean.changes.json").read_text(), parse_constant=pytest.fail)
    assert listed["fills"] == printed["fills"] and len(listed["fills"]) == 1
    assert {path.name for path in tmp_path.iterdir()} == {
        "trial.c3d", "clean.trc", "clean.filled.csv", "clean.changes.json", "clean.changes.csv"
    }  # fmt: skip


@pytest.mark.parametrize("fails", ["csv_of", "json_text", "write_markers"])
@pytest.mark.parametrize("suffix", [".c3d", ".trc", ".csv"])
def test_all_files_or_none(
    trial: Path, tmp_path: Path, suffix: str, fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object) -> None:
        raise ValueError("Out of range float values are not JSON compliant: inf")

    out = tmp_path / "done" / f"clean{suffix}"
    clean_file(CleanRequest(trial, out))
    before = {path.name: path.read_bytes() for path in out.parent.iterdir()}
    monkeypatch.setattr(f"markerscope.solver.commands.clean.{fails}", fail)
    for folder in (out.parent, tmp_path / "new"):
        with pytest.raises(ValueError, match="inf"):
            clean_file(CleanRequest(trial, folder / out.name, fill="none"))
    assert {path.name: path.read_bytes() for path in out.parent.iterdir()} == before
    assert not (tmp_path / "new").exists()


def test_a_file_that_changes_while_it_is_read_is_refused(
    trial: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def replaced(path: Path, **how: object) -> Markers:
        markers = load_markers(path, **how)  # type: ignore[arg-type]
        path.write_bytes(path.read_bytes() + b"\0")
        return markers

    monkeypatch.setattr("markerscope.solver.io.load_markers", replaced)
    with pytest.raises(InputError, match="changed while it was read; "):
        clean_file(CleanRequest(trial, tmp_path / "clean.c3d"))
    assert {path.name for path in tmp_path.iterdir()} == {"trial.c3d"}


def test_an_old_list_of_filled_points_does_not_outlive_its_file(trial: Path, tmp_path: Path) -> None:
    clean_file(CleanRequest(trial, tmp_path / "clean.trc"))
    assert (tmp_path / "clean.filled.csv").is_file()
    clean_file(CleanRequest(trial, tmp_path / "clean.trc", fill="none", outliers="none"))
    assert not (tmp_path / "clean.filled.csv").exists()
