"""The known truth of a synthetic session, the embedded one among them."""

from __future__ import annotations

import io
import zipfile
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from markerscope.resources import resource
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.io.atomic import write_bytes_atomic
from markerscope.solver.synth.motion import Motion

TRUTH = "truth.npz"


@dataclass(frozen=True)
class Truth:
    """What made a synthetic session.

    Attributes
    ----------
    body : the body that was filmed and marked, outside the embedded body's shape basis
    betas : (S,) its shape coefficients
    motion : its poses, at the markers' rate and on their clock
    marker_vertex, marker_joint : (M,) the skin vertex and the joint each marker of the session belongs to, -1 for what
        is no marker; a column that changes its marker has the one that it holds longest
    K : (3, 3) px, camera matrix
    R, t : (3, 3) and (3,) m, ``x_camera = R x_lab + t``; x right, y down, z ahead
    image_size : (width, height) px
    offset : s, ``marker_time = video_time + offset``
    swaps : (S, 4) columns a, b and the first and the end frame between which their markers are exchanged
    paths : (T, M, 3) m, where the marker of each column was, seen or not; None where it is not known
    carrier : (T, M) the joint of the marker in each column, frame by frame; None as ``marker_joint``
    """

    body: Body
    betas: np.ndarray
    motion: Motion
    marker_vertex: np.ndarray
    marker_joint: np.ndarray
    K: np.ndarray
    R: np.ndarray
    t: np.ndarray
    image_size: tuple[int, int]
    offset: float
    swaps: np.ndarray = field(default_factory=lambda: np.zeros((0, 4), np.intp))
    paths: np.ndarray | None = None
    carrier: np.ndarray | None = None

    def surface(self, frames: slice | np.ndarray = slice(None)) -> tuple[np.ndarray, np.ndarray]:
        """Vertices (T, V, 3) and joint centres (T, 24, 3), m, of the chosen marker frames."""
        vertices, joints = self.body.pose(self.motion.rotations[frames], self.betas, self.motion.trans[frames])
        return np.asarray(vertices), np.asarray(joints)

    @property
    def joints(self) -> np.ndarray:
        """(T, 24, 3) m joint centres at every marker frame."""
        rotations, trans = self.motion.rotations, self.motion.trans
        return np.asarray(self.body.pose(rotations, self.betas, trans, want_vertices=False)[1])


def load_truth(path: str | Path | None = None) -> Truth:
    """The truth beside the embedded session, or in another ``truth.npz`` of the same maker."""
    remedy = "install Markerscope again" if path is None else "make the session anew"
    path = resource("demo", TRUTH) if path is None else Path(path)
    body = Body.load()
    try:
        with np.load(path, allow_pickle=False) as data:
            if str(data["body"]) != body.digest:
                raise InputError("the session was made for another body", path, "make it anew")
            turns = exp_so3(data["rotation_vectors"].astype(float))
            moved = replace(
                body,
                template=body.template + data["surface_offset"].astype(float),
                joint_template=body.joint_template + data["joint_offset"],
                name="of a synthetic session",
                digest="",
                _torch={},
            )
            width, height = data["image_size"].tolist()
            return Truth(
                body=moved,
                betas=data["betas"],
                motion=Motion(turns, data["trans"].astype(float), float(data["rate"])),
                marker_vertex=data["marker_vertex"],
                marker_joint=data["marker_joint"],
                K=data["K"],
                R=data["R"],
                t=data["t"],
                image_size=(width, height),
                offset=float(data["offset"]),
                swaps=data["swaps"] if "swaps" in data else np.zeros((0, 4), np.intp),
                paths=data["paths"].astype(float) if "paths" in data else None,
                carrier=data["carrier"].astype(np.intp) if "carrier" in data else None,
            )
    except (OSError, KeyError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise InputError("the truth of the session cannot be read", path, remedy) from error


def save_truth(path: str | Path, truth: Truth) -> None:
    """Write what ``load_truth`` reads: the body as its difference from the embedded one."""
    plain = Body.load()
    more: dict[str, Any] = {} if not len(truth.swaps) else {"swaps": truth.swaps}
    if truth.paths is not None:
        more["paths"] = truth.paths.astype(np.float32)
    if truth.carrier is not None:
        more["carrier"] = truth.carrier.astype(np.int8)
    data = io.BytesIO()
    np.savez_compressed(
        data,
        body=plain.digest,
        surface_offset=(truth.body.template - plain.template).astype(np.float16),
        joint_offset=truth.body.joint_template - plain.joint_template,
        betas=truth.betas,
        rotation_vectors=log_so3(truth.motion.rotations).astype(np.float32),
        trans=truth.motion.trans.astype(np.float32),
        rate=truth.motion.rate,
        marker_vertex=truth.marker_vertex,
        marker_joint=truth.marker_joint,
        K=truth.K,
        R=truth.R,
        t=truth.t,
        image_size=np.array(truth.image_size),
        offset=truth.offset,
        **more,
    )
    write_bytes_atomic(path, data.getvalue())
