"""Which files are videos, by the ending of their names in capitals or not."""

from __future__ import annotations

from pathlib import Path

ENDINGS = (
    ".mp4", ".mov", ".avi", ".mkv", ".m4v", ".webm", ".mts", ".m2ts", ".m2t", ".ts", ".mpg", ".mpeg", ".wmv", ".3gp",
    ".ogv", ".flv", ".mxf", ".h264", ".264", ".hevc", ".h265", ".265",
)  # fmt: skip


def is_video(path: Path) -> bool:
    """Whether a file's name ends as videos' names do."""
    return path.suffix.lower() in ENDINGS


def videos_beside(path: Path) -> list[Path]:
    """Videos that are called like a file in the same folder, the commonest kinds first."""
    try:
        files = [file for file in path.parent.iterdir() if is_video(file) and file.is_file()]
    except OSError:
        return []
    alike = [file for file in files if file.stem.lower() == path.stem.lower()]
    return sorted(alike, key=lambda file: (file.stem != path.stem, ENDINGS.index(file.suffix.lower()), file.name))


def dialog_filter() -> str:
    """The kinds for a file dialog, which minds capitals on some systems."""
    kinds = " ".join(f"*{ending} *{ending.upper()}" for ending in ENDINGS)
    return f"Videos ({kinds});;All files (*)"
