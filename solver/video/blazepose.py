"""One person's landmarks along a video: detected once, then tracked from frame to frame."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from solver.errors import InputError
from solver.progress import Progress, silent
from solver.video.ahead import ahead
from solver.video.blazepose_models import DETECTOR_SIDE, LANDMARK_SIDE, Detection, Detector, LandmarkNetwork, Pose
from solver.video.frames import announced, read_frames
from solver.video.landmarks import LANDMARKS, Landmarks

_MARGIN = 1.25  # of the crop about the circle that holds the body
_MIN_PRESENCE = 0.5
_CALM = 0.1  # how much of a tiny move the crop follows from frame to frame
_MOVE = 0.15  # of the crop's side (or rad): a move that is followed wholly


@dataclass(frozen=True)
class Region:
    """The turned square that holds a person.

    Attributes
    ----------
    centre : (2,) px
    side : px
    turn : rad, from the picture's axes to the crop's, clockwise as seen
    """

    centre: np.ndarray
    side: float
    turn: float

    @classmethod
    def around(cls, centre: np.ndarray, scale_point: np.ndarray) -> Region:
        """Centred on the hips, upright along the line to the scale point."""
        x, y = scale_point - centre
        return cls(centre, 2 * _MARGIN * float(np.hypot(x, y)), float(np.arctan2(x, -y)))

    @property
    def rotation(self) -> np.ndarray:
        """(2, 2) from the crop's axes to the picture's."""
        c, s = np.cos(self.turn), np.sin(self.turn)
        return np.array([[c, -s], [s, c]])

    def to_picture(self, points: np.ndarray) -> np.ndarray:
        """Points (N, 2) of the crop, 0..1, in px of the picture (a pixel's centre is at whole numbers)."""
        return self.centre + (points - 0.5) * self.side @ self.rotation.T

    def crop(self, picture: np.ndarray, size: int, *, outside_black: bool = False) -> np.ndarray:
        """The square resampled to (size, size, 3); its pixel i covers i/size to (i+1)/size of the side."""
        import cv2

        linear = self.rotation * (self.side / size)
        offset = self.to_picture(np.full((1, 2), 0.5 / size))[0]
        border = cv2.BORDER_CONSTANT if outside_black else cv2.BORDER_REPLICATE
        matrix = np.hstack([linear, offset[:, None]])
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        return np.asarray(cv2.warpAffine(picture, matrix, (size, size), flags=flags, borderMode=border))


class Tracker:
    """Follows one person through pictures given in order."""

    def __init__(self, threads: int = 2) -> None:
        self._detect = Detector(threads)
        self._landmarks = LandmarkNetwork(threads)
        self._region: Region | None = None
        self._last: Region | None = None

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
    rows: list[_Row] = []
    for row in _rows(path, stride, follow):
        rows.append(row)
        progress(min(1.0, row.frame / expected) if expected else 0.0, f"pose in video frame {row.frame}")
    tracked = np.array([row.tracked for row in rows])
    if not tracked.any():
        raise InputError("no person is found in the video", path, "choose a video that shows the whole subject")
    return Landmarks(
        image=np.stack([row.image for row in rows]),
        world=np.stack([row.world for row in rows]),
        visibility=np.stack([row.visibility for row in rows]),
        tracked=tracked,
        time=np.array([row.time for row in rows]),
        frame=np.array([row.frame for row in rows]),
        image_size=rows[0].size,
        source=str(path),
    )


@dataclass(frozen=True)
class _Row:
    """The landmarks of one frame, as in ``Landmarks``."""

    frame: int
    time: float
    size: tuple[int, int]
    tracked: bool
    image: np.ndarray
    world: np.ndarray
    visibility: np.ndarray


def _rows(path: str | Path, stride: int, follow: Tracker) -> Iterator[_Row]:
    count = len(LANDMARKS)
    for frame, time, picture in ahead(read_frames(path, stride=stride)):
        size = (picture.shape[1], picture.shape[0])
        found = follow(picture)
        if found is None:
            nowhere = np.full((count, 2), np.nan), np.full((count, 3), np.nan), np.zeros(count)
            yield _Row(frame, time, size, False, *nowhere)
            continue
        pose, region = found
        world = pose.world.copy()
        world[:, :2] = world[:, :2] @ region.rotation.T
        yield _Row(frame, time, size, True, region.to_picture(pose.points[:count]), world, pose.visibility[:count])


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
