"""Settings as records: units, ranges and meaning come from where the settings are documented."""

from __future__ import annotations

from dataclasses import dataclass
from typing import get_args, get_origin, get_type_hints

import pytest

from markerscope.app.models.fields import descriptions, setting_of, settings_of, title
from markerscope.app.models.ranges import RANGES
from markerscope.solver.clustering.segment import SegmentSettings
from markerscope.solver.fit.settings import FitSettings
from markerscope.solver.pipeline.inputs import MarkerSettings, SyncSettings
from markerscope.solver.pipeline.methods import GRAPHS
from markerscope.solver.pipeline.stages_paper import PaperSegmentSettings

ALL = [setting for graph in GRAPHS.values() for stage in graph for setting in settings_of(stage.name, stage.settings())]


@dataclass(frozen=True)
class Made:
    """Something.

    Attributes
    ----------
    first, second : mm, of both,
        and this goes on
    third : degrees
    fourth : whatever it is

    first : not of the section any more
    """

    first: float = 1.0
    second: float = 2.0
    third: float | None = None
    fourth: tuple[int, ...] = ()


def test_docstrings_are_read() -> None:
    assert descriptions(Made) == {
        "first": "mm, of both, and this goes on",
        "second": "mm, of both, and this goes on",
        "third": "degrees",
        "fourth": "whatever it is",
    }
    first, second, third = settings_of("made", Made())
    assert (first.unit, first.help, second.help) == ("mm", "Of both, and this goes on.", first.help)
    assert (third.unit, third.help, third.optional) == ("deg", "", True)


def test_lengths_are_shown_in_millimetres_and_go_back_exactly() -> None:
    threshold = setting_of("segment", SegmentSettings(threshold=0.0081), "threshold")
    assert (threshold.value, threshold.default, threshold.unit) == (8.1, 8.0, "mm")
    assert threshold.inner(threshold.value) == 0.0081
    assert (threshold.minimum, threshold.maximum) == (0.0, 100.0)
    assert threshold.said(8.1) == "8.1 mm"
    assert threshold.changed


def test_a_class_that_extends_another_keeps_its_words_and_has_its_own_defaults() -> None:
    far = setting_of("segment", PaperSegmentSettings(), "far")
    assert far.default == 0.0
    assert "held apart" in far.help


def test_choices_and_what_is_left_to_the_program() -> None:
    up = setting_of("markers", MarkerSettings(), "up")
    assert (up.kind, up.choices, up.optional, up.said(None)) == ("choice", ("x", "y", "z"), True, "automatic")
    offset = setting_of("sync", SyncSettings(), "offset")
    assert (offset.kind, offset.unit, offset.value) == ("float", "s", None)
    start = setting_of("markers", MarkerSettings(), "start")
    assert (start.unit, start.help[:8]) == ("s", "In the f")


def test_edits_that_no_form_can_show_are_left_out() -> None:
    names = {setting.name for setting in settings_of("segment", SegmentSettings())}
    assert names == {"threshold", "groups", "far", "far_penalty", "max_frames", "min_overlap"}


@pytest.mark.parametrize("setting", ALL, ids=lambda setting: f"{setting.stage}.{setting.name}")
def test_every_setting_has_its_meaning_and_a_range_around_its_default(setting) -> None:
    assert setting.help
    assert setting.help.endswith(".")
    if setting.kind in ("float", "int"):
        assert setting.minimum < setting.maximum
        assert setting.default is None or setting.minimum <= setting.default <= setting.maximum
    assert setting.inner(setting.value) == setting.inner(setting.default)


def test_every_stage_has_a_title() -> None:
    assert all(title(stage.name)[0].isupper() for graph in GRAPHS.values() for stage in graph)


def test_every_number_has_a_range_and_every_range_a_setting() -> None:
    """A setting that was renamed leaves its range behind, and stands in the form without one."""
    numbers = {
        (stage.name, name)
        for graph in GRAPHS.values()
        for stage in graph
        for name, kind in get_type_hints(stage.settings).items()
        if {int, float} & {kind, *get_args(kind)} and get_origin(kind) is not tuple
    }
    assert set(RANGES) == numbers


def test_a_candidate_is_counted_from_1_in_its_form_and_from_0_in_the_file() -> None:
    shown = setting_of("fit", FitSettings(candidate=2), "candidate")
    assert (shown.value, shown.minimum, shown.default) == (3, 1, None)
    assert (shown.inner(3), shown.inner(None)) == (2, None)
    assert shown.said(shown.value) == "3"
