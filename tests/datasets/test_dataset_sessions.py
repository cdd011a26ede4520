"""Small copies of the datasets' folders become sessions that the solver takes."""

from __future__ import annotations

import json
import pickle
import zipfile
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from markerscope.solver.commands import dataset as sessions
from markerscope.solver.commands.dataset import write_sessions
from markerscope.solver.core.errors import InputError
from markerscope.solver.core.markers import Markers
from markerscope.solver.datasets.kitchen import BACKPACK, KITCHEN
from markerscope.solver.datasets.moyo import MOYO
from markerscope.solver.datasets.request import DatasetName, DatasetRequest, Options
from markerscope.solver.datasets.umpm import UMPM
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.io.markers_in import load_markers
from markerscope.solver.io.motion_in import read_motion
from markerscope.solver.pipeline.session import load_session
from markerscope.solver.video.frames import index_video, read_frames

SECONDS = 4.0


@pytest.fixture(autouse=True)
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Windows of a second, so that the files can be small."""
    for name, dataset in (("umpm", UMPM), ("kitchen", KITCHEN), ("moyo", MOYO)):
        monkeypatch.setitem(sessions.DATASETS, name, replace(dataset, window_s=1.0, padding_s=0.5))


def markers_file(path: Path, labels: tuple[str, ...], rate: float, seconds: float = SECONDS) -> np.ndarray:
    """A C3D of slowly moving markers in z-up millimetres; returns its (T, M, 3) m."""
    path.parent.mkdir(parents=True, exist_ok=True)
    time = np.arange(round(seconds * rate)) / rate
    m = np.arange(len(labels))
    place = np.stack([0.3 * np.cos(m), 0.3 * np.sin(m), 0.2 + 1.5 * m / len(m)], axis=1)
    positions = place + 0.1 * np.sin(time)[:, None, None] * np.array([1.0, 0.5, 0.2])
    write_c3d(path, Markers(positions, rate, labels), up="z", labels=labels)
    return positions


def film(path: Path, rate: float, seconds: float = SECONDS) -> None:
    """A video whose brightness counts its frames."""
    import av

    path.parent.mkdir(parents=True, exist_ok=True)
    container_format = "avi" if path.suffix == ".avi" else None
    with av.open(str(path), "w", format=container_format) as container:
        stream = container.add_stream("mpeg4", rate=Fraction(rate).limit_denominator(1001))
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for i in range(round(seconds * rate)):
            picture = np.full((48, 64, 3), i % 240, np.uint8)
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode(None))


def picture(value: int, width: int = 64, height: int = 48) -> bytes:
    import cv2

    return bytes(cv2.imencode(".jpg", np.full((height, width, 3), value, np.uint8))[1])


def brightness(path: Path) -> list[float]:
    return [float(image.mean()) for _, _, image in read_frames(path)]


def umpm(root: Path, name: str = "p1_grab_3") -> np.ndarray:
    labels = ("lwrext", "LWRTOP", "Lwrlow", "LELBTOP", "LShld", "rwrext", "RANKFR", "LknssBK", "*31")
    positions = markers_file(root / name / "Groundtruth" / f"{name}.c3d", labels, 100.0)
    for end in ("_ik", "_vm"):
        markers_file(root / name / "Groundtruth" / f"{name}{end}.c3d", ("A", "B", "C"), 100.0)
    for camera in "fl":
        film(root / name / "Video" / f"{name}_{camera}.avi", 50.0)
    return positions


def kitchen(root: Path, video: bool = True) -> None:
    labels = (*(f"cook1:{name}" for name in ("LFWT", "LTHI", "LKNE", "RWRA", *BACKPACK)), "pan:a", "pan:b")
    markers_file(root / "mocap" / "s1" / "salad.c3d", labels, 120.0)
    if video:
        film(root / "videos" / "s1" / "salad_7151062.avi", 30.0)
        film(root / "videos" / "s1" / "salad_7151020.avi", 30.0)


def moyo(root: Path, name: str = "220923_yogi_body_hands_03596_Tree_Pose_or_Vrksasana_-a") -> np.ndarray:
    base = root / "data" / "MOYO" / "20220923_20220926_with_hands"
    labels = ("LUPA", "LELB", "LIEL", "C7", "RKNE", "Mat1", "*12")
    markers_file(base / "pressure" / "val" / "pressure_mat_c3d" / f"{name}.c3d", labels, 60.0)
    frames = round(SECONDS * 60)
    pose = np.zeros((frames, 165))
    pose[:, 0] = np.pi / 2
    pose[:, 5] = np.linspace(0, 1, frames)
    trans = np.stack([np.linspace(0, 1, frames), np.zeros(frames), np.ones(frames)], axis=1)
    fitted = {"fullpose": pose, "trans": trans, "betas": np.arange(16.0),
              "stageii_debug_details": {"mocap_frame_rate": 60.0, "labels_obs": [["C7"]]}}  # fmt: skip
    (base / "mosh" / "val").mkdir(parents=True)
    (base / "mosh" / "val" / f"{name}_stageii.pkl").write_bytes(pickle.dumps(fitted))
    (base / "images" / "val").mkdir(parents=True)
    with zipfile.ZipFile(base / "images" / "val" / f"{name}.zip", "w") as packed:
        for i in range(round(SECONDS * 30)):
            packed.writestr(f"{name}/YOGI_Cam_06/{name}_YOGI_Cam_06_{i + 1:04d}.jpg", picture(2 * i))
            packed.writestr(f"{name}/YOGI_Cam_01/{name}_YOGI_Cam_01_{i + 1:04d}.jpg", picture(255))
    return trans


def manifest(out: Path) -> list[dict[str, object]]:
    content = json.loads((out / "sessions.json").read_text())
    assert content["rate"] == 30.0
    found: list[dict[str, object]] = content["sessions"]
    return found


def test_umpm(tmp_path: Path) -> None:
    positions = umpm(tmp_path / "umpm")
    umpm(tmp_path / "umpm", "p2_free_1")
    out = tmp_path / "out"
    outcome = write_sessions(DatasetRequest("umpm", tmp_path / "umpm", out))
    entries = manifest(out)
    assert [e["session"] for e in entries] == ["p1_grab_3_00000015", "p1_grab_3_00000045", "p1_grab_3_00000075"]
    assert outcome.summary["sessions"] == 3
    assert outcome.warnings == ()
    second = entries[1]
    assert (second["start_s"], second["stop_s"], second["part"]) == (1.5, 2.5, "whole body")
    markers = load_markers(out / str(second["markers"]))
    truth = json.loads((out / str(second["labels"])).read_text())
    assert markers.rate == 30
    assert markers.time[0] == pytest.approx(1.5)
    assert markers.positions.shape == (30, 8, 3)
    assert set(markers.labels) == {f"M{i:02d}" for i in range(1, 9)} == set(truth)
    assert sorted(truth.values()) == sorted("LWREXT LWRTOP LWRLOW LELBTOP LSHLD RWREXT RANKFR LKNEEBK".split())
    assert list(truth.values()) != ["LWREXT", "LWRTOP", "LWRLOW", "LELBTOP", "LSHLD", "RWREXT", "RANKFR", "LKNEEBK"]
    column = next(label for label, name in truth.items() if name == "LSHLD")
    found = markers.positions[::3, markers.labels.index(column)]
    assert np.allclose(found, positions[150:250:10, 4], atol=1e-5)
    session = load_session(out / str(second["session"]))
    assert session.settings["sync"]["offset"] == pytest.approx(1.5)
    video = out / str(second["video"])
    assert index_video(video).rate == pytest.approx(50, abs=0.1)
    seen = brightness(video)
    assert len(seen) == 50
    assert np.allclose(seen, np.arange(75, 125), atol=4), "frame 75 is at 1.5 s"


def test_parts_and_a_cap_on_windows(tmp_path: Path) -> None:
    umpm(tmp_path / "umpm")
    out = tmp_path / "out"
    request = DatasetRequest("umpm", tmp_path / "umpm", out, parts=("left_arm", "left_leg"), windows=1)
    outcome = write_sessions(request)
    entries = manifest(out)
    assert [e["session"] for e in entries] == ["p1_grab_3_00000015_left_arm"]
    truth = json.loads((out / str(entries[0]["labels"])).read_text())
    assert sorted(truth.values()) == ["LELBTOP", "LSHLD", "LWREXT", "LWRLOW", "LWRTOP"]
    assert "p1_grab_3_00000015_left_leg was left out" in outcome.warnings[0]


@pytest.mark.parametrize(("backpack", "count"), [(False, 4), (True, 11)])
def test_kitchen_leaves_the_backpack_and_the_pans_out(tmp_path: Path, backpack: bool, count: int) -> None:
    kitchen(tmp_path / "kitchen")
    out = tmp_path / "out"
    request = DatasetRequest("kitchen", tmp_path / "kitchen", out, windows=1, options=Options(backpack=backpack))
    write_sessions(request)
    (entry,) = manifest(out)
    truth = json.loads((out / str(entry["labels"])).read_text())
    assert len(truth) == count
    assert set(BACKPACK) & set(truth.values()) == (set(BACKPACK) if backpack else set())
    assert entry["offset_s"] is None, "this dataset is not synchronised"
    assert "sync" not in load_session(out / str(entry["session"])).settings
    assert len(brightness(out / str(entry["video"]))) == 120, "all of it, since 5 s on either side are kept"


def test_a_known_offset_cuts_the_video_to_the_window(tmp_path: Path) -> None:
    kitchen(tmp_path / "kitchen")
    (tmp_path / "offsets.json").write_text('{"s1_salad": -0.25}')
    out = tmp_path / "out"
    write_sessions(DatasetRequest("kitchen", tmp_path / "kitchen", out, windows=1, offsets=tmp_path / "offsets.json"))
    (entry,) = manifest(out)
    video = out / str(entry["video"])
    assert index_video(video).rate == pytest.approx(29.97, abs=0.01), "what the cameras ran at, not what they say"
    seen, whole = brightness(video), brightness(tmp_path / "kitchen" / "videos" / "s1" / "salad_7151062.avi")
    away = [np.abs(np.subtract(whole[k : k + len(seen)], seen)).mean() for k in range(len(whole) - len(seen))]
    film_time = int(np.argmin(away)) / 29.97
    # marker time = film time + offset: the window begins at 0.5 s, which is 0.75 s of the film
    assert film_time == pytest.approx(0.75, abs=0.018)
    assert entry["offset_s"] == pytest.approx(film_time - 0.25, abs=1e-6)
    assert load_session(out / str(entry["session"])).settings["sync"]["offset"] == entry["offset_s"]


def test_moyo_with_its_pictures_and_its_bodies(tmp_path: Path) -> None:
    trans = moyo(tmp_path / "toolkit")
    out = tmp_path / "out"
    write_sessions(DatasetRequest("moyo", tmp_path / "toolkit", out, windows=2))
    entries = manifest(out)
    assert len(entries) == 2
    second = entries[1]
    truth = json.loads((out / str(second["labels"])).read_text())
    assert sorted(truth.values()) == ["C7", "LELB", "LIEL", "LUPA", "RKNE"]
    reference = read_motion(out / str(second["reference"]))
    assert reference.time is not None
    assert np.allclose(reference.time, 1.5 + np.arange(30) / 30)
    assert np.allclose(reference.trans, trans[90:150:2])
    assert np.allclose(reference.rotations[0, 0] @ [0, 1, 0], [0, 0, 1])
    assert len(reference.betas) == 16
    video = out / str(second["video"])
    assert np.allclose(brightness(video), 2 * np.arange(45, 75), atol=5)
    assert index_video(video).size == (32, 24), "pictures are halved, as in the paper's table 6"


def test_pictures_may_be_unpacked_and_bodies_absent(tmp_path: Path) -> None:
    moyo(tmp_path)
    base = tmp_path / "data" / "MOYO" / "20220923_20220926_with_hands"
    (packed,) = (base / "images" / "val").glob("*.zip")
    with zipfile.ZipFile(packed) as archive:
        archive.extractall(base / "images" / "val")
    packed.unlink()
    next((base / "mosh" / "val").iterdir()).write_bytes(b"damaged")
    write_sessions(DatasetRequest("moyo", base.parent, tmp_path / "out", windows=1))
    (entry,) = manifest(tmp_path / "out")
    assert entry["reference"] is None
    assert "The reference is left out" in str(entry["note"])
    assert len(brightness(tmp_path / "out" / str(entry["video"]))) == 30


def test_priors_take_the_videos_place(tmp_path: Path) -> None:
    umpm(tmp_path / "umpm")
    (tmp_path / "priors").mkdir()
    (tmp_path / "priors" / "demo_p1_grab_3_l.pkl").write_bytes(b"")
    out = tmp_path / "out"
    write_sessions(DatasetRequest("umpm", tmp_path / "umpm", out, windows=1, priors=tmp_path / "priors"))
    (entry,) = manifest(out)
    assert entry["video"] is None
    session = load_session(out / str(entry["session"]))
    assert session.inputs["prior_file"].path == tmp_path / "priors" / "demo_p1_grab_3_l.pkl"
    assert session.settings["prior"]["rate"] == pytest.approx(50)
    assert session.settings["sync"]["offset"] == 0


def nothing(root: Path) -> None:
    root.mkdir(exist_ok=True)


def too_short(root: Path) -> None:
    markers_file(root / "p1_a" / "Groundtruth" / "p1_a.c3d", ("LWREXT", "LWRTOP", "LWRLOW"), 100.0, 1.0)
    film(root / "p1_a" / "Video" / "p1_a_l.avi", 50.0, 1.0)


def no_film(root: Path) -> None:
    markers_file(root / "p1_a" / "Groundtruth" / "p1_a.c3d", ("LWREXT", "LWRTOP", "LWRLOW"), 100.0)


def nameless(root: Path) -> None:
    markers_file(root / "p1_a" / "Groundtruth" / "p1_a.c3d", ("*1", "*2", "*3"), 100.0)


def damaged(root: Path) -> None:
    nothing(root)
    (root / "Groundtruth").mkdir()
    (root / "Groundtruth" / "p1_a.c3d").write_bytes(b"\x02\x50no")


def no_cook(root: Path) -> None:
    markers_file(root / "mocap" / "s1" / "a.c3d", ("pan:a", "pan:b", "pan:c", "pot:a"), 120.0)


def bad_zip(root: Path) -> None:
    moyo(root)
    next(root.rglob("*.zip")).write_bytes(b"no")


def other_camera(root: Path) -> None:
    moyo(root)
    path = next(root.rglob("*.zip"))
    with zipfile.ZipFile(path, "w") as packed:
        packed.writestr("YOGI_Cam_01/a.jpg", picture(0))


def broken_picture(root: Path) -> None:
    moyo(root)
    path = next(root.rglob("*.zip"))
    with zipfile.ZipFile(path, "w") as packed:
        for i in range(90):
            packed.writestr(f"YOGI_Cam_06/{i:03d}.jpg", b"no picture")


@pytest.mark.parametrize(
    ("dataset", "make", "message"),
    [
        ("umpm", nothing, "holds no recordings of UMPM"),
        ("kitchen", nothing, "holds no recordings of CMU Kitchen"),
        ("moyo", nothing, "holds no recordings of MOYO"),
        ("umpm", too_short, "lasts only 1.0 s"),
        ("umpm", no_film, "has no video of the paper's camera"),
        ("umpm", nameless, "holds 0 markers with names of UMPM"),
        ("umpm", damaged, "C3D"),
        ("kitchen", no_cook, "names no cook"),
        ("moyo", bad_zip, "is not a ZIP file"),
        ("moyo", other_camera, "holds no pictures of YOGI_Cam_06"),
        ("moyo", broken_picture, "cannot be read"),
    ],
)
def test_a_folder_that_is_not_as_expected_ends_in_one_sentence(
    tmp_path: Path, dataset: DatasetName, make: Callable[[Path], None], message: str
) -> None:
    make(tmp_path / "in")
    with pytest.raises(InputError) as told:
        write_sessions(DatasetRequest(dataset, tmp_path / "in", tmp_path / "out"))
    assert message in str(told.value)
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"parts": ("tail",)}, '"tail" is no part of UMPM'),
        ({"windows": 0}, "0 is not possible"),
        ({"priors": Path("nowhere")}, "is no folder of priors"),
        ({"folder": Path("nowhere")}, "is no folder"),
    ],
)
def test_what_cannot_be_asked_is_refused(tmp_path: Path, given: dict[str, object], message: str) -> None:
    umpm(tmp_path / "umpm")
    request = replace(DatasetRequest("umpm", tmp_path / "umpm", tmp_path / "out"), **given)  # type: ignore[arg-type]
    with pytest.raises(InputError, match=message):
        write_sessions(request)


@pytest.mark.parametrize(
    ("content", "message"),
    [("no", "is not JSON"), ("[1]", "holds no offsets"), ('{"s1_salad": "x"}', "holds no offsets"),
     ('{"s1_salad": NaN}', "holds no offsets"), ('{"s2_salad": 1}', "is no recording here")],
)  # fmt: skip
def test_offsets_that_are_none_are_refused(tmp_path: Path, content: str, message: str) -> None:
    kitchen(tmp_path / "kitchen", video=False)
    (tmp_path / "offsets.json").write_text(content)
    with pytest.raises(InputError, match=message):
        write_sessions(
            DatasetRequest("kitchen", tmp_path / "kitchen", tmp_path / "out", offsets=tmp_path / "offsets.json")
        )


def test_all_sessions_are_written_or_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    umpm(tmp_path / "umpm")
    request = DatasetRequest("umpm", tmp_path / "umpm", tmp_path / "out")
    write_sessions(replace(request, windows=1))
    before = {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()}
    calls: list[int] = []

    def fail(*_: object) -> tuple[bool, str]:
        calls.append(1)
        if len(calls) > 1:
            raise InputError("the disk is full")
        return False, ""

    monkeypatch.setattr("markerscope.solver.commands.dataset.write_reference", fail)
    for out in (tmp_path / "out", tmp_path / "new"):
        calls.clear()
        with pytest.raises(InputError, match="the disk is full"):
            write_sessions(replace(request, out=out))
    assert {path: path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()} == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "umpm"]
