"""Marker-part matching (section 3.4): every candidate chain laid over the markers, the best one taken."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.progress import Found, Progress, part_of, silent, tell
from markerscope.solver.core.skeleton import JOINTS
from markerscope.solver.fit.published.chains import candidate_chains
from markerscope.solver.fit.published.descent import minimise
from markerscope.solver.fit.published.energies import shape_term
from markerscope.solver.fit.published.results import BodyState, ChainFit, PaperLocalization
from markerscope.solver.fit.published.rigid import RigidBody
from markerscope.solver.fit.published.sequence import Sequence, chain_vertices, frames_at, mesh_vertices, sequence_of
from markerscope.solver.fit.published.settings import PaperLocalizeSettings
from markerscope.solver.fit.published.turns import about_vertical, turned
from markerscope.solver.fit.state import Observations

if TYPE_CHECKING:
    from torch import Tensor
else:
    Tensor = Any

_TRACED = 12


def localize_paper(
    body: Body,
    seen: Observations,
    time: np.ndarray,
    clusters: np.ndarray,
    settings: PaperLocalizeSettings,
    video_betas: np.ndarray | None = None,
    progress: Progress = silent,
) -> PaperLocalization:
    """The part of the body that carries the markers, and a first placement of the video's body over them.

    Parameters
    ----------
    body : to be fitted
    seen : all T frames
    time : (T,) s
    clusters : (M,) rigid group of each marker, -1 for markers that are left out
    settings : see there
    video_betas : shape by the video, if it is this body's; zeros else
    """
    frames = frames_at(time, settings.rate)
    used = usable_markers(seen, frames, clusters < 0)
    sequence = sequence_of(body, seen, frames, used, settings.betas, video_betas)
    groups = len(np.unique(clusters[used]))
    chains, kept = candidate_chains(groups, settings.shared)
    vertices = mesh_vertices(body, settings.mesh)
    box = box_share(sequence, vertices)
    whole = box > settings.whole_body
    candidates = []
    if not whole or settings.search_always:
        for i, chain in enumerate(kept):
            share = part_of(progress, i / len(kept), (i + 1) / len(kept))
            bones = np.array(sorted(chain))
            fit = fit_chain(sequence, bones, chain_vertices(body, vertices, bones), settings, share)
            candidates.append(fit)
            scores = {
                "yaw_deg": fit.yaw_deg,
                "one_way": fit.one_way,
                "chamfer": fit.chamfer,
                "energy": fit.descent.energy,
            }
            tell(progress, Found("chain", i, {"bones": bones, "of": len(kept), **scores}))
    pruned = np.array([sorted(chain) for chain in kept])
    if whole:
        start = Start.on_markers(sequence)
        return PaperLocalization(
            used, frames, groups, chains, pruned, tuple(candidates), -1, box, 0.0, start.trans.numpy(),
            sequence.betas.numpy(),
        )  # fmt: skip
    chosen = int(np.argmin([fit.chamfer for fit in candidates]))
    best = candidates[chosen]
    return PaperLocalization(
        used, frames, groups, chains, pruned, tuple(candidates), chosen, box, best.yaw_deg, best.trans, best.betas
    )


def usable_markers(seen: Observations, frames: np.ndarray, left_out: np.ndarray) -> np.ndarray:
    """(U,) markers that are seen in some of the frames and not left out."""
    present = np.isfinite(seen.markers[frames]).all(axis=2)
    used = np.flatnonzero(present.any(axis=0) & ~left_out)
    if len(used) < 3:
        raise InputError(
            f"only {len(used)} markers are seen at all", "the markers", "record or keep at least 3 markers"
        )
    return used


def box_share(sequence: Sequence, vertices: np.ndarray) -> float:
    """The markers' axis-parallel bounding box as a part of the video body's mean-shaped one: median over the frames.

    The rule is the authors' program's: the text only says that a whole body's exact chain matters little.
    """
    import torch

    lost = ~sequence.seen[..., None]
    some = sequence.seen.any(dim=1)
    top = sequence.markers.masked_fill(lost, -torch.inf).amax(dim=1)[some]
    bottom = sequence.markers.masked_fill(lost, torch.inf).amin(dim=1)[some]
    index = torch.as_tensor(vertices)
    rotations = sequence.rotations[some]
    still = rotations.new_zeros(len(rotations), 3)
    posed = sequence.posed(rotations.float(), 0 * sequence.betas.float(), still.float(), index)
    own = (posed.amax(dim=1) - posed.amin(dim=1)).prod(dim=1)
    return float(((top - bottom).prod(dim=1) / own).median())


@dataclass(frozen=True, eq=False)
class Start:
    """Yaw (1,) rad, shift (N, 3) m and shape (S,) to begin from."""

    yaw: Tensor
    trans: Tensor
    betas: Tensor

    @classmethod
    def on_markers(cls, sequence: Sequence, yaw: float = 0.0) -> Start:
        """The video's body with its root joint on the median marker of each frame (section 3.4)."""
        body, betas = sequence.body, sequence.betas
        root = body.joint_template[0] + body.joint_dirs[0, :, : len(betas)] @ betas.numpy()
        return cls(betas.new_full((1,), yaw), sequence.centre - betas.new_tensor(root), betas)


def fit_chain(
    sequence: Sequence,
    bones: np.ndarray,
    vertices: np.ndarray,
    settings: PaperLocalizeSettings,
    progress: Progress = silent,
    start: Start | None = None,
    *,
    free_shape: bool = True,
) -> ChainFit:
    """The vertices of one chain laid over all markers by E_S: one global yaw, a shift in every frame, and shape.

    Parameters
    ----------
    vertices : V_S
    start : on the median markers, yaw 0, where not given
    free_shape : False leaves the shape as it is
    """
    import torch

    start = Start.on_markers(sequence) if start is None else start
    yaw, trans, betas = (value.clone().requires_grad_() for value in (start.yaw, start.trans, start.betas))
    rigid = RigidBody.of(sequence, vertices)

    def terms() -> dict[str, Tensor]:
        return {
            "markers": settings.markers * rigid.one_way(yaw, trans, betas),
            "shape": settings.shape * shape_term(betas, sequence.betas),
        }

    def state() -> BodyState:
        with torch.no_grad():
            rotations = turned(about_vertical(yaw) @ sequence.rotations[:, 0], sequence.rotations)
            return BodyState(rotations.numpy(), trans.numpy().copy(), betas.numpy().copy())

    name = JOINTS[int(bones[0])].replace("_", " ")
    descent = minimise(
        terms,
        [yaw, trans, betas] if free_shape else [yaw, trans],
        state,
        lr=settings.lr,
        iterations=settings.iterations,
        progress=progress,
        text=f"laying {len(bones)} bones from the {name} on over the markers",
        traced=_TRACED,
    )
    chamfer, one_way = rigid.two_way(yaw, trans, betas)
    ended = state()
    return ChainFit(bones, float(torch.rad2deg(yaw.detach())[0]), ended.trans, ended.betas, chamfer, one_way, descent)
