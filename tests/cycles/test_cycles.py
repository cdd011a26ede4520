"""Cycles, their statistics and scores: known curves in, known figures out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.body.model import Body
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.rotations import exp_so3
from markerscope.solver.core.skeleton import INDEX
from markerscope.solver.cycles.curve import Curve, CutCurve, cut_all, peaks_of, summary_of, symmetry
from markerscope.solver.cycles.cycle import Cycle, cut, gait_cycles, judged, left_out, repetition_cycles
from markerscope.solver.cycles.gait import gait_curves, progression
from markerscope.solver.cycles.request import FilterRequest, parse_filter, parse_leave_out
from markerscope.solver.cycles.scores import PROFILE, Band, bands_of, profile_of, variable_score, z_scores
from markerscope.solver.cycles.steps import DEFINITIONS, step_table
from markerscope.solver.events.event import Event
from markerscope.solver.events.feet import Feet, Foot
from markerscope.solver.figures.gait_page import gait_page
from markerscope.solver.figures.pdf import pdf
from markerscope.solver.figures.svg import svg
from markerscope.solver.io.cycles_csv import MEANS, read_bands, table
from markerscope.solver.synth.acts import act

PERCENT = np.linspace(0, 1, 101)


def steps_at(*rows: tuple[float, str, str]) -> list[Event]:
    return [Event(time, side, kind, "hand") for time, side, kind in rows]  # type: ignore[arg-type]


EVENTS = steps_at(
    (0.0, "left", "foot_strike"),
    (0.12, "right", "foot_off"),
    (0.5, "right", "foot_strike"),
    (0.62, "left", "foot_off"),
    (1.0, "left", "foot_strike"),
    (1.14, "right", "foot_off"),
    (1.5, "right", "foot_strike"),
    (1.66, "left", "foot_off"),
    (2.2, "left", "foot_strike"),
    (7.0, "left", "foot_strike"),
)


def test_cycles_go_from_strike_to_strike_and_say_why_not() -> None:
    cycles = gait_cycles(EVENTS)
    assert [(c.name, c.start, c.end) for c in cycles if c.used] == [
        ("left 1", 0.0, 1.0),
        ("left 2", 1.0, 2.2),
        ("right 1", 0.5, 1.5),
    ]
    assert cycles[0].percent(cycles[0].off) == pytest.approx(62) and cycles[0].other_strike == 0.5
    assert "4.80 s" in next(c for c in cycles if not c.used).why_not


def test_a_cycle_is_left_out_by_hand_with_its_reason_or_where_much_is_lost() -> None:
    time = np.arange(300) / 100
    present = np.ones((300, 2), bool)
    present[110:190] = False
    cycles = judged(gait_cycles(EVENTS), time, present)
    assert "are lost" in next(c for c in cycles if c.name == "left 2").why_not
    assert next(c for c in cycles if c.name == "left 1").used
    cycles = left_out(cycles, {"left 1": "stumbled"}, "--leave-out")
    assert next(c for c in cycles if c.name == "left 1").why_not == "stumbled"
    with pytest.raises(InputError, match="there is no cycle 'left 9'"):
        left_out(cycles, {"left 9": "stumbled"}, "--leave-out")
    assert parse_leave_out("a/b/left 2:  fell: twice ") == ("a/b/left 2", "fell: twice")
    with pytest.raises(InputError, match="is not understood"):
        parse_leave_out("left 2")


def test_a_cut_curve_is_the_curve_and_gaps_stay() -> None:
    time = np.arange(500) / 100
    cycle = Cycle("left", 1, 1.2345, 2.3456)
    wanted = np.linspace(cycle.start, cycle.end, 101)
    assert np.abs(cut(time, np.sin(3 * time), cycle) - np.sin(3 * wanted)).max() < 1e-6
    broken = np.where((time > 1.5) & (time < 1.9), np.nan, np.sin(3 * time))
    known = np.isfinite(cut(time, broken, cycle))
    assert not known[(wanted > 1.52) & (wanted < 1.88)].any() and known[(wanted < 1.49) | (wanted > 1.91)].all()


def test_mean_and_spread_are_those_of_numpy() -> None:
    values = np.random.default_rng(0).normal(0, 1, (7, 101))
    found = summary_of(values)
    assert np.allclose(found.mean, values.mean(axis=0)) and np.allclose(found.sd, values.std(axis=0, ddof=1))
    assert np.allclose(found.p95, np.percentile(values, 95, axis=0)) and (found.count == 7).all()
    assert np.isnan(summary_of(values[:1]).sd).all(), "one curve has no spread"


def test_ranges_peaks_and_their_times() -> None:
    time = np.arange(300) / 100
    curve = Curve("knee", "left", "degrees", time, 10 + 50 * np.sin(np.pi * (time % 1.0)) ** 2)
    (one,) = cut_all([("t", [curve], gait_cycles(EVENTS[:5]))])
    figures = {row.quantity: row.value for row in peaks_of(one)}
    assert figures["knee range"] == pytest.approx(50, abs=0.01) and figures["knee maximum"] == pytest.approx(
        60, abs=0.01
    )
    assert figures["knee time of maximum"] == 50
    assert symmetry(40.0, 60.0) == pytest.approx(40.0)
    assert np.abs(curve.velocity.values[3:97]).max() == pytest.approx(50 * np.pi, rel=0.01)


def of(name: str, side: str, values: np.ndarray) -> CutCurve:
    cycles = tuple(Cycle(side, i + 1, 0.0, 1.0, 0.6) for i in range(len(values)))
    return CutCurve(name, side, "degrees", values, ("t",) * len(values), cycles)


def test_scores_against_controls() -> None:
    band = Band(10 * np.sin(6 * PERCENT), np.full(101, 2.0), 12)
    away = of("hip_flexion", "left", (band.mean + 5)[None])
    assert variable_score(away.summary.mean, band) == pytest.approx(5)
    assert np.allclose(z_scores(away.summary, band), 2.5)
    bands = {(name, ""): band for name in PROFILE}
    left = [of(name, "left", (band.mean + 3)[None]) for name in PROFILE]
    right = [of(name, "right", (band.mean + 6)[None]) for name in PROFILE]
    found = profile_of([*left, *right], bands)
    assert (found.left, found.right) == (pytest.approx(3), pytest.approx(6))
    assert found.both == pytest.approx(np.sqrt((9 * 9 + 6 * 36) / 15)), "the pelvis counts once"
    part = profile_of(left[:-1], bands)
    assert np.isnan(part.left) and "foot_progression, left" in part.missing


def test_own_controls_count_people_and_not_cycles() -> None:
    rng = np.random.default_rng(0)
    levels = {"a": 0.0, "b": 4.0, "c": 8.0}
    curves, trials = [], []
    for name, level in levels.items():
        for _ in range(1 if name == "a" else 20):
            curves.append(level + rng.normal(0, 1e-6, 101))
            trials.append(name)
    cycles = tuple(Cycle("left", i + 1, 0, 1) for i in range(len(curves)))
    one = CutCurve("knee", "left", "degrees", np.array(curves), tuple(trials), cycles)
    band = bands_of([one], {name: name for name in levels})["knee", ""]
    assert np.allclose(band.mean, 4, atol=1e-4) and np.allclose(band.sd, 4, atol=1e-4) and band.count == 3


def test_bands_are_read_as_the_means_are_written(tmp_path: Path) -> None:
    path = tmp_path / "mean.csv"
    rows = [["knee", "left", "degrees", k, 5, 2.0 * k, 1.5, 0, 0, 0, 0, 0, "none"] for k in range(101)]
    path.write_text(table(MEANS, rows))
    mean, sd = read_bands(path)["knee", "left"]
    assert np.allclose(mean, 2.0 * np.arange(101)) and (sd == 1.5).all()
    path.write_text(table(MEANS, rows[:60]))
    with pytest.raises(InputError, match="does not go from 0 to 100 percent for knee"):
        read_bands(path)
    path.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="has no columns quantity"):
        read_bands(path)


def test_distances_and_times_of_steps_are_those_walked() -> None:
    time = np.arange(400) / 100
    way, across = np.array([0.6, 0.8, 0]), np.array([-0.8, 0.6, 0])
    pelvis = 1.2 * time[:, None] * way

    def foot(first: float, beside: float) -> Foot:
        ahead = 0.3 + 1.2 * (first + np.floor(time - first + 1e-9))
        heel = ahead[:, None] * way + beside * across
        return Foot(heel, heel + 0.2 * way)

    feet = Feet(time, 100.0, {"left": foot(0.0, 0.1), "right": foot(0.5, -0.05)}, pelvis, "made up")
    ahead = progression(feet)[0]
    assert np.allclose(ahead, way[:2], atol=1e-9)
    rows = step_table("t", feet, gait_cycles(EVENTS[:5]), ahead)
    found = {row.quantity: row.value for row in rows}
    assert set(found) == set(DEFINITIONS)
    told = {
        "stride time": 1.0, "step time": 0.5, "cadence": 120, "stance": 62, "swing": 38, "double support": 24,
        "single support": 38, "stride length": 1.2, "step length": 0.6, "step width": 0.15, "walking speed": 1.2,
    }  # fmt: skip
    for name, value in told.items():
        assert found[name] == pytest.approx(value, abs=1e-6), name
    still = Feet(time, 100.0, feet.sides, 0 * pelvis, "treadmill")
    found = {row.quantity: row.value for row in step_table("t", still, gait_cycles(EVENTS[:5]), ahead)}
    assert np.isnan(found["stride length"]) and found["stance"] == pytest.approx(62)


def test_gait_curves_do_not_depend_on_where_in_the_lab_somebody_walks() -> None:
    body = Body.load()
    betas = np.zeros(body.shape_count)
    motion = act("walk", body, betas, seconds=3, rate=50, rng=np.random.default_rng(0))
    landmarks, rest = body.landmarks(betas), body.joints(betas)
    from markerscope.solver.angles.angles import world_rotations

    turn = world_rotations(motion.rotations)
    ahead = np.broadcast_to([1.0, 0.0], (len(turn), 2))
    angle = 0.7
    about = exp_so3(np.array([0, 0, angle]))
    turned = gait_curves(motion.time, about @ turn, landmarks, rest, ahead @ about[:2, :2].T)
    for one, other in zip(gait_curves(motion.time, turn, landmarks, rest, ahead), turned, strict=True):
        off = (one.values - other.values + 180) % 360 - 180
        assert np.nanmax(np.abs(off)) < 1e-6, one.name


@pytest.mark.parametrize(("side", "sign"), [("left", -1), ("right", 1)])
def test_toes_in_are_positive_on_both_sides(side: str, sign: int) -> None:
    body = Body.load()
    betas = np.zeros(body.shape_count)
    upright = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # faces along x, z up
    turn = np.broadcast_to(upright, (5, 24, 3, 3)).copy()
    turn[:, INDEX[f"{side}_ankle"]] = exp_so3(np.array([0, 0, np.radians(10) * sign])) @ upright
    ahead = np.broadcast_to([1.0, 0.0], (5, 2))
    curves = gait_curves(np.arange(5) / 50, turn, body.landmarks(betas), body.joints(betas), ahead)
    at = {(c.name, c.side): c.values[0] for c in curves}
    other = "right" if side == "left" else "left"
    assert at["foot_progression", side] - at["foot_progression", other] == pytest.approx(10, abs=1.5)


def test_the_page_has_both_sides_and_is_a_whole_file_in_either_format() -> None:
    rng = np.random.default_rng(0)
    names = [*PROFILE, "trunk_flexion"]
    curves = [of(n, s, 10 * np.sin(6 * PERCENT) + rng.normal(0, 1, (4, 1))) for n in names for s in ("left", "right")]
    page = gait_page(curves, "A & B <1>", {("hip_flexion", ""): Band(PERCENT, PERCENT + 1, 9)})
    drawn = svg(page)
    assert "A &amp; B &lt;1&gt;" in drawn and "left (4 cycles)" in drawn and "controls, mean and SD (9 people)" in drawn
    assert drawn.count('stroke="#c71a21"') > len(names) and "nan" not in drawn
    made = pdf(page)
    start = int(made.rsplit(b"startxref\n", 1)[1].split()[0])
    assert made.startswith(b"%PDF-1.4") and made[start : start + 4] == b"xref" and made.endswith(b"%%EOF\n")
    for number, line in enumerate(made[start:].split(b"\n")[3:8], 1):
        place = int(line.split()[0])
        assert made[place:].startswith(f"{number} 0 obj".encode())


def test_repetitions_make_cycles() -> None:
    rows = [(1.0, "start"), (1.5, "turn"), (2.0, "end"), (3.0, "start"), (3.4, "turn"), (4.0, "end")]
    events = [Event(t, "general", kind, "angle") for t, kind in rows]  # type: ignore[arg-type]
    assert [(c.name, c.start, c.end, c.off) for c in repetition_cycles(events)] == [
        ("general 1", 1.0, 2.0, 1.5),
        ("general 2", 3.0, 4.0, 3.4),
    ]
    with pytest.raises(InputError, match="do not come in turns"):
        repetition_cycles(events[:-1])


@pytest.mark.parametrize(
    ("text", "means"),
    [
        ("none", FilterRequest()),
        ("spline", FilterRequest("spline")),
        ("butterworth:6", FilterRequest("butterworth", 6.0, 4)),
        ("butterworth:7.5:2", FilterRequest("butterworth", 7.5, 2)),
        ("butterworth:auto", FilterRequest("butterworth", None, 4)),
    ],
)
def test_filters_are_read(text: str, means: FilterRequest) -> None:
    assert parse_filter(text) == means


@pytest.mark.parametrize("text", ["butterworth", "butterworth:-1", "butterworth:6:3", "butterworth:x", "median", ""])
def test_what_is_no_filter_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="--filter"):
        parse_filter(text)
