"""All eight ways in which a picture can lie, by the definition of the display matrix."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

from markerscope.solver.video.upright import IDENTITY, Upright

PICTURE = np.arange(2 * 3 * 1).reshape(2, 3, 1)
"""2 rows of 3 pixels."""


class Frame:
    """A decoded frame with a display matrix beside it."""

    def __init__(self, a: int, b: int, c: int, d: int) -> None:
        from av.sidedata.sidedata import Type

        one = 1 << 16
        matrix = np.array([a * one, b * one, 0, c * one, d * one, 0, 0, 0, 1 << 30], dtype=np.int32)
        self.side_data: dict[Any, Any] = {Type.DISPLAYMATRIX: matrix.tobytes()}


@pytest.mark.parametrize(("swapped", "first", "second"), list(product([False, True], [1, -1], [1, -1])))
def test_each_stored_pixel_is_shown_where_the_matrix_says(swapped: bool, first: int, second: int) -> None:
    """A stored (x, y) is shown at (a x + c y, b x + d y), moved so that the picture begins at zero."""
    a, b, c, d = (0, first, second, 0) if swapped else (first, 0, 0, second)
    upright = Upright.of(Frame(a, b, c, d))  # type: ignore[arg-type]
    shown = upright.apply(PICTURE)
    height, width = PICTURE.shape[:2]
    y, x = np.mgrid[:height, :width]
    to_x, to_y = a * x + c * y, b * x + d * y
    expected = np.zeros((width, height, 1) if swapped else (height, width, 1), dtype=int)
    expected[to_y - to_y.min(), to_x - to_x.min()] = PICTURE
    np.testing.assert_array_equal(shown, expected)
    assert shown.flags.c_contiguous
    turns = np.rot90(PICTURE[:, ::-1] if np.linalg.det([[a, c], [b, d]]) < 0 else PICTURE, -upright.turned // 90)
    np.testing.assert_array_equal(turns, expected)


def test_a_frame_without_a_matrix_is_shown_as_it_is() -> None:
    frame = Frame(1, 0, 0, 1)
    frame.side_data = {}
    assert Upright.of(frame) == IDENTITY  # type: ignore[arg-type]
    np.testing.assert_array_equal(IDENTITY.apply(PICTURE), PICTURE)
