"""What a fit is given, what it looks for, and how it weighs the evidence."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from markerscope.solver.fit.kinematics import Points, Pose

if TYPE_CHECKING:
    from markerscope.solver.fit.terms.term import Evidence

FREE = np.array([0, 1, 4, 7, 10, 2, 5, 8, 11, 3, 6, 9, 12, 15, 13, 16, 18, 20, 14, 17, 19, 21])
"""Joints that a fit turns: all but the hands, which neither markers nor landmarks show. In the order of their unknowns:
limb by limb, so that what moves a point lies together."""
POSE_SIZE = 3 * len(FREE) + 3
CAMERA_SIZE = 7


@dataclass(frozen=True)
class Observations:
    """What is seen in N frames.

    Attributes
    ----------
    markers : (N, M, 3) m, lab frame, NaN = lost
    prior : (N, 24, 3, 3) pose of the video, root in the camera's frame
    tracked : (N,) True where the video tracked the person
    image : (N, L, 2) px of the body landmarks in the video, NaN = not seen
    visibility : (N, L) 0..1
    image_size : (width, height) px; (0, 0) without landmarks
    shape : (B,) the first shape coefficients as the video has them, where it was told of a body of this kind
    further : whatever else is known, each a term of the energy with its data
    """

    markers: np.ndarray
    prior: np.ndarray
    tracked: np.ndarray
    image: np.ndarray
    visibility: np.ndarray
    image_size: tuple[int, int]
    shape: np.ndarray | None = None
    further: tuple[Evidence, ...] = ()

    def at(self, frames: np.ndarray | slice) -> Observations:
        """Some of the frames."""
        names = ("markers", "prior", "tracked", "image", "visibility")
        further = tuple(term.of_frames(frames) for term in self.further)
        return replace(self, further=further, **{name: getattr(self, name)[frames] for name in names})

    @property
    def lab_centre(self) -> np.ndarray:
        """(3,) m, the middle of all markers: the camera turns about it, which keeps the problem well scaled."""
        return np.nanmean(self.markers.reshape(-1, 3), axis=0)


@dataclass(frozen=True)
class Camera:
    """A pinhole camera: ``x_cam = R_lab_cam^T (x_lab - centre) + shift``, ``px = focal x / z + middle``.

    Attributes
    ----------
    R_lab_cam : (3, 3) turns camera axes (x right, y down, z away) into the lab
    shift : (3,) m, the point ``centre`` in the camera's frame
    centre : (3,) m, lab frame
    focal : px
    """

    R_lab_cam: np.ndarray
    shift: np.ndarray
    centre: np.ndarray
    focal: float

    def to_camera(self, points: np.ndarray) -> np.ndarray:
        """(..., 3) m, lab to camera frame."""
        return (points - self.centre) @ self.R_lab_cam + self.shift

    def project(self, points: np.ndarray, image_size: tuple[int, int]) -> np.ndarray:
        """(..., 3) m in the lab to (..., 2) px."""
        seen = self.to_camera(points)
        return self.focal * seen[..., :2] / np.maximum(seen[..., 2:], 0.05) + np.array(image_size) / 2


def no_bias() -> np.ndarray:
    """(K, 3, 3) for a video whose pose is right on average."""
    return np.tile(np.eye(3), (len(FREE), 1, 1))


@dataclass(frozen=True)
class State:
    """One guess at everything.

    Attributes
    ----------
    pose : of every frame
    placement : where the markers sit
    camera : how the video's frame stands in the lab
    bias : (K, 3, 3) what turns the video's joints, each alike in every frame, towards the true ones; the root, which
        turns with the camera, has none
    """

    pose: Pose
    placement: Points
    camera: Camera
    bias: np.ndarray = field(default_factory=no_bias)


@dataclass(frozen=True)
class Weights:
    """How much each kind of evidence counts, as its spread.

    Attributes
    ----------
    marker : m, spread of a marker about its place on the skin
    marker_kernel : m, beyond this a marker counts as an outlier (Geman-McClure)
    prior_deg : spread of the video's joint rotations about their bias; one, or (K,) of each joint
    bias_deg : spread of that bias, which a reconstruction from one camera keeps from frame to frame
    root_deg : spread of the video's root rotation, once the camera is turned right
    anatomical : share of the anatomical prior
    image : spread of a 2D landmark as a share of the person's height in the image
    shape : strength of the prior on betas and bone lengths, per frame of evidence
    video_shape : spread of the video's shape coefficients, where it has any, in standard deviations among people
    offset, offset_spread : m, marker centre above the skin (9.5 mm: Ghorbani and Black 2021); the spread holds the
        marker's own 2 mm and what the shapes miss of a real skin
    slide : m, how far a marker may slide over the skin in one step
    focal_spread : natural logarithm of the focal length
    free_camera, free_shape, free_placement, free_bias : False holds the camera, the shape, where markers sit, or the
        video's bias
    """

    marker: float = 0.01
    marker_kernel: float = 0.03
    prior_deg: float | np.ndarray = 18.0
    bias_deg: float = 15.0
    root_deg: float = 25.0
    anatomical: float = 0.3
    image: float = 0.025
    image_kernel: float = 3.0
    shape: float = 1.0
    video_shape: float = 0.7
    offset: float = 0.0095
    offset_spread: float = 0.006
    slide: float = 0.02
    focal_guess: float = 0.85
    focal_spread: float = 0.25
    free_camera: bool = True
    free_shape: bool = True
    free_placement: bool = True
    free_bias: bool = True


@dataclass(frozen=True)
class Surface:
    """The rest surface about each marker: what its placement is held to. All (M, ...)."""

    point: np.ndarray
    normal: np.ndarray


@dataclass(frozen=True)
class Unknowns:
    """Where the unknowns that all frames share stand in the normal equations."""

    shape: slice
    camera: slice
    bias: slice
    placement: slice

    @classmethod
    def of(cls, shapes: int, markers: int) -> Unknowns:
        """For so many shape coefficients and markers."""
        ends = np.cumsum([0, shapes, CAMERA_SIZE, 3 * len(FREE), 3 * markers]).tolist()
        return cls(*(slice(start, stop) for start, stop in pairwise(ends)))

    @property
    def size(self) -> int:
        """How many there are."""
        return int(self.placement.stop)
