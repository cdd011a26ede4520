"""What has been seen of a video so far, kept piece by piece, so that watching it can be stopped and gone on with."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.progress import Pieces
from markerscope.solver.video.region import Region

PIECE = 32
"""Rows of a piece: about a second of work, which is all that is lost where the program is killed."""
State = tuple[Region | None, Region | None]
"""Of the tracker, after a row."""


@dataclass(frozen=True)
class Row:
    """The landmarks of one frame, as in ``Landmarks``; ``size`` is (width, height) px of the picture."""

    frame: int
    time: float
    size: tuple[int, int]
    tracked: bool
    image: np.ndarray
    world: np.ndarray
    visibility: np.ndarray


@dataclass(frozen=True)
class Piece:
    """Consecutive rows, and the tracker's state after the last of them.

    Attributes
    ----------
    landmarks : of these rows
    region, last : where the person is to be looked for next, and was seen last
    """

    landmarks: Landmarks
    region: Region | None
    last: Region | None


class Watched:
    """The rows so far, those of earlier pieces first. As a context it keeps what is unkept when its block fails.

    Parameters
    ----------
    pieces : where they are kept, None to keep none
    """

    def __init__(self, pieces: Pieces | None) -> None:
        self._pieces = pieces
        self._parts: list[Landmarks] = []
        self._rows: list[tuple[Row, State]] = []
        self.size = 0
        self.state: State = None, None
        while pieces is not None:
            piece = pieces.get(f"{self.size:08d}", Piece)
            if piece is None or not len(piece.landmarks.frame):
                break
            self._parts.append(piece.landmarks)
            self.size += len(piece.landmarks.frame)
            self.state = piece.region, piece.last

    def next_frame(self, stride: int) -> int:
        """Number of the video frame to go on from, every ``stride``-th being watched."""
        return int(self._parts[-1].frame[-1]) + stride if self._parts else 0

    def add(self, row: Row, state: State) -> None:
        """Add a row, after which the tracker has this state."""
        self._rows.append((row, state))
        if self._pieces is not None and len(self._rows) >= PIECE:
            self._keep()

    def landmarks(self, source: str) -> Landmarks:
        """All rows.

        Raises
        ------
        InputError : there are none
        """
        parts = [*self._parts, *([_joined([row for row, _ in self._rows])] if self._rows else [])]
        if not parts:
            raise InputError("not one frame of the video decodes", source, "convert it to an MP4 file with H.264 video")
        arrays: dict[str, Any] = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS}
        return Landmarks(**arrays, image_size=parts[0].image_size, source=source)

    def _keep(self) -> None:
        rows, state = [row for row, _ in self._rows], self._rows[-1][1]
        part = _joined(rows)
        if self._pieces is not None:
            self._pieces.keep(f"{self.size:08d}", Piece(part, *state))
        self._parts.append(part)
        self.size, self.state, self._rows = self.size + len(rows), state, []

    def __enter__(self) -> Watched:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is not None and self._rows:
            with suppress(Exception):  # what ends the work is told, not this
                self._keep()


_ARRAYS = ("image", "world", "visibility", "tracked", "time", "frame")


def _joined(rows: Sequence[Row]) -> Landmarks:
    arrays: dict[str, Any] = {name: np.stack([getattr(row, name) for row in rows]) for name in _ARRAYS}
    return Landmarks(**arrays, image_size=rows[0].size)
