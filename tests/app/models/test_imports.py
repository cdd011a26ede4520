"""What is chosen in the import dialog is what the session says."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from markerscope.app.models.demo import DEMO_MARKERS
from markerscope.app.models.document import Document
from markerscope.app.models.home import Home
from markerscope.app.models.imports import new_session
from markerscope.solver.pipeline.inputs import MarkerSettings
from markerscope.solver.pipeline.methods import graph_of


def test_choices_become_settings_and_unwanted_points_an_edit(tmp_path: Path) -> None:
    document = Document(Home(tmp_path, tmp_path))
    document.new(**new_session(DEMO_MARKERS, up="z", units="mm", rate=50.0, left_out=np.array([7, 2])))
    settings = document.session.stage_settings(graph_of(document.session))
    assert settings["markers"] == MarkerSettings(up="z", units="mm", rate=50.0)
    assert settings["segment"].left_out == (2, 7)
    assert document.session.inputs.keys() == {"marker_file"}
    document.close()


def test_what_is_not_chosen_is_left_to_the_file(tmp_path: Path) -> None:
    document = Document(Home(tmp_path, tmp_path))
    document.new(**new_session(DEMO_MARKERS))
    assert document.session.stage_settings(graph_of(document.session))["markers"] == MarkerSettings()
    assert document.session.edits == {}
    document.close()
