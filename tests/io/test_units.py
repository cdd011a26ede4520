"""Which unit a cloud is in when its file does not say: bodies and single limbs near the limits between two units."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.solver.io.units import cloud_size, settle_units

METRES = {"m": 1.0, "cm": 0.01, "mm": 0.001}


def cloud(across: float, seed: int = 0) -> np.ndarray:
    """(T, M, 3) m, whose measured size is ``across``."""
    points = np.random.default_rng(seed).uniform(-1, 1, (8, 30, 3))
    size = cloud_size(points)
    assert size is not None
    return points * across / size


@pytest.mark.parametrize(
    ("unit", "metres"),
    [("m", 0.1), ("m", 1.8), ("m", 4.5), ("cm", 0.06), ("cm", 0.3), ("cm", 1.7), ("cm", 2.4), ("mm", 0.26),
     ("mm", 0.4), ("mm", 1.7), ("mm", 3.0)],
)  # fmt: skip
def test_a_body_a_limb_and_a_hand_are_told_in_every_unit(unit: str, metres: float) -> None:
    factor, notes = settle_units(cloud(metres) / METRES[unit], None, None, "trial.csv")
    assert factor == METRES[unit], f"{metres} m in {unit}: {notes}"
    assert f"{unit} was taken" in notes[0]
    assert "names no unit" in notes[0]


def test_the_size_of_a_cloud_is_that_of_its_usual_frame() -> None:
    box = np.stack(np.meshgrid([0, 0.3], [0, 0.4], [0, 1.2]), axis=-1).reshape(1, 8, 3)
    frames = np.repeat(box, 41, axis=0)
    assert cloud_size(frames) == pytest.approx(1.3)  # 3, 4, 12, 13
    frames[:5] *= 30
    frames[5:9, 1:] = np.nan  # one marker alone has no size
    assert cloud_size(frames) == pytest.approx(1.3)
    assert cloud_size(np.full((4, 3, 3), np.nan)) is None


def test_a_wish_wins_over_the_file_and_only_a_difference_is_said() -> None:
    points = cloud(1.7)
    assert settle_units(1000 * points, "mm", "mm", "a") == (0.001, ())
    assert settle_units(100 * points, None, "cm", "a") == (0.01, ())
    factor, notes = settle_units(points, "mm", "m", "a")
    assert factor == 1.0
    assert notes == ("The file says its unit is mm; m was taken as asked.",)
    factor, notes = settle_units(points, "cubits", None, "a")
    assert factor == 1.0
    assert "unknown unit (cubits)" in notes[0]
