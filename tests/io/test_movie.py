"""What is written as a video is read back: as many frames, of that size, colour and rate."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.io.movie import write_movie
from markerscope.solver.video.frames import index_video, read_frames


def pictures(count: int, height: int, width: int) -> list[np.ndarray]:
    """A bright square that walks to the right over a coloured ground."""
    made = []
    for k in range(count):
        picture = np.full((height, width, 3), (40, 90, 150), dtype=np.uint8)
        picture[20:44, 4 * k : 4 * k + 24] = (230, 200, 60)
        made.append(picture)
    return made


@pytest.mark.parametrize(("height", "width", "rate"), [(64, 96, 30.0), (65, 97, 29.97), (70, 90, 12.5)])
def test_a_movie_is_read_back(tmp_path: Path, height: int, width: int, rate: float) -> None:
    wanted = pictures(12, height, width)
    path = tmp_path / "a.mp4"
    assert write_movie(path, iter(wanted), rate) == 12
    index = index_video(path)
    assert index.size == (width + width % 2, height + height % 2)
    assert np.allclose(index.time, np.arange(12) / rate, atol=2e-4), index.time
    for k, _, got in read_frames(path):
        difference = np.abs(got[:height, :width].astype(int) - wanted[k]).mean()
        assert difference < 4, f"frame {k} differs by {difference:.1f} levels"
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_what_fails_midway_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    write_movie(path, pictures(3, 64, 64), 30)
    before = path.read_bytes()

    def broken():
        yield from pictures(2, 64, 64)
        raise RuntimeError("the window was closed")

    with pytest.raises(RuntimeError, match="closed"):
        write_movie(path, broken(), 30)
    with pytest.raises(InputError, match="64 x 64 px, then 32 x 66 px"):
        write_movie(path, [*pictures(1, 64, 64), *pictures(1, 66, 32)], 30)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


def test_bad_wishes_end_in_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.mp4"):
        write_movie(tmp_path / "a.avi", pictures(1, 64, 64), 30)
    for rate in (0.0, float("nan"), -1.0):
        with pytest.raises(InputError, match="frames a second"):
            write_movie(tmp_path / "a.mp4", pictures(1, 64, 64), rate)
    with pytest.raises(InputError, match="no frame"):
        write_movie(tmp_path / "a.mp4", [], 30)
    with pytest.raises(InputError, match="folder"):
        write_movie(tmp_path / "nowhere" / "a.mp4", pictures(1, 64, 64), 30)
    assert not list(tmp_path.iterdir())
