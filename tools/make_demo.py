"""Make the embedded session: markers, a rendered video and the truth behind both.

    VTK_DEFAULT_OPENGL_WINDOW=vtkEGLRenderWindow python -m tools.make_demo [OUT]

Everything in it comes from the generator in ``markerscope.solver.synth`` and this file; the same seed gives the same
session. Needs VTK with an off-screen OpenGL. Make it anew whenever the embedded body is baked anew.
"""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path

import numpy as np

from markerscope.resources import resource
from markerscope.solver.body.model import Body
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.meshes import vertex_normals
from markerscope.solver.io.export_c3d import write_c3d
from markerscope.solver.synth import Motion, corrupt, demo_motion, marker_paths, place_markers, vary_body
from markerscope.solver.synth.truth import Truth, save_truth
from tools.demo_look import paint

SEED = 11
RATE, SECONDS = 100.0, 10.0  # of the markers
FRAME_RATE, OFFSET = 30, 0.37  # Hz; s, marker time of the first video frame
FRAMES = 282
WIDTH, HEIGHT, FOCAL = 640, 480, 600.0  # px
EYE, LOOK_AT, ROLL = (0.75, -3.35, 1.62), (0.05, 0.0, 0.80), 0.02  # m, m, rad


def camera() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``K``, ``R`` and ``t`` of the session's camera (see ``Truth``), somewhat pitched, turned and rolled."""
    eye, ahead = np.array(EYE), np.array(LOOK_AT) - np.array(EYE)
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    upright = np.stack([right, np.cross(ahead, right), ahead])
    c, s = np.cos(ROLL), np.sin(ROLL)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]) @ upright
    matrix = np.array([[FOCAL, 0, (WIDTH - 1) / 2], [0, FOCAL, (HEIGHT - 1) / 2], [0, 0, 1]])
    return matrix, turn, -turn @ eye


def session() -> tuple[Markers, Truth]:
    """The markers of the embedded session and what made them."""
    rng = np.random.default_rng(SEED)
    plain = Body.load()
    body = vary_body(plain, rng)
    betas = rng.normal(0, 0.8, plain.shape_count)
    motion = demo_motion(body, betas, seconds=SECONDS, rate=RATE, seed=SEED)
    placement = place_markers(body, betas, rng)
    markers, order = corrupt(marker_paths(body, betas, motion, placement), body, betas, motion, placement, rng)
    K, R, t = camera()
    vertex, joint = placement.vertex[order], placement.joint[order]
    return markers, Truth(body, betas, motion, vertex, joint, K, R, t, (WIDTH, HEIGHT), OFFSET)


def make(folder: Path) -> None:
    """Write ``session.c3d``, ``video.mp4`` and ``truth.npz``."""
    markers, truth = session()
    folder.mkdir(parents=True, exist_ok=True)
    write_c3d(folder / "session.c3d", markers, up="z")
    save_truth(folder / "truth.npz", truth)
    _render(folder / "video.mp4", truth.body, truth.betas, truth.motion)


def _render(path: Path, body: Body, betas: np.ndarray, motion: Motion) -> None:
    import av

    scene = _Scene(body, betas)
    times = OFFSET + np.arange(FRAMES) / FRAME_RATE
    picked = np.round(times * RATE).astype(int)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=Fraction(FRAME_RATE), options={"crf": "24", "preset": "slow"})
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        for start in range(0, FRAMES, 20):
            rows = picked[start : start + 20]
            surfaces, _ = body.pose(motion.rotations[rows], betas, motion.trans[rows])
            for surface in surfaces:
                container.mux(stream.encode(av.VideoFrame.from_ndarray(scene.picture(surface), format="rgb24")))
        container.mux(stream.encode(None))


class _Scene:
    """A painted body in a plain room, seen by the session's camera."""

    def __init__(self, body: Body, betas: np.ndarray) -> None:
        from vtkmodules.util.numpy_support import numpy_to_vtk
        from vtkmodules.vtkCommonCore import vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkPolyData
        from vtkmodules.vtkRenderingCore import vtkRenderer
        from vtkmodules.vtkRenderingOpenGL2 import vtkOpenGLRenderWindow  # noqa: F401  registers the backend

        self._faces = body.faces
        self._to_vtk = numpy_to_vtk
        self._mesh, self._shadow = vtkPolyData(), vtkPolyData()
        cells = _cells(body.faces)
        colours = numpy_to_vtk(paint(body, betas), deep=1)
        for mesh in (self._mesh, self._shadow):
            mesh.SetPoints(vtkPoints())
            mesh.SetPolys(cells)
        self._mesh.GetPointData().SetScalars(colours)
        self._renderer = vtkRenderer()
        self._furnish()
        self._window = self._open()

    def picture(self, surface: np.ndarray) -> np.ndarray:
        """(H, W, 3) uint8 RGB of the room with the body's surface (V, 3) m."""
        from vtkmodules.util.numpy_support import vtk_to_numpy
        from vtkmodules.vtkRenderingCore import vtkWindowToImageFilter

        points = self._to_vtk(np.ascontiguousarray(surface), deep=1)
        self._mesh.GetPoints().SetData(points)
        normals = self._to_vtk(vertex_normals(surface, self._faces), deep=1)
        self._mesh.GetPointData().SetNormals(normals)
        flat = surface + surface[:, 2:] * np.array([0.25, 0.15, -1.0])
        flat[:, 2] = 0.003
        self._shadow.GetPoints().SetData(self._to_vtk(flat, deep=1))
        for mesh in (self._mesh, self._shadow):
            mesh.GetPoints().Modified()
            mesh.Modified()
        self._window.Render()
        grab = vtkWindowToImageFilter()
        grab.SetInput(self._window)
        grab.ReadFrontBufferOff()
        grab.Update()
        image = grab.GetOutput()
        pixels = vtk_to_numpy(image.GetPointData().GetScalars())
        return np.ascontiguousarray(pixels.reshape(HEIGHT, WIDTH, 3)[::-1])

    def _furnish(self) -> None:
        from vtkmodules.vtkRenderingCore import vtkActor, vtkLight, vtkPolyDataMapper

        def show(mesh, colour=None, *, lit: bool = True, opacity: float = 1.0) -> None:
            mapper = vtkPolyDataMapper()
            mapper.SetInputData(mesh)
            actor = vtkActor()
            actor.SetMapper(mapper)
            look = actor.GetProperty()
            look.SetInterpolationToGouraud()
            look.SetAmbient(0.38)
            look.SetDiffuse(0.85)
            look.SetSpecular(0.04)
            look.SetOpacity(opacity)
            look.SetLighting(lit)
            if colour is not None:
                mapper.ScalarVisibilityOff()
                look.SetColor(*colour)
            self._renderer.AddActor(actor)

        show(self._mesh)
        show(self._shadow, (0.20, 0.18, 0.17), lit=False)
        for mesh in _floor():
            show(mesh)
        for mesh, colour in _walls():
            show(mesh, colour)
        for place, strength in (((1.0, -3.0, 4.0), 0.75), ((-3.5, -2.0, 2.5), 0.35)):
            light = vtkLight()
            light.SetPosition(*place)
            light.SetFocalPoint(0, 0, 0.8)
            light.SetIntensity(strength)
            self._renderer.AddLight(light)
        self._renderer.SetBackground(0.75, 0.76, 0.78)

    def _open(self):
        from vtkmodules.vtkRenderingCore import vtkRenderWindow

        _, turn, shift = camera()
        eye = -turn.T @ shift
        lens = self._renderer.GetActiveCamera()
        lens.SetPosition(*eye)
        lens.SetFocalPoint(*(eye + turn[2]))
        lens.SetViewUp(*-turn[1])
        lens.SetViewAngle(float(np.degrees(2 * np.arctan(HEIGHT / 2 / FOCAL))))
        lens.SetClippingRange(0.5, 15.0)
        window = vtkRenderWindow()
        window.SetOffScreenRendering(1)
        window.SetMultiSamples(8)
        window.SetSize(WIDTH, HEIGHT)
        window.AddRenderer(self._renderer)
        return window


def _cells(faces: np.ndarray):
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    cells = vtkCellArray()
    cells.SetData(faces.shape[1], numpy_to_vtkIdTypeArray(faces.astype(np.int64).ravel(), deep=1))
    return cells


def _quads(corners: np.ndarray, colours: np.ndarray | None = None):
    """Quadrilaterals (N, 4, 3) m, each of one colour (N, 3) uint8."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkPolyData

    mesh, points = vtkPolyData(), vtkPoints()
    points.SetData(numpy_to_vtk(corners.reshape(-1, 3).astype(float), deep=1))
    mesh.SetPoints(points)
    mesh.SetPolys(_cells(np.arange(4 * len(corners)).reshape(-1, 4)))
    if colours is not None:
        mesh.GetCellData().SetScalars(numpy_to_vtk(colours.astype(np.uint8), deep=1))
    return mesh


def _floor() -> list:
    """Boards of slightly different wood."""
    tones = np.random.default_rng(1).uniform(0.93, 1.0, (40, 1)) * np.array([[150, 132, 112]])
    left = np.linspace(-5, 5, 41)[:-1]
    boards = [[[x, -3.5, 0], [x + 0.24, -3.5, 0], [x + 0.24, 4, 0], [x, 4, 0]] for x in left]
    gaps = [[[x + 0.24, -3.5, 0], [x + 0.25, -3.5, 0], [x + 0.25, 4, 0], [x + 0.24, 4, 0]] for x in left]
    return [_quads(np.array(boards), tones), _quads(np.array(gaps), tones * 0.8)]


def _walls() -> list:
    wall = [[-5, 3.2, 0], [5, 3.2, 0], [5, 3.2, 3.5], [-5, 3.2, 3.5]]
    side = [[-3.6, -4, 0], [-3.6, 3.2, 0], [-3.6, 3.2, 3.5], [-3.6, -4, 3.5]]
    board = [[-5, 3.19, 0], [5, 3.19, 0], [5, 3.19, 0.09], [-5, 3.19, 0.09]]
    picture = [[0.9, 3.18, 1.3], [1.9, 3.18, 1.3], [1.9, 3.18, 2.0], [0.9, 3.18, 2.0]]
    colours = [(0.80, 0.81, 0.80), (0.72, 0.74, 0.75), (0.92, 0.92, 0.90), (0.36, 0.48, 0.55)]
    return [(_quads(np.array([corners], dtype=float)), c) for corners, c in zip((wall, side, board, picture), colours)]


if __name__ == "__main__":
    make(Path(sys.argv[1]) if len(sys.argv) > 1 else resource("demo"))
