"""The sessions that the window is measured with, made from the embedded recording."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.views import made_up
from markerscope.app.models.imports import new_session
from markerscope.solver.body.bones import load_body
from markerscope.solver.core.markers import Markers
from markerscope.solver.fit.results import FittedMotion
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.pipeline.methods import graph_of
from markerscope.solver.pipeline.run import keys_of, run_stages
from markerscope.solver.pipeline.session import InputFile, Session, load_session, save_session

MARKERS = 50
VIDEO_SIZE = 1280, 720
_LONG_GOP = 250


def full_size(solved: Path, folder: Path) -> Path:
    """A solved session with as many markers and as large a video as the window's figures are promised for.

    Markers are added on the fitted skin, and the video is scaled up into a file whose key frames lie far apart. The
    fit is that of the session it is made from: nothing is solved again.
    """
    given = load_session(solved)
    keys = keys_of(given)
    known = {s.name: given.store.get(s.name, keys[s.name], s.result) for s in graph_of(given)}
    motion: FittedMotion = known["fit"]
    old = known["clean"].markers
    body = load_body()
    rng = np.random.default_rng(0)
    more = rng.choice(np.flatnonzero(body.marker_mask), max(MARKERS - len(old.labels), 0), replace=False)
    placed = body.pose(motion.rotations, motion.betas, motion.trans, more)[0]
    added = placed + rng.normal(0, 0.001, placed.shape)
    labels = (*old.labels, *(f"X{k:02d}" for k in range(len(more))))
    markers = Markers(np.concatenate([old.positions, added], axis=1), old.rate, labels, old.first_time)
    folder.mkdir(parents=True)
    write_c3d(folder / "markers.c3d", markers, up="z")
    video = given.inputs["video_file"].path
    enlarged(video, folder / "video.mp4")
    begun = new_session(folder / "markers.c3d", video=folder / "video.mp4")
    inputs = {name: InputFile(path) for name, path in begun["inputs"].items()}
    session = Session(folder, inputs, settings=begun["settings"])
    save_session(session)
    run_stages(session, ["clean", "segment"])
    scale = VIDEO_SIZE[1] / known["landmarks"].image_size[1]
    camera = replace(motion.camera, focal=motion.camera.focal * scale, image_size=VIDEO_SIZE)
    residual = np.concatenate([motion.residual, np.linalg.norm(added - placed, axis=2)], axis=1)
    motion = replace(
        motion,
        camera=camera,
        marker_joint=np.concatenate([motion.marker_joint, body.weights[more].argmax(axis=1)]),
        marker_vertex=np.concatenate([motion.marker_vertex, more]),
        placed=np.concatenate([motion.placed, placed], axis=1),
        residual=residual,
    )
    margin = 0.5 * (VIDEO_SIZE[0] - scale * known["landmarks"].image_size[0])
    landmarks = replace(
        known["landmarks"], image=known["landmarks"].image * scale + [margin, 0.0], image_size=VIDEO_SIZE
    )
    found = known | {"landmarks": landmarks, "fit": motion}
    for name, key in keys_of(session).items():
        if not session.store.has(name, key):
            session.store.put(name, key, found[name], {"seconds": 1.0, "headline": ""})
    return folder


def enlarged(video: Path, path: Path) -> None:
    """The same pictures at the same times, scaled to the height wanted with black at the sides."""
    import av
    import cv2

    width, height = VIDEO_SIZE
    with av.open(str(video)) as source, av.open(str(path), "w") as made:
        given = source.streams.video[0]
        stream = made.add_stream("libx264", rate=given.average_rate)
        stream.width, stream.height, stream.pix_fmt, stream.gop_size = width, height, "yuv420p", _LONG_GOP
        stream.codec_context.time_base = given.time_base
        stream.options = {"preset": "veryfast", "crf": "20", "sc_threshold": "0"}
        for frame in source.decode(given):
            picture = frame.to_ndarray(format="rgb24")
            scale = height / picture.shape[0]
            inner = cv2.resize(picture, (round(picture.shape[1] * scale), height))
            whole = np.zeros((height, width, 3), np.uint8)
            left = (width - inner.shape[1]) // 2
            whole[:, left : left + inner.shape[1]] = inner
            rng = np.random.default_rng(frame.pts)
            whole = np.clip(whole + rng.integers(-6, 7, whole.shape, dtype=np.int16), 0, 255).astype(np.uint8)
            shown = av.VideoFrame.from_ndarray(whole, format="rgb24")
            shown.pts, shown.time_base = frame.pts, frame.time_base
            made.mux(stream.encode(shown))
        made.mux(stream.encode())


def long_markers(path: Path) -> Path:
    """Ten minutes at 100 Hz of 60 markers on a body that swings its limbs."""
    positions = made_up(load_body(), frames=60_000, markers=60)["markers"].positions
    write_c3d(path, Markers(positions, 100.0, tuple(f"M{k}" for k in range(60))), up="z")
    return path


def many_markers(path: Path) -> Path:
    """Six seconds of 100 markers on twelve bodies that drift apart."""
    rng = np.random.default_rng(0)
    middles = rng.normal(0, 0.5, (1, 12, 3)) + 0.05 * rng.normal(0, 1, (600, 12, 3)).cumsum(axis=0) / 10
    on_them = rng.normal(0, 0.05, (1, 100, 3)) + 0.002 * rng.normal(0, 1, (600, 100, 3))
    positions = middles[:, np.arange(100) % 12] + on_them
    write_c3d(path, Markers(positions, 100.0, tuple(f"M{k}" for k in range(100))), up="z")
    return path
