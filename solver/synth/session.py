"""A whole session of known truth from a motion, settings and a seed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from markerscope.solver.body.model import Body, chain
from markerscope.solver.cleaning.gap_statistics import load_gap_statistics
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.io.motion import SkeletonMotion
from markerscope.solver.synth.acts import act
from markerscope.solver.synth.body import vary_body, vary_bones
from markerscope.solver.synth.capture import sliding
from markerscope.solver.synth.gaps import gaps_like, heavy_tailed_gaps, hidden_by_chance
from markerscope.solver.synth.ghosts import ghosts
from markerscope.solver.synth.layouts import named_sites
from markerscope.solver.synth.misplaced import misplaced
from markerscope.solver.synth.motion import Motion, carried_over, damped, on_floor, played
from markerscope.solver.synth.prior import PriorError, corrupt_prior, other_shape
from markerscope.solver.synth.retarget import retarget
from markerscope.solver.synth.settings import SynthSettings
from markerscope.solver.synth.sites import Sites, site_paths, uniform_sites
from markerscope.solver.synth.streams import stream
from markerscope.solver.synth.swaps import draw_swaps, holders
from markerscope.solver.synth.truth import Truth

__all__ = ["SynthSession", "SynthSettings", "synthesise"]

MOST_NESTED = 50
"""Markers of which fewer are a subset: so many are always drawn."""
_FOCAL, _IMAGE = 1000.0, (1280, 720)  # px
_DEPTH = 4.0  # m, of the person's middle before the camera


@dataclass(frozen=True, eq=False)
class SynthSession:
    """What a solver is given, and what it is judged by.

    Attributes
    ----------
    markers : labels mean nothing; ghosts are among them
    prior : what a video says, root in the camera's axes
    nominal_offset : s, what the user believes of the clocks: marker time = video time + offset
    truth : what made it, on the markers' frames
    settings, seed : which draw the same session again
    motion : file or name of the motion, empty where it has none
    """

    markers: Markers
    prior: PosePrior
    nominal_offset: float
    truth: Truth
    settings: SynthSettings
    seed: int
    motion: str = ""


def synthesise(motion: Motion | SkeletonMotion | str, settings: SynthSettings, seed: int) -> SynthSession:
    """Draw a session.

    Every purpose has random numbers of its own: the same seed gives the same body whatever the markers, the same
    places of markers whatever is lost of them, and so on, so that sessions that differ in one setting can be compared.

    Parameters
    ----------
    motion : recorded, or made for the embedded body, or the name of one of ``acts.ACTS``
    settings : see there
    seed : 0 or more

    Raises
    ------
    InputError : the settings ask for what cannot be
    """
    body, betas = _body(settings, seed)
    whole = _on_body(motion, body, betas, settings, seed)
    moved = played(whole, settings.frames, settings.rate)
    sites, kept = _sites(body, betas, settings, seed)
    paths = _carried(body, betas, moved, sites, settings, seed)[:, :kept]
    columns, swaps, order = _recorded(paths, settings, seed)
    prior, R_lab_cam, offset = _video(whole, settings, seed, body.shape_count)

    count = columns.shape[1]
    none = np.full(count - kept, -1)  # ghosts
    vertex, bone = (np.concatenate([known[:kept], none]) for known in (sites.vertex, sites.joint))
    true_paths = np.concatenate([paths, np.full((len(paths), count - kept, 3), np.nan)], axis=1)
    held = holders(swaps, len(paths), count)[:, order]
    longest = np.array([np.bincount(column, minlength=count).argmax() for column in held.T])
    place = np.argsort(order)  # in the file, of each column
    truth = Truth(
        body=body,
        betas=betas,
        motion=moved,
        marker_vertex=vertex[longest],
        marker_joint=bone[longest],
        **_camera(moved, body, betas, R_lab_cam),
        offset=offset,
        swaps=np.column_stack([place[swaps[:, :2]], swaps[:, 2:]]),
        paths=np.take_along_axis(true_paths, held[:, :, None], axis=1),
        carrier=bone[held],
    )
    labels = tuple(f"M{i + 1:02d}" for i in range(count))
    markers = Markers(columns[:, order], settings.rate, labels)
    source = motion if isinstance(motion, str) else getattr(motion, "source", "")
    return SynthSession(markers, prior, 0.0, truth, settings, seed, source)


def _body(settings: SynthSettings, seed: int) -> tuple[Body, np.ndarray]:
    plain = Body.load()
    rng = stream(seed, "body")
    betas = stream(seed, "betas").normal(0, settings.spread, plain.shape_count)
    if settings.shape == "inside":
        return vary_bones(plain, rng, settings.bones), betas
    return vary_body(plain, rng, bones=settings.bones, bumps=settings.bumps, centres=settings.centres_mm / 1000), betas


def _on_body(
    motion: Motion | SkeletonMotion | str, body: Body, betas: np.ndarray, settings: SynthSettings, seed: int
) -> Motion:
    """The motion at its own rate, feet on the floor."""
    if isinstance(motion, str):
        seconds = settings.frames / settings.rate + 2
        whole = act(motion, body, betas, seconds=seconds, rate=max(60.0, settings.rate), rng=stream(seed, "act"))
    elif isinstance(motion, SkeletonMotion):
        whole = retarget(motion, body, betas)
    else:
        whole = on_floor(carried_over(motion, Body.load().joint_template, body, betas), body, betas)
    return whole if settings.still is None else on_floor(damped(whole, settings.still), body, betas)


def _sites(body: Body, betas: np.ndarray, settings: SynthSettings, seed: int) -> tuple[Sites, int]:
    """All places that are drawn, in the order in which they are used, and how many of them are."""
    if settings.layout != "uniform":
        sites = named_sites(body, betas, settings.layout, settings.part)
        if settings.misplaced_mm:
            sites = misplaced(body, betas, sites, 1e-3 * settings.misplaced_mm, stream(seed, "misplaced"))
        kept = len(sites)
    else:
        kept = settings.markers
        purpose = "sites" if settings.nested else f"sites of {kept}"
        sites = _spread(body, betas, settings, stream(seed, purpose))
    rng = stream(seed, "heights")
    high = rng.normal(settings.offset_mm, settings.offset_spread_mm, max(len(sites), MOST_NESTED))[: len(sites)]
    return sites.raised(1e-3 * np.maximum(high, min(2.0, settings.offset_mm))), kept


def _spread(body: Body, betas: np.ndarray, settings: SynthSettings, rng: np.random.Generator) -> Sites:
    """Random places: as many as there are in the largest of nested sets, where so many fit."""
    most = max(settings.markers, MOST_NESTED) if settings.nested and settings.part is None else settings.markers
    return uniform_sites(body, betas, most, rng, part=settings.part, apart=1e-3 * settings.apart_mm)


def _carried(
    body: Body, betas: np.ndarray, motion: Motion, sites: Sites, settings: SynthSettings, seed: int
) -> np.ndarray:
    """(T, M, 3) m, the markers on the body, sliding with its skin."""
    turns, _ = chain(motion.rotations, body.joints(betas), motion.trans)
    spare = np.zeros(max(0, MOST_NESTED - len(sites)), np.intp)  # so that the numbers drawn are those of more markers
    joint = np.concatenate([sites.joint, spare])
    slide = settings.slide * sliding(motion, joint, stream(seed, "slide"))[:, : len(sites)]
    if settings.still is not None:  # skin slides as far as joints bend
        slide = slide * settings.still
    own_turn = turns[:, sites.joint]
    return site_paths(body, betas, motion, sites) + np.einsum("tmab,tmb->tma", own_turn, slide)


def _recorded(paths: np.ndarray, settings: SynthSettings, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What the cameras make of markers (T, M, 3) m.

    Returns
    -------
    columns : (T, M + ghosts, 3) m, markers first, NaN = lost
    swaps : (S, 4) see ``draw_swaps``
    order : (M + ghosts,) which of the columns each one of the file is
    """
    frames, count = paths.shape[:2]
    drawn = max(count, MOST_NESTED)
    shaken = paths + 1e-3 * settings.jitter_mm * stream(seed, "jitter").normal(size=(drawn, frames, 3))[
        :count
    ].swapaxes(0, 1)
    shaken[_lost((frames, count), drawn, settings, seed)] = np.nan
    false = ghosts(paths, settings.rate, settings.ghosts, stream(seed, "ghosts"))
    columns = np.concatenate([shaken, false], axis=1)
    swaps = draw_swaps(paths, settings.rate, settings.swaps, stream(seed, "swaps"))
    held = holders(swaps, frames, columns.shape[1])
    columns = np.take_along_axis(columns, held[:, :, None], axis=1)
    keys = [stream(seed, name).random(n) for name, n in (("order", drawn), ("order of ghosts", settings.ghosts))]
    return columns, swaps, np.argsort(np.concatenate([keys[0][:count], keys[1]]))


def _lost(shape: tuple[int, int], drawn: int, settings: SynthSettings, seed: int) -> np.ndarray:
    """(T, M) True where a marker is not seen."""
    lost = np.zeros(shape, dtype=bool)
    if settings.lost > 0:
        longest = max(1, round(settings.longest_gap * settings.rate))
        lost |= heavy_tailed_gaps(shape, settings.lost, longest, stream(seed, "lost"))
    if settings.hidden_chance > 0:
        lost |= hidden_by_chance((shape[0], drawn), settings.hidden_chance, stream(seed, "hidden"))[:, : shape[1]]
    if settings.gap_statistics is not None:
        real = load_gap_statistics(settings.gap_statistics)
        gone = gaps_like(real, (shape[0], drawn), stream(seed, "real gaps"), times=settings.gap_times)
        lost |= gone[:, : shape[1]]
    return lost


def _video(whole: Motion, settings: SynthSettings, seed: int, shape_count: int) -> tuple[PosePrior, np.ndarray, float]:
    """What the video says, where its camera looks (``R_lab_cam``), and the true offset in s."""
    filmed = played(whole, settings.frames, settings.rate, settings.desync_frames)
    errors = PriorError(
        noise=settings.video_noise,
        bias_deg=settings.video_bias_deg,
        wander_deg=settings.video_wander_deg,
        tilt_deg=settings.video_tilt_deg,
        lost=settings.video_lost,
        flips=settings.video_flips,
    )
    prior, R_lab_cam, _ = corrupt_prior(filmed, stream(seed, "video"), errors)
    if settings.video_wrong_shape:
        prior = other_shape(prior, shape_count, stream(seed, "wrong shape"))
    return prior, R_lab_cam, settings.desync_frames / settings.rate


def _camera(motion: Motion, body: Body, betas: np.ndarray, R_lab_cam: np.ndarray) -> dict[str, Any]:
    """``K``, ``R``, ``t`` and ``image_size`` of a camera that has the person in the middle of its picture."""
    joints = body.pose(motion.rotations, betas, motion.trans, want_vertices=False)[1]
    width, height = _IMAGE
    R = R_lab_cam.T
    return {
        "K": np.array([[_FOCAL, 0, (width - 1) / 2], [0, _FOCAL, (height - 1) / 2], [0, 0, 1]]),
        "R": R,
        "t": np.array([0, 0, _DEPTH]) - R @ np.asarray(joints).mean(axis=(0, 1)),
        "image_size": _IMAGE,
    }
