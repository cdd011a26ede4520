"""Files that are videos, whatever case their endings have."""

from __future__ import annotations

from pathlib import Path

import pytest

from markerscope.app.window.videos import ENDINGS, dialog_filter, is_video, videos_beside


@pytest.mark.parametrize("ending", [*ENDINGS, *(ending.upper() for ending in ENDINGS), ".Mp4"])
def test_every_ending_in_both_cases(tmp_path: Path, ending: str) -> None:
    markers, video = tmp_path / "trial.c3d", tmp_path / f"trial{ending}"
    for file in (markers, video, tmp_path / "other.mp4"):
        file.write_bytes(b"x")
    assert is_video(video) and not is_video(markers)
    assert videos_beside(markers) == [video]
    assert ending == ".Mp4" or f"*{ending}" in dialog_filter()


def test_the_nearest_name_and_the_commonest_kind_come_first(tmp_path: Path) -> None:
    for name in ("TRIAL.mkv", "trial.mts", "trial.MP4", "trial.txt"):
        (tmp_path / name).write_bytes(b"x")
    assert [file.name for file in videos_beside(tmp_path / "trial.trc")] == ["trial.MP4", "trial.mts", "TRIAL.mkv"]
    assert videos_beside(tmp_path / "nowhere" / "trial.trc") == []
