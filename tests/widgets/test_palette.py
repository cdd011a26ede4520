"""Colours: told apart with any colour vision, and true at the ends of a scale."""

from __future__ import annotations

import numpy as np
import pytest

from markerscope.widgets import palette

# Machado, Oliveira and Fernandes (2009), severity 1, on linear RGB.
BLINDNESS = {
    "none": np.eye(3),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}


def seen(colours: np.ndarray, vision: str) -> np.ndarray:
    """(n, 3) CIE Lab (D65) of sRGB colours, as somebody with that vision sees them."""
    part = colours / 255.0
    linear = np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)
    linear = np.clip(linear @ BLINDNESS[vision].T, 0, 1)
    to_xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
    xyz = linear @ to_xyz.T / np.array([0.95047, 1.0, 1.08883])
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def least_distance(lab: np.ndarray) -> float:
    apart = np.linalg.norm(lab[:, None] - lab[None], axis=-1)
    return float(apart[np.triu_indices(len(lab), 1)].min())


@pytest.mark.parametrize("vision", BLINDNESS)
def test_the_first_kinds_are_told_apart_with_any_vision(vision: str) -> None:
    for n, least in ((7, 12.0), (16, 3.0)):
        apart = least_distance(seen(palette.categorical(n).astype(float), vision))
        assert apart > least, f"{n} colours come as near as {apart:.1f} (a just noticeable difference is 2.3)"


def test_more_kinds_than_colours_are_still_all_different() -> None:
    colours = palette.categorical(64)
    assert colours.shape == (64, 3) and colours.dtype == np.uint8
    assert len(np.unique(colours, axis=0)) == 64
    assert np.array_equal(colours[:16], palette.categorical(16)), (
        "a kind's colour must not depend on how many there are"
    )
    assert palette.categorical(0).shape == (0, 3)


@pytest.mark.parametrize("name", ["viridis", "cividis"])
@pytest.mark.parametrize("vision", BLINDNESS)
def test_a_scale_gets_lighter_all_the_way_for_everybody(name: str, vision: str) -> None:
    lightness = seen(palette.scale_table(name).astype(float), vision)[:, 0]
    assert np.all(lightness[8:] > lightness[:-8])


def test_scales_clip_mark_what_is_lost_and_survive_an_empty_range() -> None:
    got = palette.sequential(np.array([-1.0, 0.0, 5.0, 10.0, 11.0, np.nan, np.inf]), 0.0, 10.0)
    table = palette.scale_table()
    assert [tuple(c) for c in got[[0, 1, 3, 4]]] == [tuple(table[0])] * 2 + [tuple(table[255])] * 2
    assert tuple(got[2]) in {tuple(table[127]), tuple(table[128])}
    assert [tuple(c) for c in got[5:]] == [palette.LOST, tuple(table[255])]
    assert palette.sequential(np.array([2.0]), 2.0, 2.0).shape == (1, 3)


def test_text_is_read_on_every_colour() -> None:
    for colour in palette.categorical(64):
        assert palette.contrast(palette.text_on(colour), colour) >= 4.5, colour


def test_contrast_is_that_of_the_standard() -> None:
    assert palette.contrast((0, 0, 0), (255, 255, 255)) == pytest.approx(21.0)
    assert palette.contrast((119, 119, 119), (255, 255, 255)) == pytest.approx(4.48, abs=0.01)
