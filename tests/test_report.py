"""The report: one page that holds everything, escapes what it is given and draws what it is told."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.clustering.segment import segment
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.report.report import figure, render, write_report
from markerscope.solver.report.report_data import (
    AngleCurve,
    Gaps,
    Groups,
    Headline,
    Hypothesis,
    InputFile,
    Picture,
    ReportData,
    Stage,
    marker_residuals,
)
from markerscope.solver.report.report_svg import affinity_colours, angle_plot, gaps_plot, nice_ticks, png

EVIL = "<script>alert(1)</script>\"&'"
VOID = {"meta", "img", "br", "link", "input", "hr"}


class Checker(HTMLParser):
    """Every element is closed in order; addresses lead nowhere outside."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in VOID:
            self.open.append(tag)
        for name, value in attributes:
            assert not name.startswith("on"), f"<{tag} {name}>"
            if name in ("src", "href", "xlink:href"):
                assert value and value.startswith(("data:image/png;base64,", "#")), f"<{tag} {name}={value!r:.60}>"

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attributes)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("th", "td", "tr"):
            assert self.open and self.open[-1] == tag, f"</{tag}> closes {self.open[-3:]}"
        self.open.pop()


def check(page: str) -> Checker:
    checker = Checker()
    checker.feed(page)
    checker.close()
    assert not checker.open, checker.open
    assert "script" not in checker.tags
    assert "url(" not in page and "@import" not in page and "http://" not in page and "https://" not in page
    return checker


def pixels(address: str) -> np.ndarray:
    import cv2

    data = np.frombuffer(base64.b64decode(address.partition(",")[2]), np.uint8)
    return cv2.cvtColor(cv2.imdecode(data, cv2.IMREAD_UNCHANGED), cv2.COLOR_BGRA2RGBA)


def full(count: int = 9, frames: int = 120) -> ReportData:
    rng = np.random.default_rng(0)
    time = np.arange(frames) / 100
    positions = rng.normal(size=(1, count, 3)) + np.sin(time)[:, None, None] * np.repeat(
        rng.normal(size=(3, 3)), count // 3, 0
    )
    present = rng.uniform(size=(frames, count)) > 0.1
    names = tuple(f"left_thigh_{i}{EVIL}" for i in range(count))
    found = segment(Markers(np.where(present[..., None], positions, np.nan), 100.0, names))
    knee = 40 * np.sin(3 * time)
    return ReportData(
        title=f"trial {EVIL}",
        subtitle=EVIL,
        headlines=(Headline("Markers to skin", "11.2 mm", EVIL), Headline("Confidence", "0.97")),
        warnings=(f"The left and the right leg tie {EVIL}.",),
        inputs=(InputFile("markers", EVIL, "ab" * 32, (EVIL,)),),
        groups=Groups(
            names, found.affinity, found.measured, found.linkage, found.leaves, found.order, found.cut, found.clusters
        ),
        hypotheses=(
            Hypothesis("whole body", 10.0, 2.0, {"markers": 1.5, "prior": 0.5}, chosen=True),
            Hypothesis(EVIL, 190.0, 5.0, {"markers": 4.0}, runner_up=True),
            Hypothesis("left arm", 30.0, 9.0, refined=False),
        ),
        margin=2.5,
        angles=(
            AngleCurve(EVIL, "degrees", time, {"left": knee, "right": knee + 3}, np.arange(frames) > 100),
            AngleCurve("Pelvis tilt", "degrees", time, {"": knee / 4}),
            AngleCurve("Wrist flexion", "degrees", time, {"left": knee * np.nan}),
        ),
        zero_pose=EVIL,
        residuals=marker_residuals(names, names, ("left_hip",) * count, np.where(present, 0.01, np.nan), present, time),
        gaps=Gaps(names, time, present, ~present),
        stages=(Stage("clean", {"threshold": EVIL}, 1.25), Stage("segment"), Stage(EVIL)),
        versions={"Markerscope": "1", EVIL: EVIL},
    )


def test_a_full_page_is_whole_and_escapes_what_it_is_given(tmp_path: Path) -> None:
    write_report(tmp_path / "report.html", full())
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    checker = check(page)
    assert "alert(1)</script>" not in page
    assert checker.tags.count("section") == 8
    for text in (
        "11.2 mm",
        "ab" * 32,
        "2.5 times as much",
        "runner-up",
        "given up early",
        "1.2 s",
        "from the store",
        "cut at 8 mm",
    ):
        assert text in page, text
    assert len(page) < 200_000, f"{len(page)} characters"


def test_an_empty_report_is_a_page_too() -> None:
    page = render(ReportData("nothing"))
    assert check(page).tags.count("section") == 0


def test_one_marker_and_one_frame() -> None:
    one = np.ones((1, 1))
    data = ReportData(
        "one",
        groups=Groups(
            ("a",), one * 0, one > 0, np.zeros((0, 4)), np.zeros(1, int), np.zeros(1, int), 0.008, np.zeros(1, int)
        ),
        angles=(AngleCurve("Knee", "degrees", np.zeros(1), {"left": np.ones(1)}),),
        residuals=marker_residuals(("a",), ("a",), ("",), one * np.nan, one > 2, np.zeros(1)),
        gaps=Gaps(("a",), np.zeros(1), one > 0, one > 2),
    )
    page = render(data)
    check(page)
    assert "not used" in page and "100.0 %" in page


def test_a_page_that_cannot_be_written_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        write_report(tmp_path / "nowhere" / "report.html", ReportData("x"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("margin", "words"),
    [(1.08, "8 % more: the two are close to a tie"), (1.6, "60 % more"), (3.0, "3.0 times"), (np.inf, "No different")],
)
def test_the_margin_is_put_in_words(margin: float, words: str) -> None:
    page = render(replace(full(), margin=margin))
    assert words in page, re.search(r"cheapest first\.[^<]*", page)


def test_residual_rows_say_when_a_marker_was_worst() -> None:
    residual = np.array([[0.001, 0.02], [0.009, np.nan], [0.002, 0.02]])
    rows = marker_residuals(
        ("a", "b"), ("x", "y"), ("p", "q"), residual, np.isfinite(residual), np.array([1.0, 1.5, 2.0])
    )
    assert [r.name for r in rows] == ["b", "a"]
    a = rows[1]
    assert (a.mean_mm, a.worst_mm, a.worst_time, a.lost) == pytest.approx((4.0, 9.0, 1.5, 0.0))
    assert rows[0].lost == pytest.approx(1 / 3)


def test_the_table_says_where_markers_were_drawn_only_if_any_was() -> None:
    residual = np.full((3, 2), 0.01)
    around = (("a", "b"), ("x", "y"), ("p", "q"), residual, np.isfinite(residual), np.arange(3.0))
    drawn = render(replace(full(), residuals=marker_residuals(*around, ("left asis, 96 %, 34 to 7 mm", ""))))
    assert "left asis, 96 %, 34 to 7 mm" in drawn and "on the landmark" in drawn
    assert "on the landmark" not in render(replace(full(), residuals=marker_residuals(*around)))


def test_figures() -> None:
    assert figure(float("nan")) == "–" and figure(1234.56) == "1\u202f234.6" and figure(0.5, 0) == "0"


# drawings -------------------------------------------------------------------------------------------------------------
def line_of(drawing: str, kind: str) -> str:
    return re.search(rf'class="line {kind}" d="([^"]*)"', drawing)[1]


def test_a_curve_breaks_where_it_is_unknown() -> None:
    values = np.sin(np.arange(100) / 10)
    values[40:50] = np.nan
    drawing = angle_plot(AngleCurve("Knee", "degrees", np.arange(100) / 10, {"left": values}))
    assert line_of(drawing, "left").count("M") == 2


def test_thinning_keeps_every_peak_and_gap() -> None:
    values = np.zeros(20_000)
    values[[1234, 17_000]] = 50, -70
    values[9000:9003] = np.nan
    drawing = angle_plot(AngleCurve("Knee", "degrees", np.arange(20_000) / 100, {"left": values}))
    path = line_of(drawing, "left")
    heights = np.array([float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", path)])
    assert path.count("M") == 2 and len(heights) < 1000
    middle = np.median(heights)
    assert (middle - heights.min()) / (heights.max() - middle) == pytest.approx(50 / 70, abs=0.02)


def test_frames_that_must_not_be_read_are_banded() -> None:
    flags = np.zeros(100, bool)
    flags[10:20] = flags[60] = True
    drawing = angle_plot(AngleCurve("Shoulder", "degrees", np.arange(100.0), {"right": np.arange(100.0)}, flags))
    assert drawing.count('class="band"') == 2


def test_standard_errors_are_bands_and_what_was_not_measured_is_dashed() -> None:
    time = np.arange(100.0)
    sides = {"left": np.sin(time / 9), "right": 20 + np.cos(time / 9)}
    error = np.where(time == 50, np.nan, 2.0)
    curve = AngleCurve("Elbow", "degrees", time, sides, None, {"left": error, "right": error}, frozenset({"left"}))
    drawing = angle_plot(curve)
    assert drawing.count('class="spread right"') == drawing.count('class="spread left unmeasured"') == 2
    assert 'class="line left unmeasured"' in drawing and 'class="line right"' in drawing
    band = re.search(r'class="spread right" d="M([^"]*)Z"', drawing)[1]
    corners = np.array([[float(v) for v in corner.split()] for corner in band.split("L")])
    upper, lower = np.split(corners, 2)
    line = [float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", line_of(drawing, "right"))][:50]
    assert np.allclose((upper[:, 1] + lower[::-1, 1]) / 2, line, atol=0.11)


def test_images_survive_the_way_to_png() -> None:
    rgba = np.random.default_rng(0).integers(0, 256, (5, 7, 4), dtype=np.uint8)
    np.testing.assert_array_equal(pixels(png(rgba)), rgba)


def test_affinity_colours_fade_and_leave_the_unknown_out() -> None:
    found = affinity_colours(np.array([0.0, 0.008, 0.009, 0.05, np.nan]), 0.008, 0.05)
    assert (np.diff(found[:4, 3].astype(int)) < 0).all() and found[4, 3] == 0
    assert (found[0, :3] == found[1, :3]).all() and (found[1, :3] != found[2, :3]).any()


def test_a_short_gap_in_a_long_recording_is_not_lost_from_sight() -> None:
    present = np.ones((100_000, 2), bool)
    present[50_000] = [False, True]
    drawing = gaps_plot(Gaps(("a", "b"), np.arange(100_000) / 100, present, np.zeros_like(present)))
    image = pixels(re.search(r'href="([^"]*)"', drawing)[1])
    assert image.shape[0] == 2 and (image[0, :, 3] > 100).sum() == 1 and (image[1, :, 3] > 100).sum() == 0


@pytest.mark.parametrize(("low", "high"), [(0, 1), (-37.2, 112.5), (1e-4, 3e-4), (5, 5)])
def test_ticks_are_round_and_inside(low: float, high: float) -> None:
    ticks = nice_ticks(low, high, 4)
    assert len(ticks) <= 9 and (ticks >= low - 1e-9).all() and (ticks <= high + 1e-9).all()
    assert not any(str(t) == "-0.0" for t in ticks)


def test_pictures_are_in_the_page_itself() -> None:
    page = render(ReportData("walk", pictures=(Picture("From the <left>", b"\x89PNG bytes"),)))
    content = base64.b64encode(b"\x89PNG bytes").decode()
    assert f'src="data:image/png;base64,{content}"' in page
    assert "From the &lt;left&gt;</figcaption>" in page
    assert "figcaption>" not in render(ReportData("walk"))


def test_a_curve_breaks_where_its_reading_jumps() -> None:
    values = np.concatenate([np.linspace(150, 230, 50), np.linspace(-128, -60, 50)])
    drawing = angle_plot(AngleCurve("Arm flexion", "degrees", np.arange(100.0), {"right": values}))
    line = drawing.split('class="line right" d="')[1].split('"')[0]
    assert line.count("M") == 2, "two pieces, no upright stroke between them"
