"""The door for scripts: public names, results as tables, errors, and nothing loaded before it is used."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import markerscope as ms
from markerscope.solver.synth.session import SynthSession


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, SynthSession]:
    folder = tmp_path_factory.mktemp("session")
    return folder, ms.simulate("walk", frames=60, seed=3, out=folder)


@pytest.fixture(scope="module")
def result(session: tuple[Path, SynthSession], tmp_path_factory: pytest.TempPathFactory) -> ms.Result:
    folder, made = session
    return ms.solve(made.markers, prior=folder / "prior.npz", out=tmp_path_factory.mktemp("solved") / "trial")


def test_importing_it_loads_nothing() -> None:
    code = (
        "import sys, markerscope as ms; before = set(sys.modules); dir(ms); ms.__version__;"
        "assert 'numpy' not in before and not {m for m in before if m.startswith('markerscope.')}"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_solve_from_a_script_loads_no_window(result: ms.Result) -> None:
    code = (
        "import sys, markerscope as ms; r = ms.Result.open(sys.argv[1]); r.angles, r.markers, r.joints, r.body;"
        "assert not {m.split('.')[0] for m in sys.modules} & {'PySide6', 'vtkmodules', 'vtk', 'torch', 'open3d'}"
    )
    subprocess.run([sys.executable, "-c", code, str(result.folder)], check=True)


def test_every_public_name_says_what_it_is() -> None:
    for name in ms.__all__:
        value = getattr(ms, name)
        if name != "__version__":
            assert inspect.getdoc(value), name
        for own, member in vars(value).items() if inspect.isclass(value) else ():
            if not own.startswith("_") and (callable(member) or isinstance(member, property)):
                assert inspect.getdoc(member), f"{name}.{own}"
    with pytest.raises(AttributeError, match="no_such"):
        _ = ms.no_such  # type: ignore[attr-defined]


def test_the_tables_hold_what_the_files_hold(result: ms.Result, session: tuple[Path, SynthSession]) -> None:
    lines = (result.folder / "angles.csv").read_text().splitlines()
    assert lines[0].split(",")[1:] == list(result.angles.names)
    written = np.array([[float(cell or "nan") for cell in line.split(",")] for line in lines[1:]])
    assert np.allclose(written[:, 1:], result.angles.degrees, atol=1e-4, equal_nan=True)
    assert np.array_equal(
        result.angles["knee_angle_r"], result.angles.degrees[:, result.angles.names.index("knee_angle_r")]
    )
    made = session[1].markers
    assert result.markers.names == made.labels
    measured = np.isfinite(made.positions).all(axis=2) & ~result.markers.filled
    assert np.allclose(result.markers.positions[measured], made.positions[measured], atol=2e-7)
    with pytest.raises(KeyError, match="no angle of the convention opensim"):
        result.angles["knee"]


def test_other_libraries_get_units_and_names(result: ms.Result) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    frame = result.angles.to_pandas()
    assert frame.index.name == "time" and list(frame.columns) == list(result.angles.names)
    array = result.angles.to_xarray()
    assert array.dims == ("time", "angle") and array.attrs["units"] == "degrees"
    joints = result.joints.to_xarray()
    assert joints.position.dims == ("time", "space", "keypoints", "individuals")
    wrist = joints.position.sel(keypoints="left_wrist", individuals="subject").values
    assert np.array_equal(wrist, result.joints["left_wrist"])
    assert joints.attrs["fps"] == result.joints.rate and joints.attrs["ds_type"] == "poses"
    assert result.markers.to_pandas().shape == (60, 3 * len(result.markers.names))


def test_the_body_stands_where_the_motion_file_has_it(result: ms.Result) -> None:
    body = result.body
    with np.load(result.folder / "motion.npz", allow_pickle=False) as motion:
        assert np.allclose(motion["joints"], body.joints) and np.allclose(motion["trans"], body.translation)
    skin = body.vertices([0, 30])
    assert skin.shape[0] == 2 and body.faces.max() < skin.shape[1]
    assert np.abs(skin[1].mean(axis=0) - body.joints[30].mean(axis=0)).max() < 0.3


def test_every_stage_can_be_asked_for(result: ms.Result) -> None:
    for name in result.stages:
        result.stage(name)
    with pytest.raises(ms.InputError, match="no result of a stage 'segmentation'; ask for markers"):
        result.stage("segmentation")
    assert 0 <= result.confidence <= 1 and len(result.hypotheses) >= 1
    assert result.settings["angles"].convention == "opensim"


def test_a_result_is_what_the_folder_holds(result: ms.Result) -> None:
    again = ms.Result.open(result.folder)
    assert np.array_equal(again.angles.degrees, result.angles.degrees, equal_nan=True)
    assert again.warnings == result.warnings and again.notes == result.notes


def test_a_folder_without_a_result_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ms.InputError, match="holds no session; name a folder that a solve wrote"):
        ms.Result.open(tmp_path)
    with pytest.raises(ms.InputError, match="neither a video nor a pose prior"):
        ms.solve(ms.simulate("walk", frames=40, seed=1).markers, out=tmp_path / "none")
    with pytest.raises(ms.InputError, match="unexpected keyword argument 'markrs'"):
        ms.simulate("walk", markrs=3)


def test_a_callback_that_cancels_stops_the_solve(session: tuple[Path, SynthSession], tmp_path: Path) -> None:
    told: list[float] = []

    def stop(fraction: float, text: str) -> None:
        told.append(fraction)
        if len(told) == 3:
            raise ms.Cancelled("enough")

    folder = session[0]
    with pytest.raises(ms.Cancelled):
        ms.solve(folder / "markers.c3d", prior=folder / "prior.npz", out=tmp_path / "out", progress=stop)
    assert len(told) == 3 and not (tmp_path / "out" / "angles.csv").exists()


def test_a_temporary_result_goes_with_its_object(session: tuple[Path, SynthSession]) -> None:
    folder = session[0]
    found = ms.solve(folder / "markers.c3d", prior=folder / "prior.npz")
    place = found.folder
    assert (place / "angles.csv").is_file()
    del found
    assert not place.exists()


def test_a_comparison_is_what_the_command_prints(result: ms.Result, session: tuple[Path, SynthSession]) -> None:
    errors = ms.evaluate(result, session[0] / "reference.npz")
    assert errors["frames"] == 60 and 0 < errors["mpjpe_mm"] < 100
    assert ms.evaluate(result, result)["mpjpe_mm"] == 0
