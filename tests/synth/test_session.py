"""Whole sessions: what is drawn has the size it is said to have, and changing one thing changes that alone."""

from __future__ import annotations

from dataclasses import fields, replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, PARTS
from markerscope.solver.synth import demo_motion
from markerscope.solver.synth.files import nearest_shape
from markerscope.solver.synth.session import SynthSession, SynthSettings, synthesise
from markerscope.solver.synth.source import read_source
from markerscope.solver.synth.swaps import holders

PLAIN = SynthSettings(frames=90)


def made(motion: str = "kick", seed: int = 5, **changed: object) -> SynthSession:
    return synthesise(motion, replace(PLAIN, **changed), seed)


@pytest.fixture(scope="module")
def plain() -> SynthSession:
    return made()


def test_the_same_seed_and_settings_give_the_same_numbers(plain: SynthSession) -> None:
    again, other = made(), made(seed=6)
    for get in (
        lambda s: s.markers.positions,
        lambda s: s.prior.rotations,
        lambda s: s.truth.body.template,
        lambda s: s.truth.betas,
        lambda s: s.truth.marker_vertex,
        lambda s: s.truth.motion.rotations,
        lambda s: s.truth.R,
    ):
        np.testing.assert_array_equal(get(plain), get(again))
        assert not np.array_equal(get(plain), get(other))
    assert plain.markers.positions.shape == (90, 40, 3) and plain.prior.rotations.shape == (90, 24, 3, 3)
    assert plain.markers.rate == 30 and plain.nominal_offset == plain.truth.offset == 0


@pytest.mark.parametrize(
    "changed",
    [
        {"lost": 0.1},
        {"hidden_chance": 0.01},
        {"ghosts": 4},
        {"swaps": 3},
        {"video_noise": 3.0},
        {"video_lost": 0.3},
        {"video_flips": 2},
        {"video_wrong_shape": True},
        {"desync_frames": 6},
        {"desync_frames": -6},
        {"jitter_mm": 2.0},
        {"slide": 2.0},
        {"offset_spread_mm": 3.0},
        {"markers": 20},
        {"part": "left_arm", "markers": 10},
        {"layout": "full_body"},
    ],
    ids=str,
)
def test_one_change_leaves_all_else_as_it_was(plain: SynthSession, changed: dict) -> None:
    other = made(**changed)
    np.testing.assert_array_equal(plain.truth.body.template, other.truth.body.template)
    np.testing.assert_array_equal(plain.truth.motion.rotations, other.truth.motion.rotations)
    np.testing.assert_array_equal(plain.truth.motion.trans, other.truth.motion.trans)
    np.testing.assert_array_equal(plain.truth.R, other.truth.R)
    name = next(iter(changed))
    if not name.startswith(("video", "desync")):
        np.testing.assert_array_equal(plain.prior.rotations, other.prior.rotations)
    if name.startswith(("video", "desync")):
        np.testing.assert_array_equal(plain.markers.positions, other.markers.positions)
    if name in ("ghosts", "lost", "hidden_chance"):
        real = other.truth.marker_joint >= 0
        np.testing.assert_array_equal(plain.truth.marker_vertex, other.truth.marker_vertex[real])
        kept = other.markers.present[:, real]
        np.testing.assert_array_equal(other.markers.positions[:, real][kept], plain.markers.positions[kept])
        assert kept.all() == (name == "ghosts")
    if name in ("jitter_mm", "slide", "offset_spread_mm"):
        np.testing.assert_array_equal(plain.truth.marker_vertex, other.truth.marker_vertex)


@pytest.mark.parametrize("part", [None, "right_leg"])
def test_fewer_markers_are_some_of_more_and_move_as_they_did(part: str | None) -> None:
    counts = (50, 40, 30, 20) if part is None else (20, 15, 10)
    sessions = [made(markers=n, part=part, lost=0.0) for n in counts]
    for more, less in pairwise(sessions):
        apart = np.abs(more.markers.positions[:, :, None] - less.markers.positions[:, None]).max(axis=(0, 3))
        assert apart.min(axis=0).max() < 1e-12
    own = [made(markers=n, part=part, nested=False).truth.marker_vertex for n in counts[:2]]
    assert len(set(own[0]) & set(own[1])) < 5


def test_jitter_height_and_slide_have_their_sizes() -> None:
    still = {"slide": 0.0, "jitter_mm": 0.0, "offset_spread_mm": 0.0}
    ideal = made(**still)
    np.testing.assert_array_equal(ideal.markers.positions, ideal.truth.paths)
    shaken = made(**still | {"jitter_mm": 0.7})
    error = 1000 * (shaken.markers.positions - shaken.truth.paths)
    assert error.std() == pytest.approx(0.7, rel=0.03)
    assert np.abs(np.corrcoef(error[:-1, :, 0].ravel(), error[1:, :, 0].ravel())[0, 1]) < 0.1, "jitter is not white"
    even, uneven = (made(**still | {"offset_spread_mm": s, "markers": 200}) for s in (0.0, 2.0))
    apart = 1000 * np.linalg.norm(uneven.truth.paths - even.truth.paths, axis=2)
    np.testing.assert_allclose(apart, np.broadcast_to(apart[0], apart.shape), atol=1e-9)
    assert np.sqrt((apart[0] ** 2).mean()) == pytest.approx(2.0, rel=0.15)
    moved = made(**still | {"slide": 1.0})
    slide = 1000 * np.linalg.norm(moved.truth.paths - ideal.truth.paths, axis=2)
    assert 1.5 < slide.mean() < 6, f"skin slides by {slide.mean():.1f} mm"
    quiet = made(**still | {"slide": 1.0, "still": 0.02}).truth.paths - made(**still | {"still": 0.02}).truth.paths
    assert 1000 * np.linalg.norm(quiet, axis=2).mean() < 0.2


def test_the_truth_names_who_is_in_each_column() -> None:
    session = made(ghosts=5, swaps=6, lost=0.1)
    truth = session.truth
    ghost = truth.marker_joint < 0
    assert ghost.sum() == 5 and (truth.marker_vertex[ghost] == -1).all()
    assert np.isnan(truth.paths[:, ghost]).all() and np.isfinite(truth.paths[:, ~ghost]).all()
    off = np.linalg.norm(session.markers.positions - truth.paths, axis=2)[:, ~ghost]
    assert np.nanmax(off) < 0.004, "a column is not where the truth has its marker"
    assert session.markers.present[:, ~ghost].mean() == pytest.approx(0.9, abs=0.001)
    jump = np.linalg.norm(np.diff(truth.paths, axis=0), axis=2)
    unswapped = made(ghosts=5, swaps=0, lost=0.1)
    usual = np.linalg.norm(np.diff(unswapped.truth.paths, axis=0), axis=2)
    for a, b, start, stop in truth.swaps:
        assert jump[start - 1, a] > np.nanmax(usual[:, a]) or jump[start - 1, b] > np.nanmax(usual[:, b])
        assert truth.carrier[start - 1, a] >= 0 and truth.carrier[start - 1, b] >= 0 and stop > start
    held = holders(truth.swaps, 90, 45)
    back = np.take_along_axis(truth.paths, np.argsort(held, axis=1)[:, :, None], axis=1)
    np.testing.assert_array_equal(back, unswapped.truth.paths)
    mode = [np.bincount(column + 1).argmax() - 1 for column in truth.carrier.T]
    assert np.mean(np.array(mode) == truth.marker_joint) > 0.95


@pytest.mark.parametrize("part", PARTS)
def test_a_part_alone_has_markers(part: str) -> None:
    session = made(part=part, markers=10)
    assert {JOINTS[j] for j in session.truth.marker_joint} == set(PARTS[part])
    assert session.markers.positions.shape[1] == 10
    named = made(layout=part)
    assert {JOINTS[j] for j in named.truth.marker_joint} <= set(PARTS[part])


def test_bodies_inside_the_basis_can_be_reached_and_those_outside_cannot() -> None:
    solver_body = with_bone_lengths(Body.load())
    for shape, low, high in (("inside", 0, 1e-6), ("outside", 1e-3, 2e-2)):
        for seed in range(3):
            truth = made(shape=shape, seed=seed, frames=2).truth
            rest = truth.body.surface(truth.betas) - solver_body.surface(nearest_shape(solver_body, truth))
            rest -= rest.mean(axis=0)
            off = np.sqrt((rest**2).sum(axis=1).mean())
            assert low <= off <= high, f"{shape}: {1000 * off:.2f} mm"
    lengths = []
    for seed in range(30):
        joints = made(shape="inside", spread=0.0, seed=seed, frames=2).truth.joints[0]
        lengths.append(np.linalg.norm(joints[INDEX["left_knee"]] - joints[INDEX["left_hip"]]))
    assert np.std(lengths) / np.mean(lengths) == pytest.approx(0.03, rel=0.5)


@pytest.mark.parametrize("frames", [6, -6])
def test_a_late_clock_is_late_by_what_the_truth_says(frames: int) -> None:
    session = made(desync_frames=frames, video_noise=0.0)
    truth, prior = session.truth, session.prior
    assert truth.offset == pytest.approx(frames / 30) and session.nominal_offset == 0
    seen = prior.rotations.copy()
    seen[:, 0] = truth.R.T @ seen[:, 0]
    shift = prior.time + truth.offset
    inside = (shift >= 0) & (shift <= truth.motion.time[-1] + 1e-9)
    at = np.round(shift[inside] * 30).astype(int)
    np.testing.assert_allclose(seen[inside], truth.motion.rotations[at], atol=1e-9)
    assert inside.sum() == 84


def test_the_camera_sees_the_person_in_the_middle_of_its_picture(plain: SynthSession) -> None:
    truth = plain.truth
    seen = truth.joints @ truth.R.T + truth.t
    assert seen[..., 2].min() > 1
    pixels = (seen @ truth.K.T)[..., :2] / seen[..., 2:]
    np.testing.assert_allclose(pixels.mean(axis=(0, 1)), [639.5, 359.5], atol=40)
    head, pelvis = pixels[:, INDEX["head"], 1], pixels[:, 0, 1]
    assert (head < pelvis).all(), "y is down"
    spread = [log_so3(made(seed=s, frames=2).truth.R[None])[0] for s in range(6)]
    assert np.std(spread, axis=0).max() > 0.5, "the camera always looks the same way"


def test_a_wrong_shape_is_somebody_s() -> None:
    assert made(frames=2).prior.betas is None
    shapes = [made(frames=2, seed=s, video_wrong_shape=True) for s in range(3)]
    assert all(np.abs(s.prior.betas - s.truth.betas).max() > 0.5 for s in shapes)


@pytest.mark.parametrize(
    "name",
    ["cmu/02_03.amc", "cmu/02_04.amc", "bandai/dataset-1_punch_normal_001.bvh", "bandai/dataset-2_run_active_001.bvh"],
)
def test_recorded_motions_are_played_for_as_long_as_is_wanted(shared_data: Path, name: str) -> None:
    session = synthesise(read_source(shared_data / "motion" / name), replace(PLAIN, frames=300), 2)
    truth = session.truth
    assert session.markers.positions.shape == (300, 40, 3) and session.markers.present.all()
    assert session.motion.endswith(Path(name).name)
    skin = truth.surface(slice(0, 300, 6))[0]
    lowest = skin[..., 2].min(axis=1)
    assert -0.06 < np.percentile(lowest, 10) < 0.03, f"soles at {1000 * np.percentile(lowest, 10):.0f} mm"
    speed = np.linalg.norm(np.diff(truth.joints, axis=0), axis=2) * 30
    assert speed.max() < 15, f"{speed.max():.0f} m/s"
    own = np.linalg.norm(
        truth.paths[::6] - np.take_along_axis(skin, truth.marker_vertex[None, :, None], axis=1), axis=2
    )
    assert np.median(own) < 0.016 and own.max() < 0.06


def test_a_given_motion_stands_on_the_session_s_own_legs() -> None:
    body = Body.load()
    given = demo_motion(body, np.zeros(10), seconds=4, rate=60)
    for seed in range(3):
        truth = synthesise(given, replace(PLAIN, spread=1.5), seed).truth
        lowest = truth.surface(slice(0, 90, 5))[0][..., 2].min(axis=1)
        assert np.abs(lowest).max() < 0.03, f"{1000 * np.abs(lowest).max():.0f} mm"


def test_a_near_still_subject_hardly_moves(plain: SynthSession) -> None:
    quiet = made(still=0.05, jitter_mm=0.0, slide=0.0)
    moved = [np.ptp(s.truth.paths, axis=0).max() for s in (plain, quiet)]
    assert moved[1] < 0.12 * moved[0]
    assert quiet.truth.surface(slice(0, 1))[0][..., 2].min() == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize(
    ("changed", "says"),
    [
        ({"part": "tail"}, '--part: "tail" is not known; choose one of left_arm, left_leg'),
        ({"layout": "vicon"}, '--layout: "vicon" is not known; choose one of uniform, full_body'),
        ({"shape": "round"}, "--shape"),
        ({"lost": 1.0}, "--lost: 1 is not possible; give a number from 0 to 0.9"),
        ({"frames": 1}, "--frames: 1 is not possible"),
        ({"rate": float("nan")}, "--rate: nan is not possible"),
        ({"markers": -4}, "--markers"),
        ({"still": -1.0}, "--still"),
        ({"part": "left_arm", "layout": "right_arm"}, 'the layout "right_arm" is not on the left arm'),
    ],
)
def test_settings_that_cannot_be_are_refused(changed: dict, says: str) -> None:
    with pytest.raises(InputError) as refused:
        replace(PLAIN, **changed)
    assert says in str(refused.value)


def test_every_setting_is_described_with_its_default() -> None:
    text = (Path(__file__).parents[2] / "docs" / "synthetic.md").read_text(encoding="utf-8")
    rows = {
        row.split("|")[1].strip().strip("`"): row.split("|")[2].strip() for row in text.splitlines() if "| `--" in row
    }
    for field in fields(SynthSettings):
        if field.name == "nested":
            assert "--no-nested" in rows
            continue
        told = rows[f"--{field.name.replace('_', '-')}"]
        words = {None: "none", False: "no"}
        said = words.get(field.default) if field.default is None or field.default is False else None
        assert told == (said or (field.default if isinstance(field.default, str) else f"{field.default:g}")), field.name
