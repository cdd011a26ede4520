"""One person's landmarks along a video: detected once, then tracked from frame to frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np

from markerscope.solver.core.errors import InputError
from markerscope.solver.core.landmarks import LANDMARKS, Landmarks
from markerscope.solver.core.progress import Progress, pieces_of, silent
from markerscope.solver.video.ahead import ahead
from markerscope.solver.video.blazepose_models import (
    DETECTOR_SIDE,
    LANDMARK_SIDE,
    Detection,
    Detector,
    LandmarkNetwork,
    Pose,
)
from markerscope.solver.video.frames import announced, read_frames
from markerscope.solver.video.region import Region
from markerscope.solver.video.watched import Row, State, Watched

_MIN_PRESENCE = 0.5
_CALM = 0.1  # how much of a tiny move the crop follows from frame to frame
_MOVE = 0.15  # of the crop's side (or rad): a move that is followed wholly


class Tracker:
    """Follows one person through pictures given in order."""

    def __init__(self, threads: int = 2) -> None:
        self._detect = Detector(threads)
        self._landmarks = LandmarkNetwork(threads)
        self._region: Region | None = None
        self._last: Region | None = None

    @property
    def state(self) -> State:
        """Where the person is, and was last; given back to another tracker, it goes on alike."""
        return self._region, self._last

    @state.setter
    def state(self, state: State) -> None:
        self._region, self._last = state

    def __call__(self, picture: np.ndarray) -> tuple[Pose, Region] | None:
        """The person's pose in a picture (H, W, 3) uint8 RGB and the region it refers to, or None."""
        found = self._look(picture, self._region) if self._region is not None else None
        if found is None:
            start = self._find(picture)
            first = self._look(picture, start) if start is not None else None
            # The detector's region is rough: look again where the first look says the person is.
            found = self._look(picture, _next_region(*first)) if first is not None else None
        self._region = None if found is None else _next_region(*found)
        self._last = self._region or self._last
        return found

    def _look(self, picture: np.ndarray, region: Region) -> tuple[Pose, Region] | None:
        if not 8 <= region.side <= 20 * max(picture.shape):
            return None
        pose = self._landmarks(region.crop(picture, LANDMARK_SIDE))
        return (pose, region) if pose.presence >= _MIN_PRESENCE else None

    def _find(self, picture: np.ndarray) -> Region | None:
        height, width = picture.shape[:2]
        whole = Region(np.array([width - 1, height - 1]) / 2, float(max(width, height)), 0.0)
        people = self._detect(whole.crop(picture, DETECTOR_SIDE, outside_black=True))
        regions = [_region_of(person, whole) for person in people]
        return max(regions, key=lambda region: self._interest(region, whole), default=None)

    def _interest(self, region: Region, whole: Region) -> float:
        """Prefer the person followed so far, else a large and central one."""
        wanted = self._last or whole
        distance = float(np.linalg.norm(region.centre - wanted.centre)) / wanted.side
        if self._last is not None:
            return -distance - abs(np.log(region.side / self._last.side))
        return region.side / whole.side * float(np.exp(-2 * distance**2))


def track_pose(path: str | Path, *, rate: float = 30.0, progress: Progress = silent, threads: int = 2) -> Landmarks:
    """Landmarks of the largest, most central person of a video, as the network gives them, unsmoothed.

    Where the listener of the progress keeps pieces (``markerscope.solver.core.progress.pieces_of``), it goes on from
    those there are.

    Parameters
    ----------
    path : the video
    rate : Hz, about how many frames a second are looked at (every n-th of the video)
    progress : told the fraction done
    threads : of the network

    Raises
    ------
    InputError : the video cannot be read, or nobody is in it
    """
    video_rate, expected = announced(path)
    stride = max(1, round(video_rate / rate))
    follow = Tracker(threads)

    def told(frame: int, text: str) -> None:
        progress(min(1.0, frame / expected) if expected else 0.0, text)

    with Watched(pieces_of(progress)) as watched:
        if watched.size:
            follow.state = watched.state
        start = watched.next_frame(stride)
        passed = lambda frame: told(frame, f"going on from video frame {start}")  # noqa: E731
        for row in _rows(path, stride, follow, start, passed):
            watched.add(row, follow.state)
            told(row.frame, f"pose in video frame {row.frame}")
    found = watched.landmarks(str(path))
    if not found.tracked.any():
        raise InputError("no person is found in the video", path, "choose a video that shows the whole subject")
    return found


def _rows(path: str | Path, stride: int, follow: Tracker, start: int, passed: Callable[[int], None]) -> Iterator[Row]:
    count = len(LANDMARKS)
    for frame, time, picture in ahead(read_frames(path, stride=stride, start=start, passed=passed)):
        size = (picture.shape[1], picture.shape[0])
        found = follow(picture)
        if found is None:
            nowhere = np.full((count, 2), np.nan), np.full((count, 3), np.nan), np.zeros(count)
            yield Row(frame, time, size, False, *nowhere)
            continue
        pose, region = found
        world = pose.world.copy()
        world[:, :2] = world[:, :2] @ region.rotation.T
        yield Row(frame, time, size, True, region.to_picture(pose.points[:count]), world, pose.visibility[:count])


def _region_of(person: Detection, whole: Region) -> Region:
    return Region.around(*whole.to_picture(np.stack([person.centre, person.scale_point])))


def _next_region(pose: Pose, region: Region) -> Region:
    """Where the person is, by the two auxiliary landmarks.

    The crop stays calm while the person does (a trembling crop makes the landmarks tremble) and follows a real move at
    once, as MediaPipe's filter of these two points does.
    """
    there = Region.around(*region.to_picture(pose.points[33:35]))
    turn = (there.turn - region.turn + np.pi) % (2 * np.pi) - np.pi
    move = float(np.linalg.norm(there.centre - region.centre) + abs(there.side - region.side)) / region.side + abs(turn)
    follow = min(1.0, _CALM + move / _MOVE)
    return Region(
        region.centre + follow * (there.centre - region.centre),
        region.side + follow * (there.side - region.side),
        region.turn + follow * turn,
    )
