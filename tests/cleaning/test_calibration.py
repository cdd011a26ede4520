"""What each way of filling says of its own error, against the error that it makes where the truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.cleaning.fill import METHODS
from markerscope.solver.cleaning.fill.body import fill_by_body
from markerscope.solver.cleaning.gaps import Filled, FillSettings
from tests.cleaning.scenes import RATE, lose, path, rigid, soft, turning, worst

EVERYTHING = {"min_confidence": 0.0, "max_gap": None}


def masked(truth: np.ndarray, length: int) -> tuple[np.ndarray, list[tuple[int, int, int]]]:
    """Gaps of one length, one at a time in each marker, and never two at once."""
    spans = []
    for k, first in enumerate(range(30, len(truth) - length - 30, length + 25)):
        spans.append((k % truth.shape[1], first, first + length - 1))
    return lose(truth, *spans), spans


def errors(found: Filled, truth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean error of each fill and what it was said to be, m."""
    off = np.linalg.norm(found.positions - truth, axis=2)
    made = [off[fill.first : fill.last + 1, fill.marker].mean() for fill in found.fills]
    return np.array(made), np.array([fill.error for fill in found.fills])


def scenes(noise_m: float = 0.001) -> list[np.ndarray]:
    return [soft(700, seed) + np.random.default_rng(seed).normal(0, noise_m, (700, 9, 3)) for seed in range(4)]


@pytest.mark.parametrize("length", [6, 30])
@pytest.mark.parametrize("method", [*METHODS, "body"])
def test_each_method_says_its_own_error(method: str, length: int) -> None:
    made, said = [], []
    for truth in scenes():
        given, spans = masked(truth, length)
        fill = METHODS[method] if method in METHODS else fill_by_body(_rigid_body(truth))
        found = fill(given, RATE, FillSettings(method="linear", **EVERYTHING))  # type: ignore[arg-type]
        one, other = errors(found, truth)
        assert len(one) >= 0.9 * len(spans), f"{len(one)} of {len(spans)} gaps filled"
        made, said = [*made, *one], [*said, *other]
    usual = np.mean(said) / np.mean(made)
    assert 0.6 < usual < 1.7, f"said {1e3 * np.mean(said):.2f}, made {1e3 * np.mean(made):.2f} mm"
    within = np.mean(np.array(made) <= 2.5 * np.array(said))
    assert within > 0.85, f"{100 * within:.0f} % within two and a half times what was said"


def _rigid_body(truth: np.ndarray) -> np.ndarray:
    """Where a body would have the markers: each off by some millimetres that come and go."""
    time = np.arange(len(truth))[:, None, None] / RATE
    phase = np.arange(truth.shape[1])[:, None]
    return truth + 0.008 * np.sin(2 * np.pi * 0.7 * time + phase) * np.array([1.0, 0.5, -0.5])


@pytest.mark.parametrize("seed", range(6))
def test_three_neighbours_do_not_mirror_a_marker(seed: int) -> None:
    """Four markers on one rigid body: the three that are seen say nothing of left and right."""
    truth = rigid(300, 4, seed) + np.random.default_rng(seed).normal(0, 0.0005, (300, 4, 3))
    given = lose(truth, (0, 60, 99), (1, 150, 189), (2, 230, 260))
    found = METHODS["edm"](given, RATE, FillSettings(method="edm", **EVERYTHING))  # type: ignore[arg-type]
    assert len(found.fills) == 3
    off = worst(found.positions, truth)
    assert off < 0.008, f"{1e3 * off:.1f} mm off"
    made, said = errors(found, truth)
    assert (made <= 3 * said + 1e-4).all(), f"made {1e3 * made} and said {1e3 * said} mm"


def test_flat_neighbours_do_not_either() -> None:
    """Six neighbours on a plate and a marker that stands 80 mm off it."""
    rng = np.random.default_rng(3)
    shape = np.concatenate([[[0.0, 0, 0.08]], np.c_[rng.uniform(-0.15, 0.15, (6, 2)), rng.normal(0, 0.001, 6)]])
    truth = np.einsum("tij,mj->tmi", turning(300, rng), shape) + path(300, rng)[:, None]
    truth += rng.normal(0, 0.001, truth.shape)
    found = METHODS["edm"](lose(truth, (0, 100, 160)), RATE, FillSettings(method="edm", **EVERYTHING))  # type: ignore[arg-type]
    assert [fill.method for fill in found.fills] == ["edm"]
    assert worst(found.positions, truth) < 0.012


def test_ends_on_two_sides_are_filled_as_a_rigid_body() -> None:
    """A marker that went through the plane of its neighbours while it was lost: no distance tells when."""
    rng = np.random.default_rng(5)
    frames = 200
    shape = np.repeat(np.array([[0.02, 0.01, 0], [0.2, 0, 0], [-0.1, 0.15, 0], [-0.1, -0.15, 0]])[None], frames, axis=0)
    shape[:, 0, 2] = 0.06 * np.tanh((np.arange(frames) - 100) / 10)
    truth = np.einsum("tij,tmj->tmi", turning(frames, rng), shape) + path(frames, rng)[:, None]
    found = METHODS["edm"](lose(truth, (0, 80, 120)), RATE, FillSettings(method="edm", **EVERYTHING))  # type: ignore[arg-type]
    assert [fill.method for fill in found.fills] == ["rigid"]
