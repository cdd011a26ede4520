"""The program as it is installed, from a wheel or by links, among neighbours that have its folders' names."""

from __future__ import annotations

import importlib.util
import json
import os
import runpy
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tools.links import PARTS, write_links

ROOT = Path(__file__).parents[1]
BIN = "Scripts" if os.name == "nt" else "bin"
SYNTH = ("synth", "walk", "--frames", 12, "--markers", 6, "--quiet")
TRAP = "raise RuntimeError('a stranger was imported')\n"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built from a copy: a build folder in the tree would leak into the next wheel."""
    pytest.importorskip("setuptools", minversion="77")
    tree, out = tmp_path_factory.mktemp("tree"), tmp_path_factory.mktemp("wheel")
    for part in (*PARTS, "package"):
        shutil.copytree(ROOT / part, tree / part, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("setup.py", "pyproject.toml", "README.md", "LICENSE", "NOTICE"):
        shutil.copy(ROOT / name, tree / name)
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "wheel", "--quiet"]
    subprocess.run([*pip, "--no-deps", "--no-index", "--no-build-isolation", "-w", out, tree], check=True)
    (built,) = out.glob("*.whl")
    return built


class Place:
    """An environment of its own that sees this one's libraries, and of Markerscope what was put into it."""

    def __init__(self, folder: Path) -> None:
        venv.create(folder, symlinks=os.name != "nt")
        self.bin = folder / BIN
        self.python = self.bin / ("python.exe" if os.name == "nt" else "python")
        paths = {"base": str(folder), "platbase": str(folder)}
        self.packages = Path(sysconfig.get_path("purelib", "venv", paths))
        # The .pth files of a folder that is itself named by one are not read: no finder of this environment gets in.
        libraries = dict.fromkeys(sysconfig.get_path(kind) for kind in ("purelib", "platlib"))
        (self.packages / "libraries.pth").write_text("\n".join(libraries), encoding="locale")

    def run(self, *words: object, cwd: Path, path: Path | None = None) -> subprocess.CompletedProcess[str]:
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        environment |= {"PYTHONPATH": str(path)} if path else {}
        line = [str(word) for word in words]
        return subprocess.run(line, cwd=cwd, env=environment, capture_output=True, text=True)


@pytest.fixture(scope="module")
def from_wheel(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Place:
    place = Place(tmp_path_factory.mktemp("installed"))
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", place.python, "install", "--quiet"]
    # What an editable install of an earlier version left in the tree, which is on the path, would count as installed.
    subprocess.run([*pip, "--no-deps", "--no-index", "--ignore-installed", wheel], check=True)
    return place


@pytest.fixture(scope="module")
def from_links(tmp_path_factory: pytest.TempPathFactory) -> Place:
    """What the set-up does to its environment, done to another one."""
    place = Place(tmp_path_factory.mktemp("linked"))
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "tools")
        spec = importlib.util.spec_from_file_location("setup_env", ROOT / "tools" / "setup_env.py")
        assert spec and spec.loader
        setup_env = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(setup_env)
        patch.setattr(setup_env, "PYTHON", place.python)
        patch.setattr(setup_env, "BIN", place.bin)
        setup_env.connect()
    return place


@pytest.fixture(params=["from_wheel", "from_links"])
def place(request: pytest.FixtureRequest) -> Place:
    made: Place = request.getfixturevalue(request.param)
    return made


@contextmanager
def strangers(folder: Path) -> Iterator[Path]:
    """Modules, packages and folders of our names, in a folder for a while."""
    made = [folder / "app.py", folder / "solver.py"]
    for path in made:
        path.write_text(TRAP)
    for name in ("widgets", "resources", "app", "tools"):
        made.append(folder / name)
        made[-1].mkdir()
        (made[-1] / "__init__.py").write_text(TRAP)
    try:
        yield folder
    finally:
        for path in made:
            shutil.rmtree(path) if path.is_dir() else path.unlink()


def bare_clone(folder: Path) -> None:
    """A folder that is called as the package is: the parent of a clone, or of results."""
    (folder / "markerscope" / "app").mkdir(parents=True)
    (folder / "markerscope" / "app" / "__init__.py").write_text(TRAP)


def works(place: Place, cwd: Path, *start: object, path: Path | None = None) -> None:
    out = cwd / "made"
    done = place.run(*start, *SYNTH, "--out", out, cwd=cwd, path=path)
    assert done.returncode == 0, done.stderr
    assert (out / "markers.c3d").exists()
    shutil.rmtree(out)


def test_strangers_in_the_working_folder(place: Place, tmp_path: Path) -> None:
    bare_clone(tmp_path)
    with strangers(tmp_path):
        works(place, tmp_path, place.bin / "markerscope")
        works(place, tmp_path, place.python, "-m", "markerscope.app")


def test_strangers_on_the_path(place: Place, tmp_path: Path) -> None:
    other = tmp_path / "other"
    other.mkdir()
    bare_clone(other)
    with strangers(other):
        works(place, tmp_path, place.bin / "markerscope", path=other)


def test_strangers_that_are_installed(place: Place, tmp_path: Path) -> None:
    with strangers(place.packages):
        works(place, tmp_path, place.bin / "markerscope")


def test_another_package_of_our_name_in_the_working_folder(place: Place, tmp_path: Path) -> None:
    (tmp_path / "markerscope").mkdir()
    (tmp_path / "markerscope" / "__init__.py").write_text(TRAP)
    works(place, tmp_path, place.bin / "markerscope")
    done = place.run(place.python, "-m", "markerscope.app", "--version", cwd=tmp_path)
    assert "a stranger was imported" in done.stderr, "Python itself prefers the working folder: the trap is one"


def test_links_of_another_tree_go_first(from_links: Place, tmp_path: Path) -> None:
    """Several working trees, one environment."""
    for part in (*PARTS, "package"):
        (tmp_path / part).mkdir()
    (tmp_path / "package" / "__init__.py").write_text("")
    (tmp_path / "solver" / "__init__.py").write_text("print('the other tree')")
    links = write_links(tmp_path)
    done = from_links.run(from_links.python, "-c", "import markerscope.solver", cwd=tmp_path, path=links)
    assert done.stdout.strip() == "the other tree"


def test_links_are_mended(tmp_path: Path) -> None:
    for part in (*PARTS, "package"):
        (tmp_path / part).mkdir()
    (tmp_path / "package" / "__init__.py").write_text("'now'")
    package = write_links(tmp_path) / "markerscope"
    before = {path.name: path.lstat().st_ino for path in package.iterdir()}
    assert before.keys() == {*PARTS, "__init__.py"}
    write_links(tmp_path)
    assert {path.name: path.lstat().st_ino for path in package.iterdir()} == before, "what is right stays"
    (package / "app").unlink()
    (package / "app").mkdir()  # as a tool that copies links would have it
    (package / "solver").unlink()
    (package / "solver").symlink_to(tmp_path / "gone")
    (package / "older").symlink_to(tmp_path / "app")
    (package / "__init__.py").write_text("'before'")
    write_links(tmp_path)
    assert {path.name for path in package.iterdir()} == {*PARTS, "__init__.py"}
    assert all((package / part).resolve() == tmp_path / part for part in PARTS)
    assert (package / "__init__.py").read_text() == "'now'" and (tmp_path / "app").is_dir()


def test_the_wheel_holds_every_file_and_no_other_name(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as file:
        held = {name for name in file.namelist() if ".dist-info/" not in name}
    there = {path.relative_to(ROOT) for part in PARTS for path in (ROOT / part).rglob("*") if path.is_file()}
    wanted = {f"markerscope/{path.as_posix()}" for path in there if "__pycache__" not in path.parts}
    assert held == wanted | {"markerscope/__init__.py", "markerscope/py.typed"}


def test_the_wheel_solves_the_demo_outside_of_the_tree(from_wheel: Place, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("demo", "--headless", "--out", out, "--quiet", "--json")
    done = from_wheel.run(from_wheel.bin / "markerscope", *words, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["evaluation"]["mpjpe_mm"] < 30
    ours = from_wheel.run(from_wheel.python, "-c", "import markerscope.app as m; print(m.__file__)", cwd=tmp_path)
    assert Path(ours.stdout.strip()).is_relative_to(from_wheel.packages)


def test_a_worker_of_a_frozen_application_begins_before_the_command_line(monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[str] = []
    monkeypatch.setattr("multiprocessing.freeze_support", lambda: done.append("worker"))
    monkeypatch.setattr("markerscope.app.cli.main.main", lambda: done.append("main"))
    with pytest.raises(SystemExit):
        runpy.run_module("markerscope.app", run_name="__main__")
    assert done == ["worker", "main"]


def test_no_module_is_loaded_by_its_bare_name(tmp_path: Path) -> None:
    """Started at the tree's root, where the bare names can be imported: by a solve, and by a window on it."""
    with zipfile.ZipFile(ROOT / "tests" / "pipeline" / "session-0.1.zip") as file:
        file.extractall(tmp_path)
    code = f"""
import sys
from pathlib import Path
from PySide6.QtWidgets import QApplication
from markerscope.app.cli.main import main

place = Path({str(tmp_path)!r})
out = place / "out"
words = ["solve", str(place / "markers.c3d"), "--prior", str(place / "prior.npz"), "--out", str(out), "--quiet"]
assert main(words) == 0
application = QApplication([])
from markerscope.app.models.home import Home
from markerscope.app.models.workbench import Workbench
from markerscope.app.window.main import MainWindow

window = MainWindow(Workbench(Home(place / "config", place / "data")))
window.open_path(out)
window.show()
for _ in range(20):
    application.processEvents()
assert "markerscope.solver.fit.method" in sys.modules and "markerscope.widgets.scene.view" in sys.modules
print(*sorted(name for name in sys.modules if name.split(".")[0] in {PARTS!r}))
window.leave()
"""
    environment = {**os.environ, "QT_QPA_PLATFORM": "offscreen", "VTK_DEFAULT_OPENGL_WINDOW": "vtkEGLRenderWindow"}
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert not done.stdout.split()
