"""Frames by presentation stamp, on files written here with known pictures and times."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest

from markerscope.solver.core.errors import InputError
from markerscope.solver.video.frames import FrameReader, index_video, read_frames

WIDTH, HEIGHT = 160, 96
TICK = Fraction(1, 1000)


def picture(i: int) -> np.ndarray:
    """A grey picture that carries its number in blocks of black and white, with a red top-left corner."""
    image = np.full((HEIGHT, WIDTH, 3), 128, np.uint8)
    for bit in range(8):
        image[40:72, 16 * bit + 16 : 16 * bit + 32] = 255 * ((i >> bit) & 1)
    image[:24, :32] = (255, 0, 0)
    return image


def number(image: np.ndarray) -> int:
    return sum(int(image[48:64, 16 * bit + 20 : 16 * bit + 28].mean() > 128) << bit for bit in range(8))


def write(path: Path, stamps_ms: list[int], *, turn: int = 0, gop: int = 12, codec: str = "libx264") -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.time_base = TICK
        stream.time_base = TICK
        stream.codec_context.gop_size = gop
        if turn:
            stream.set_display_rotation(turn)
        for i, stamp in enumerate(stamps_ms):
            frame = av.VideoFrame.from_ndarray(picture(i), format="rgb24")
            frame.pts, frame.time_base = stamp, TICK
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


@pytest.fixture(scope="module")
def variable(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, np.ndarray]:
    """100 frames at a variable rate whose first stamp is 0.5 s."""
    steps = np.random.default_rng(3).integers(15, 60, 99)
    stamps = np.concatenate([[500], 500 + np.cumsum(steps)])
    return write(tmp_path_factory.mktemp("v") / "variable.mkv", stamps.tolist()), stamps / 1000.0


def test_times_are_the_stamps_from_the_first_decoded_frame(variable: tuple[Path, np.ndarray]) -> None:
    path, stamps = variable
    index = index_video(path)
    assert index.size == (WIDTH, HEIGHT) and index.codec == "h264"
    np.testing.assert_allclose(index.time, stamps - stamps[0], atol=5e-4)
    assert index.rate == pytest.approx(1 / np.median(np.diff(stamps)), rel=1e-6)


def test_reading_in_order_gives_every_wanted_frame(variable: tuple[Path, np.ndarray]) -> None:
    path, stamps = variable
    seen = [(i, t, number(image)) for i, t, image in read_frames(path, stride=7)]
    assert [i for i, _, _ in seen] == list(range(0, 100, 7)) == [n for _, _, n in seen]
    np.testing.assert_allclose([t for _, t, _ in seen], (stamps - stamps[0])[::7], atol=5e-4)
    assert [i for i, _, _ in read_frames(path, [3, 99, 250])] == [3, 99]


@pytest.mark.parametrize("suffix", ["mkv", "mp4", "avi"])
def test_random_access_is_exact(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / f"r.{suffix}", [round(i * 1000 / 30) for i in range(100)], gop=25)
    with FrameReader(index_video(path)) as reader:
        assert len(reader.index.time) == 100
        order = [50, 51, 3, 99, 98, 0, 24, 25, 26, 25, 75, 12, 60]
        assert [number(reader.frame(i)) for i in order] == order
        with pytest.raises(IndexError):
            reader.frame(100)


@pytest.mark.parametrize("turn", [90, 180, 270])
def test_a_turned_phone_video_comes_out_upright(tmp_path: Path, turn: int) -> None:
    path = write(tmp_path / "phone.mp4", [33 * i for i in range(5)], turn=turn)
    index = index_video(path)
    _, _, image = next(read_frames(path))
    # PyAV's angle is counter-clockwise, as is numpy's quarter turn.
    expected = np.rot90(picture(0), turn // 90)
    assert index.size == expected.shape[1::-1] == image.shape[1::-1]
    assert index.turned == 360 - turn
    assert np.abs(image.astype(int) - expected).mean() < 8, "the picture is turned the wrong way"
    capture = cv2.VideoCapture(str(path))
    second = capture.read()[1][:, :, ::-1]
    assert np.abs(image.astype(int) - second).mean() < 3, "OpenCV shows it turned otherwise"


def test_an_anamorphic_video_gets_square_pixels(tmp_path: Path) -> None:
    path = tmp_path / "wide.mkv"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=30)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.codec_context.sample_aspect_ratio = Fraction(4, 3)
        for i in range(3):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture(i), format="rgb24")))
        container.mux(stream.encode(None))
    assert index_video(path).size == (round(WIDTH * 4 / 3), HEIGHT)
    assert next(read_frames(path))[2].shape == (HEIGHT, round(WIDTH * 4 / 3), 3)


def test_a_truncated_file_gives_what_decodes(tmp_path: Path, variable: tuple[Path, np.ndarray]) -> None:
    whole = variable[0].read_bytes()
    path = tmp_path / "cut.mkv"
    path.write_bytes(whole[: len(whole) * 6 // 10])
    index = index_video(path)
    assert 20 < len(index.time) < 95
    numbers = [number(image) for _, _, image in read_frames(path)]
    assert numbers[:-1] == list(range(len(numbers) - 1)) and len(numbers) == len(index.time)


def test_a_damaged_middle_keeps_the_stamps_of_the_rest(tmp_path: Path, variable: tuple[Path, np.ndarray]) -> None:
    path, stamps = variable
    data = bytearray(path.read_bytes())
    middle = len(data) // 2
    data[middle : middle + 400] = bytes(400)
    broken = tmp_path / "broken.mkv"
    broken.write_bytes(data)
    index = index_video(broken)
    assert len(index.time) > 50
    offsets = np.abs(index.time[:, None] - (stamps - stamps[0])[None]).min(axis=1)
    assert offsets.max() < 1e-3, f"a frame is {offsets.max():.4f} s off every true stamp"


def garbage(path: Path) -> Path:
    path.write_bytes(np.random.default_rng(0).bytes(50_000))
    return path


def empty(path: Path) -> Path:
    path.touch()
    return path


def text(path: Path) -> Path:
    path.write_text("time,x,y,z\n" * 500)
    return path


def folder(path: Path) -> Path:
    path.mkdir()
    return path


def header_only(path: Path) -> Path:
    whole = write(path.with_name("whole.mp4"), [33 * i for i in range(20)]).read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    return path


def sound(path: Path) -> Path:
    with av.open(str(path), "w", format="wav") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        frame = av.AudioFrame.from_ndarray(np.zeros((1, 800), np.int16), format="s16", layout="mono")
        frame.sample_rate = 8000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    return path


def playlist(path: Path) -> Path:
    path.write_text("#EXTM3U\n#EXT-X-TARGETDURATION:10\n#EXTINF:10,\nhttp://127.0.0.1:9/a.ts\n#EXT-X-ENDLIST\n")
    return path.rename(path.with_suffix(".m3u8"))


@pytest.mark.parametrize("make", [garbage, empty, text, folder, header_only, sound, playlist, lambda path: path])
def test_what_is_no_video_ends_in_one_sentence(tmp_path: Path, make) -> None:
    path = make(tmp_path / "bad.mp4")
    with pytest.raises(InputError) as caught:
        index_video(path)
    message = str(caught.value)
    assert str(path) in message and message.endswith(".") and "\n" not in message and caught.value.remedy
    with pytest.raises(InputError):
        next(read_frames(path))


def test_the_real_video_holds_fewer_frames_than_it_says(shared_data: Path) -> None:
    index = index_video(shared_data / "squat_video" / "video.mp4")
    assert len(index.time) == 807 and index.size == (720, 1280)
    np.testing.assert_allclose(index.time, np.arange(807) / 60, atol=1e-6)
    assert any("832" in note for note in index.notes)
