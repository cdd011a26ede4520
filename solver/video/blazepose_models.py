"""The two BlazePose networks as plain functions on arrays.

Shapes, thresholds and decoding follow MediaPipe's published graphs ``pose_detection`` and ``pose_landmark``.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from markerscope.resources import resource
from markerscope.solver.core.errors import InputError

DETECTOR_SIDE = 224
LANDMARK_SIDE = 256
_STRIDES = (8, 16, 32, 32, 32)
_MIN_SCORE = 0.5
_MIN_OVERLAP = 0.3
_HEATMAP_KERNEL = 7
_HEATMAP_MIN_CONFIDENCE = 0.5


@dataclass(frozen=True)
class Detection:
    """A person the detector sees, in units of its letterboxed input (0..1).

    Attributes
    ----------
    score : 0..1
    centre : (2,) mid hip
    scale_point : (2,) lies on the circle about ``centre`` that holds the whole body
    """

    score: float
    centre: np.ndarray
    scale_point: np.ndarray


@dataclass(frozen=True)
class Pose:
    """One pass of the landmark network, in units of its input crop.

    Attributes
    ----------
    presence : 0..1, whether the crop holds a person
    points : (39, 2) 0..1; 33 landmarks, then mid hip and scale point, then 4 unused
    visibility : (39,) 0..1
    world : (33, 3) m about the hip centre, turned with the crop
    """

    presence: float
    points: np.ndarray
    visibility: np.ndarray
    world: np.ndarray


class Detector:
    """Finds people in a whole picture."""

    def __init__(self, threads: int = 2) -> None:
        self._model = _Model("pose_detection.tflite", threads)
        self._anchors = _anchors()

    def __call__(self, square: np.ndarray) -> list[Detection]:
        """People in a letterboxed picture (224, 224, 3) uint8 RGB, best first."""
        boxes, scores = self._model(square.astype(np.float32) / 127.5 - 1.0)
        score = _sigmoid(np.clip(scores.reshape(-1), -100, 100))
        kept = score >= _MIN_SCORE
        raw = boxes.reshape(-1, 12)[kept].astype(np.float64) / DETECTOR_SIDE
        anchors = self._anchors[kept]
        half = raw[:, 2:4] / 2
        centre = raw[:, :2] + anchors
        corners = np.hstack([centre - half, centre + half])
        points = raw[:, 4:].reshape(-1, 4, 2) + anchors[:, None]
        return [
            Detection(s, p[0], p[1]) for s, p in _weighted_suppression(score[kept].astype(np.float64), corners, points)
        ]


class LandmarkNetwork:
    """Finds the landmarks of the one person in a crop."""

    def __init__(self, threads: int = 2) -> None:
        self._model = _Model("pose_landmark_heavy.tflite", threads)

    def __call__(self, crop: np.ndarray) -> Pose:
        """Landmarks in a crop (256, 256, 3) uint8 RGB."""
        flat, presence, heatmaps, world = self._model(crop.astype(np.float32) / 255.0, outputs=(0, 1, 3, 4))
        table = flat.reshape(39, 5).astype(np.float64)
        points = _refined(table[:, :2] / LANDMARK_SIDE, heatmaps[0])
        return Pose(
            float(presence.reshape(-1)[0]),
            points,
            _sigmoid(table[:, 3]),
            world.reshape(39, 3)[:33].astype(np.float64),
        )


class _Model:
    def __init__(self, name: str, threads: int) -> None:
        from ai_edge_litert.interpreter import Interpreter

        with _without_native_stderr():
            self._interpreter: Any = Interpreter(model_content=_verified(name), num_threads=threads)
            self._interpreter.allocate_tensors()
        self._input = self._interpreter.get_input_details()[0]["index"]
        self._outputs = [detail["index"] for detail in self._interpreter.get_output_details()]

    def __call__(self, picture: np.ndarray, outputs: tuple[int, ...] = (0, 1)) -> list[np.ndarray]:
        self._interpreter.set_tensor(self._input, picture[None])
        self._interpreter.invoke()
        return [self._interpreter.get_tensor(self._outputs[i]) for i in outputs]


@contextmanager
def _without_native_stderr() -> Iterator[None]:
    """Silence the runtime's greeting, which it writes past Python and cannot be told to leave out."""
    try:
        kept = os.dup(2)
    except OSError:  # a windowed program may have no standard error at all
        yield
        return
    sink = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(sink, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(sink)
        os.close(kept)


def _verified(name: str) -> bytes:
    """The bytes of a shipped network, if they are the ones that were shipped."""
    path = resource("pose", name)
    remedy = "install Markerscope again"
    try:
        data = path.read_bytes()
        sums = resource("pose", "SHA256SUMS").read_text()
    except OSError as error:
        raise InputError("a pose network of this installation is missing", path, remedy) from error
    expected = {file: digest for digest, file in (line.split() for line in sums.splitlines() if line)}
    if hashlib.sha256(data).hexdigest() != expected.get(name):
        raise InputError("the pose network is not the one that was shipped", path, remedy)
    return data


@cache
def _anchors() -> np.ndarray:
    """(2254, 2) centres of the detector's boxes, 0..1: two a cell and layer, layers of one stride side by side."""
    centres = []
    for stride in sorted(set(_STRIDES)):
        cells = DETECTOR_SIDE // stride
        y, x = np.divmod(np.arange(cells * cells), cells)
        grid = (np.stack([x, y], axis=1) + 0.5) / cells
        centres.append(np.repeat(grid, 2 * _STRIDES.count(stride), axis=0))
    return np.concatenate(centres)


def _weighted_suppression(score: np.ndarray, corners: np.ndarray, points: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Merge overlapping boxes into their score-weighted mean: ``(score, points (4, 2))``, best first.

    ``corners`` (N, 4) are x0 y0 x1 y1.
    """
    found = []
    left = np.argsort(-score, kind="stable")
    while len(left):
        best = left[0]
        overlapping = _overlap(corners[best], corners[left]) > _MIN_OVERLAP
        overlapping[0] = True  # a degenerate box does not even overlap itself
        group = left[overlapping]
        weight = score[group] / score[group].sum()
        found.append((float(score[best]), np.tensordot(weight, points[group], axes=1)))
        left = left[~overlapping]
    return found


def _overlap(box: np.ndarray, boxes: np.ndarray) -> np.ndarray:
    """Intersection over union of one box with (N, 4) boxes."""
    sides = np.minimum(box[2:], boxes[:, 2:]) - np.maximum(box[:2], boxes[:, :2])
    shared = np.prod(np.maximum(sides, 0), axis=1)
    area = np.prod(np.maximum(boxes[:, 2:] - boxes[:, :2], 0), axis=1)
    own = float(np.prod(np.maximum(box[2:] - box[:2], 0)))
    return shared / np.maximum(area + own - shared, 1e-12)


def _refined(points: np.ndarray, heatmaps: np.ndarray) -> np.ndarray:
    """Points (N, 2), 0..1, moved to the weighted mean of their heatmap (H, W, N) nearby, where that is confident."""
    height, width = heatmaps.shape[:2]
    size = np.array([width, height])
    reach = (_HEATMAP_KERNEL - 1) // 2
    refined = points.copy()
    for k, cell in enumerate(np.trunc(points * size).astype(int)):
        if (cell < 0).any() or (cell >= size).any():
            continue
        x0, y0 = np.maximum(cell - reach, 0)
        x1, y1 = np.minimum(cell + reach + 1, size)
        confidence = _sigmoid(heatmaps[y0:y1, x0:x1, k].astype(np.float64))
        if confidence.max() < _HEATMAP_MIN_CONFIDENCE:
            continue
        total = confidence.sum()
        refined[k, 0] = (confidence.sum(axis=0) @ np.arange(x0, x1)) / total / width
        refined[k, 1] = (confidence.sum(axis=1) @ np.arange(y0, y1)) / total / height
    return refined


def _sigmoid(x: np.ndarray) -> np.ndarray:
    return np.asarray(0.5 + 0.5 * np.tanh(0.5 * x))
