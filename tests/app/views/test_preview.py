"""The import preview shows what would be read, and what it goes by."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.app.views.preview import preview_of
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.io import load_markers
from markerscope.solver.io.export_trc import write_trc
from markerscope.solver.io.markers_in import read_raw
from markerscope.solver.io.raw import RawMarkers


@pytest.fixture
def standing() -> np.ndarray:
    """(50, 6, 3) m, z up: six markers from the floor to 1.7 m, one of them lost at first."""
    heights = np.linspace(0.05, 1.7, 6)
    positions = np.zeros((50, 6, 3))
    positions[..., 2] = heights
    positions[..., 0] = 0.2 * np.sin(np.arange(50)[:, None] / 9 + heights)
    positions[..., 1] = 0.5 + 0.1 * np.cos(heights)
    positions[:20, 2] = np.nan
    return positions


def raw_of(positions: np.ndarray, **fields: object) -> RawMarkers:
    labels = tuple(f"m{i}" for i in range(positions.shape[1]))
    return replace(RawMarkers(positions, labels, 50.0), **fields)  # type: ignore[arg-type]


def test_it_shows_what_would_be_read(standing: np.ndarray, tmp_path: Path) -> None:
    path = tmp_path / "walk.trc"
    write_trc(path, Markers(standing, 50.0, tuple("abcdef")))
    raw = read_raw(path)
    for options in ({}, {"up": "z"}, {"units": "mm", "up": "y"}, {"rate": 120.0}):
        wanted = load_markers(path, **options)  # type: ignore[arg-type]
        shown = preview_of(raw, path, **options)  # type: ignore[arg-type]
        assert np.array_equal(shown.markers.positions, wanted.positions, equal_nan=True)
        assert (shown.rate, shown.notes) == (wanted.rate, wanted.notes)
        assert np.isclose(shown.seconds, 50 / wanted.rate)


def test_a_silent_file_in_millimetres_with_y_up_is_guessed_so(standing: np.ndarray) -> None:
    turned = 1000 * standing[..., [0, 2, 1]] * np.array([1.0, 1, -1])
    shown = preview_of(raw_of(turned, usual_up="y"), "x.csv")
    assert (shown.units, shown.units_declared) == ("mm", None)
    assert (shown.up, shown.up_declared) == ("y", None)
    assert shown.rate_known and not shown.problem
    assert np.isclose(np.nanmax(shown.points[:, 2]), 1.7, atol=1e-9), "z is up in the picture"
    assert 1.4 < shown.size < 1.8
    assert len(shown.notes) == 2


def test_what_the_file_says_and_what_the_user_says(standing: np.ndarray) -> None:
    raw = raw_of(100 * standing, units="cm", up="z")
    shown = preview_of(raw, "x.c3d")
    assert (shown.units, shown.units_declared, shown.up, shown.up_declared) == ("cm", "cm", "z", "z")
    other = preview_of(raw, "x.c3d", units="mm", up="x")
    assert (other.units, other.up) == ("mm", "x")
    assert any("cm" in note for note in other.notes)


def test_the_picture_is_of_the_fullest_frame(standing: np.ndarray) -> None:
    shown = preview_of(raw_of(standing, units="m", up="z"), "x.trc")
    assert shown.frame >= 20 and np.isfinite(shown.points).all()
    assert np.allclose(shown.measured, [1, 1, 0.6, 1, 1, 1])


def test_a_missing_rate_is_asked_for_while_the_picture_stands(standing: np.ndarray) -> None:
    raw = raw_of(standing, rate=None, units="m", up="z")
    shown = preview_of(raw, "x.csv")
    assert not shown.rate_known and "rate" in shown.problem
    assert np.isfinite(shown.points).all()
    given = preview_of(raw, "x.csv", rate=25.0)
    assert given.rate_known and not given.problem and given.seconds == 2.0


def test_several_subjects(standing: np.ndarray) -> None:
    two = np.concatenate([standing, standing + 1.0], axis=1)
    labels = tuple(f"{who}:m{i}" for who in ("Ann", "Bob") for i in range(6))
    raw = replace(raw_of(two, units="m", up="z"), labels=labels)
    shown = preview_of(raw, "x.c3d")
    assert set(shown.subjects) == {"Ann", "Bob"} and shown.subject in shown.subjects
    bob = preview_of(raw, "x.c3d", subject="Bob")
    assert bob.subject == "Bob" and len(bob.markers.labels) == 6
    assert np.allclose(bob.points, two[bob.frame, 6:])


def test_nothing_to_show_is_said(standing: np.ndarray) -> None:
    with pytest.raises(InputError, match="no frames"):
        preview_of(raw_of(standing[:0]), "x.trc")
    with pytest.raises(InputError, match="holds no subject"):
        preview_of(raw_of(standing), "x.trc", subject="Zoe")
    with pytest.raises(InputError, match="unit of length"):
        preview_of(raw_of(standing), "x.trc", units="furlong")
    lost = preview_of(raw_of(np.full((3, 2, 3), np.nan), units="m", up="z"), "x.trc")
    assert np.isnan(lost.size) and not lost.measured.any()
