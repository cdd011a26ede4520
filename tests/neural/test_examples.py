"""Markers made for networks are where the body itself has them, and seen from the waist they do not turn."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.bones import with_bone_lengths
from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3, log_so3
from markerscope.solver.core.skeleton import INDEX, JOINTS, mirror_index
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.neural import kinematics
from markerscope.solver.neural.align import align, frame_weights, into, out_of
from markerscope.solver.neural.layout import LAYOUTS, named_layout, session_layout
from markerscope.solver.neural.training.examples import ExampleSettings, Sampler, body_pool, generator
from markerscope.solver.neural.training.library import Clip, by_kind, kind_of, load_library, procedural_clips
from markerscope.solver.neural.training.procedural import free_motion
from markerscope.solver.synth.body import vary_body

torch = pytest.importorskip("torch", reason="torch is not installed here")

PLAIN = ExampleSettings(
    spread=0.0, bones=0.0, placement_mm=0.0, height_mm=0.0, jitter_mm=0.0, mirrored=0.0, mixed=0.0, shaken=0.0
)


@pytest.fixture(scope="module")
def body() -> Body:
    return Body.load()


@pytest.fixture(scope="module")
def clips() -> tuple[Clip, ...]:
    return procedural_clips(4, 3, seconds=2.0)


def test_forward_kinematics_and_skinning_are_the_bodys_own(body: Body, clips: tuple[Clip, ...]) -> None:
    layout = named_layout(body, "body_hands")
    varied = vary_body(body, np.random.default_rng([5, 0]))
    sampler = Sampler(clips, body_pool(body, 1, 5, plain=False), replace(PLAIN, spread=0.8, bones=1.0))
    drawn = sampler.draw(layout, 6, generator(0))
    grown = replace(with_bone_lengths(body), template=varied.template, joint_template=varied.joint_template, _torch={})
    for b in range(6):
        # Which shape was drawn is not told, but the joints at rest are linear in it.
        rest = drawn.rest_joints[b].numpy().astype(float)
        basis = grown.joint_dirs.reshape(-1, grown.shape_count)
        betas = np.linalg.lstsq(basis, (rest - grown.joint_template).ravel(), rcond=None)[0]
        rotations = drawn.rotations[b : b + 1].numpy().astype(float)
        _, joints = grown.pose(rotations, betas, np.zeros((1, 3)), want_vertices=False)
        shift = drawn.joints[b, 0].numpy() - joints[0, 0]
        assert np.abs(joints[0] + shift - drawn.joints[b].numpy()).max() < 1e-4
        moved = grown.template.copy()
        moved[layout.vertex] += layout.offset
        skin, _ = replace(grown, template=moved, _torch={}).pose(rotations, betas, shift[None], layout.vertex)
        off = np.abs(skin[0] - drawn.markers[b].numpy()).max()
        assert off < 2e-4, f"markers are {1000 * off:.2f} mm from where the body has them"


def test_a_draw_is_a_function_of_its_generator(body: Body, clips: tuple[Clip, ...]) -> None:
    layout = named_layout(body, "full_body")
    sampler = Sampler(clips, body_pool(body, 2, 0), ExampleSettings(fingers=True))
    one, same, other = (sampler.draw(layout, 5, generator(seed), window=7) for seed in (1, 1, 2))
    assert torch.equal(one.markers, same.markers) and torch.equal(one.rotations, same.rotations)
    assert not torch.equal(one.markers, other.markers)
    assert one.markers.shape == (35, 47, 3)
    rotations = one.rotations
    error = (rotations.transpose(-1, -2) @ rotations - torch.eye(3)).abs().max()
    assert error < 1e-5 and (torch.linalg.det(rotations) > 0.99).all()
    # One body throughout a window, and motion that goes on from frame to frame.
    joints = one.rest_joints.unflatten(0, (5, 7))
    assert torch.equal(joints[:, 0], joints[:, 6])
    step = (one.joints.unflatten(0, (5, 7)).diff(dim=1)).norm(dim=-1).max()
    assert step < 0.25, f"a joint jumps by {step:.2f} m"


def test_vertices_may_differ_from_example_to_example(body: Body, clips: tuple[Clip, ...]) -> None:
    layout = named_layout(body, "full_body")
    sampler = Sampler(clips, body_pool(body, 1, 0), PLAIN)
    vertex = torch.as_tensor(layout.vertex).expand(5, -1)
    one, other = sampler.draw(layout, 5, generator(1)), sampler.draw(vertex, 5, generator(1))
    assert (one.markers - other.markers).abs().max() < 1e-4
    assert torch.allclose(one.offsets(layout.joint), one.rest_markers - one.rest_joints[:, layout.joint])


def test_mirrored_examples_are_people_too(body: Body, clips: tuple[Clip, ...]) -> None:
    layout = named_layout(body, "full_body")
    pool = body_pool(body, 0, 0)
    one = Sampler(clips, pool, PLAIN).draw(layout, 4, generator(1))
    other = Sampler(clips, pool, replace(PLAIN, mirrored=1.0)).draw(layout, 4, generator(1))
    # The embedded body is symmetric: its mirrored pose is the mirror image, but for the heading that is drawn.
    place = {label: i for i, label in enumerate(layout.labels) if label != "right_scapula"}
    own, swapped = list(place.values()), [place[_other(label)] for label in place]
    cases = (
        (one.joints, other.joints[:, mirror_index()], 1e-4),
        (one.markers[:, own], other.markers[:, swapped], 0.012),  # the nearest vertices of two sides differ a little
    )
    for points, images, most in cases:
        apart = (torch.cdist(points, points) - torch.cdist(images, images)).abs().max()
        assert apart < most, f"distances differ by {1000 * apart:.1f} mm"


def _other(label: str) -> str:
    side, _, rest = label.partition("_")
    return f"{'right' if side == 'left' else 'left'}_{rest}" if side in ("left", "right") else label


def test_free_motion_is_smooth_and_keeps_within_what_joints_can_do() -> None:
    motion = free_motion(5.0, 60.0, np.random.default_rng(0))
    angle = np.linalg.norm(log_so3(motion.rotations), axis=2)
    assert angle[:, INDEX["left_knee"]].max() < 2.6 and angle[:, INDEX["spine2"]].max() < 0.8
    step = np.linalg.norm(log_so3(motion.rotations[:-1].swapaxes(-1, -2) @ motion.rotations[1:]), axis=2)
    assert step.max() < 0.5, f"a joint turns by {step.max():.2f} rad in a sixtieth of a second"
    assert angle[:, INDEX["right_shoulder"]].std() > 0.1


def test_made_clips_begin_alike_and_are_seeded() -> None:
    few, more = procedural_clips(2, 1, seconds=1.0), procedural_clips(3, 1, seconds=1.0)
    assert all(np.array_equal(a.rotations, b.rotations) for a, b in zip(few, more))
    assert not np.array_equal(more[0].rotations, more[2].rotations)
    learnt, unseen = by_kind(more, ["free"])
    assert [clip.kind for clip in learnt] == ["made walk"] and len(unseen) == 2


@pytest.mark.parametrize(
    ("stem", "kind"),
    [("dataset-1_walk_normal_001", "walk"), ("02_05", "punch"), ("17_03", "17_03"), ("Jump take 2", "jump")],
)
def test_kinds_are_told_from_names(stem: str, kind: str) -> None:
    assert kind_of(stem) == kind


def test_a_library_is_read_from_folders(shared_data: Path, tmp_path: Path) -> None:
    clips = load_library([shared_data / "motion" / "bandai"], rate=30.0)
    assert {"walk", "kick", "run"} <= {clip.kind for clip in clips} and all(clip.rate == 30 for clip in clips)
    with pytest.raises(InputError, match="no motion"):
        load_library([tmp_path])
    with pytest.raises(InputError, match="no such folder"):
        load_library([tmp_path / "none"])


@pytest.mark.parametrize("name", LAYOUTS)
def test_named_layouts_are_on_the_bones_they_are_named_after(body: Body, name: str) -> None:
    layout = named_layout(body, name)  # type: ignore[arg-type]
    assert len(set(layout.vertex)) == len(layout) == {"full_body": 47, "body_53": 53, "body_hands": 63}[name]
    sides = [JOINTS[j].partition("_")[0] for j in layout.joint]
    for label, side in zip(layout.labels, sides):
        assert side in (label.partition("_")[0], "spine1", "spine2", "spine3", "head", "neck", "pelvis"), label
    assert np.allclose(np.linalg.norm(layout.offset, axis=1), 9.5e-3)
    hands = {label for label, group in zip(layout.labels, layout.group) if group != "body"}
    assert all("wrist" in h or "hand" in h or "thumb" in h or "index" in h or "little" in h for h in hands)
    assert layout.digest == named_layout(body, name).digest  # type: ignore[arg-type]
    assert layout.digest != layout.select(np.arange(len(layout) - 1)).digest
    back = type(layout).from_plain(layout.plain())
    assert back.digest == layout.digest and back.labels == layout.labels


def test_the_layout_of_a_session_is_what_the_fit_found(body: Body, clips: tuple[Clip, ...]) -> None:
    rng = np.random.default_rng(0)
    grown = with_bone_lengths(body)
    betas = rng.normal(0, 0.5, grown.shape_count)
    vertex = rng.choice(np.flatnonzero(body.marker_mask), 12, replace=False)
    offset = rng.normal(0, 0.01, (12, 3))
    rotations, trans = clips[0].rotations[::10].astype(float), clips[0].trans[::10].astype(float)
    moved = grown.template.copy()
    moved[vertex] += offset
    placed, joints = replace(grown, template=moved, _torch={}).pose(rotations, betas, trans, vertex)
    joint = body.weights[vertex].argmax(axis=1)
    joint[3] = -1
    nothing = np.full(placed.shape[:2], np.nan)
    fitted = FittedMotion(
        np.arange(len(trans)) / 60, rotations, trans, betas, joints, joint, vertex, placed, nothing, None, 0, 1.0, ()
    )  # type: ignore[arg-type]
    layout = session_layout(grown, fitted, [f"m{i}" for i in range(12)])
    kept = [i for i in range(12) if i != 3]
    assert layout.labels == tuple(f"m{i}" for i in kept) and layout.columns.tolist() == kept
    off = np.abs(layout.offset - offset[kept]).max()
    assert off < 2e-3, f"{1000 * off:.2f} mm off"  # blended skin is not quite rigid
    fitted = replace(fitted, marker_joint=np.full(12, -1))
    with pytest.raises(InputError, match="fewer than 3"):
        session_layout(grown, fitted, ["m"] * 12)


@pytest.mark.parametrize(("name", "frame"), [("body_53", "waist"), ("body_hands", "left_wrist")])
@pytest.mark.parametrize("lost", [False, True])
def test_what_is_seen_does_not_depend_on_where_the_person_stands(
    body: Body, clips: tuple[Clip, ...], name: str, frame: str, lost: bool
) -> None:
    layout = named_layout(body, name)  # type: ignore[arg-type]
    sampler = Sampler(clips, body_pool(body, 1, 0), ExampleSettings())
    markers = sampler.draw(layout, 8, generator(0)).markers.double()
    if lost:
        markers[:, [layout.labels.index("left_asis"), 0]] = torch.nan
    rest = torch.as_tensor(layout.rest(body))
    turn = torch.as_tensor(exp_so3(np.random.default_rng(0).normal(0, 2, (8, 3))))
    moved = markers @ turn.transpose(1, 2) + torch.randn(8, 1, 3, dtype=torch.float64)
    local, R, t = align(markers, layout, rest, frame)  # type: ignore[arg-type]
    same, _, _ = align(moved, layout, rest, frame)  # type: ignore[arg-type]
    assert torch.allclose(local, same, atol=1e-9, equal_nan=True)
    assert torch.allclose(out_of(into(markers, R, t), R, t), markers, atol=1e-12, equal_nan=True)
    assert torch.allclose(torch.linalg.det(R), torch.ones(8, dtype=torch.float64))


def test_the_order_of_markers_does_not_matter(body: Body, clips: tuple[Clip, ...]) -> None:
    layout = named_layout(body, "full_body")
    order = np.random.default_rng(0).permutation(len(layout))
    markers = Sampler(clips, body_pool(body, 0, 0)).draw(layout, 4, generator(0)).markers.double()
    rest = torch.as_tensor(layout.rest(body))
    for chosen in (layout, replace(layout, labels=tuple(f"m{i}" for i in range(len(layout))))):
        local, _, _ = align(markers, chosen, rest)
        other, _, _ = align(markers[:, order], chosen.select(order), rest[order])
        assert torch.allclose(local[:, order], other, atol=1e-9)
    assert (frame_weights(layout)[[layout.labels.index("left_asis"), layout.labels.index("left_calcaneus")]] > 0).all()


def test_a_rest_body_is_seen_from_its_waist_as_it_is(body: Body) -> None:
    layout = named_layout(body, "full_body")
    unnamed = replace(layout, labels=tuple(f"m{i}" for i in range(len(layout))))
    rest = torch.as_tensor(layout.rest(body))
    _, R, t = align(rest[None], unnamed, rest)
    assert torch.allclose(R[0], torch.eye(3, dtype=torch.float64), atol=1e-9) and t.abs().max() < 1e-9
    _, R, _ = align(rest[None], layout, rest)
    assert (R[0] @ torch.tensor([1.0, 0, 0], dtype=torch.float64))[0] > 0.99, "x points to the left"


def test_six_numbers_make_a_rotation() -> None:
    numbers = torch.randn(100, 6, dtype=torch.float64, requires_grad=True)
    found = kinematics.orthonormal(numbers)
    eye = torch.eye(3, dtype=torch.float64)
    assert (found.transpose(-1, -2) @ found - eye).abs().max() < 1e-12 and (torch.linalg.det(found) > 0.99).all()
    given = torch.as_tensor(exp_so3(np.random.default_rng(0).normal(0, 1, (20, 3))))
    again = kinematics.orthonormal(torch.cat([3 * given[..., 0], given[..., 1] + 0.5 * given[..., 0]], -1))
    assert (again - given).abs().max() < 1e-12
    found.sum().backward()
    assert numbers.grad is not None and torch.isfinite(numbers.grad).all()


def test_rotations_go_to_the_world_and_back() -> None:
    local = torch.as_tensor(exp_so3(np.random.default_rng(0).normal(0, 1, (3, 24, 3))))
    world, _ = kinematics.forward(local, torch.zeros(3, 24, 3, dtype=torch.float64))
    assert (kinematics.local_of(world) - local).abs().max() < 1e-12
    vectors = np.random.default_rng(1).normal(0, 1, (5, 3))
    assert np.abs(kinematics.exp(torch.as_tensor(vectors)).numpy() - exp_so3(vectors)).max() < 1e-9
