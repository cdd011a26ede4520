"""Results outlive the place and the name of the classes they are made of: a session of version 0.1 is read as it is."""

from __future__ import annotations

import dataclasses
import json
import zipfile
from dataclasses import dataclass, make_dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from markerscope.app.cli.main import main
from markerscope.solver.pipeline.codec import CodecError, dataclasses_in, decode, encode
from markerscope.solver.pipeline.methods import GRAPHS
from markerscope.solver.pipeline.stage import Stage
from markerscope.solver.pipeline.stages import GRAPH
from markerscope.solver.pipeline.store import Store

WRITTEN = Path(__file__).with_name("session-0.1.zip")
"""34 frames of ``synth walk --markers 8 --seed 3``, solved by version 0.1 with a search made small."""

STORED_BY_0_1 = (
    "BodyState Candidate CameraResult ChainFit Cleaned Cut Descent Fill FitStage FittedMotion JointAngles Landmarks "
    "Localization Markers NetworkPoses Orientation PaperLocalization PaperSolve PaperSolveSettings PosePrior Proposal "
    "Segmentation Steps SurfaceDistance Sync Trace YawFit"
).split()


@pytest.fixture
def session(tmp_path: Path) -> Path:
    with zipfile.ZipFile(WRITTEN) as file:
        file.extractall(tmp_path)
    return tmp_path / "solved"


def manifests(session: Path) -> dict[str, dict]:
    found = {path.parent.parent.name: path for path in session.glob("results/*/*/manifest.json")}
    return {stage: json.loads(path.read_text(encoding="utf-8")) for stage, path in found.items()}


def test_the_names_that_version_0_1_stored_are_still_those_of_its_classes() -> None:
    now = dataclasses_in(stage.result for graph in GRAPHS.values() for stage in graph)
    gone = set(STORED_BY_0_1) - now.keys()
    assert not gone, "give the class that was renamed a STORED_AS"


def as_it_was(stage: Stage, about: dict) -> bool:
    """Whether a stage still computes what it did: what its result's key is made of has not changed."""
    settings = [field.name for field in dataclasses.fields(stage.settings)]
    now = (stage.version, set(stage.inputs), set(settings))
    return now == (about["version"], set(about["inputs"]), set(about["settings"]))


def types_in(document: object) -> set[str]:
    """The names of classes in a stored document."""
    if isinstance(document, list):
        return {name for item in document for name in types_in(item)}
    if not isinstance(document, dict):
        return set()
    own = {document["$type"]} if "$type" in document else set()
    return own | {name for item in document.values() for name in types_in(item)}


def test_every_result_of_version_0_1_is_read(session: Path) -> None:
    stages, store = {stage.name: stage for stage in GRAPH}, Store(session / "results")
    written = manifests(session)
    assert "solver.solve.results.FittedMotion" in types_in(written["fit"]["value"])
    for name, manifest in written.items():
        known = dataclasses_in([stages[name].result])
        assert {stored.rpartition(".")[2] for stored in types_in(manifest["value"])} <= known.keys()
        if as_it_was(stages[name], manifest["about"]):
            result = store.get(name, manifest["key"], stages[name].result)
            assert result is None or type(result).__module__.startswith("markerscope.")


def test_a_session_of_version_0_1_is_not_computed_again(session: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written = manifests(session)
    due: set[str] = set()
    for stage in GRAPH:  # what computes otherwise now is computed again, with what depends on it, and nothing else
        if stage.name not in written or not as_it_was(stage, written[stage.name]["about"]) or due & set(stage.inputs):
            due.add(stage.name)
    assert main(["solve", str(session), "--quiet", "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)["computed"]) == due


@dataclass(frozen=True)
class Renamed:
    STORED_AS: ClassVar[str] = "Before"
    value: int


def test_a_renamed_class_keeps_its_results() -> None:
    before = make_dataclass("Before", [("value", int)])
    assert decode(encode(before(3))[0], {}, Renamed) == Renamed(3)
    assert decode(encode(Renamed(3))[0], {}, before) == before(3)


def test_two_classes_of_one_name_are_not_taken_for_each_other() -> None:
    with pytest.raises(TypeError, match="one name, Before"):
        dataclasses_in([make_dataclass("Before", []) | Renamed])
    with pytest.raises(CodecError):
        decode(encode(Renamed(3))[0], {}, make_dataclass("Other", []))
