"""Who may know whom: one ordered list of rooms, each of which knows itself and those before it; and a quick start."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = "markerscope"
PARTS = ("resources", "solver", "widgets", "app")
ROOMS = (
    "resources",
    "solver",
    "solver.core",
    "solver.filters",
    "solver.safe_pickle",
    "solver.io",
    "solver.body",
    "solver.video",
    "solver.sync",
    "solver.clustering",
    "solver.cleaning",
    "solver.angles",
    "solver.events",
    "solver.cycles",
    "solver.figures",
    "solver.synth",
    "solver.datasets",
    "solver.fit",
    "solver.fit.labelled",
    "solver.fit.known",
    "solver.fit.standard_errors",
    "solver.fit.published",
    "solver.markerset",
    "solver.neural",
    "solver.neural.training",
    "solver.neural.per_layout",
    "solver.neural.layout_free",
    "solver.neural.posing",
    "solver.pipeline",
    "solver.evaluate",
    "solver.report",
    "solver.commands",
    "solver.subject",
    "solver.bench",
    "solver.api",
    "widgets",
    "widgets.plots",
    "widgets.tables",
    "widgets.panels",
    "widgets.scene",
    "widgets.video",
    "widgets.dialogs",
    "widgets.gallery",
    "app.models",
    "app.actions",
    "app.views",
    "app.window",
    "app.cli",
    "app",
)
"""In order; a module belongs to the room with the longest name that its own begins with."""
RANK = {room: rank for rank, room in enumerate(ROOMS)}

QT = {"PySide6", "PyQt6", "PyQt5", "shiboken6", "qtpy", "pyqtgraph", "superqt", "qtawesome"}
VTK = {"vtk", "vtkmodules", "pyvista", "pyvistaqt"}
FORBIDDEN = {
    "resources": {*QT, *VTK},
    "solver": {*QT, *VTK},
    "widgets": {f"{PACKAGE}.solver"},
    **{f"app/{room}": {f"{PACKAGE}.widgets", *QT, *VTK} for room in ("models", "actions")},
    "app/views": {*QT, *VTK},  # they make what widgets draw: its rows and colours, which are plain data
}
"""What the order alone would allow."""
OUTSIDE = {"tests", "tools", "benchmarks"}
"""What nothing that is installed may know."""
HEAVY = {"torch", "open3d", "cv2", "av", "ezc3d", "ai_edge_litert", "matplotlib", "jinja2", *QT, *VTK}
"""What a module may import only inside the function that needs it."""


def modules(part: str) -> list[Path]:
    return sorted((ROOT / part).rglob("*.py"))


def name_of(path: Path) -> str:
    """What a file is imported as, below the package."""
    return ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")


MODULES = {name_of(path): path for part in PARTS for path in modules(part)}


def room_of(name: str) -> str:
    """The room of a module, from its name below the package; a name in a module has the module's."""
    while name not in RANK:
        name, dot, _ = name.rpartition(".")
        assert dot, "every part of the package is a room"
    return name


def nodes_of(tree: ast.AST, at_start: bool) -> list[ast.AST]:
    """All nodes, or those alone that run as the file is imported."""
    if not at_start:
        return list(ast.walk(tree))
    nodes: list[ast.AST] = []
    frontier: list[ast.AST] = [tree]
    while frontier:
        for node in ast.iter_child_nodes(frontier.pop()):
            lazy = isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) or (
                isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
            )
            if not lazy:
                nodes.append(node)
                frontier.append(node)
    return nodes


def imported(path: Path, at_start: bool = False) -> set[str]:
    """Full names of the modules, or of what is in them, that a file imports: anywhere, or as it is imported itself."""
    names: set[str] = set()
    for node in nodes_of(ast.parse(path.read_text(encoding="utf-8")), at_start):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            here = path.relative_to(ROOT).parent.parts if path.is_relative_to(ROOT) else ()
            above = [PACKAGE, *here][: len(here) + 2 - node.level] if node.level else []
            start = ".".join([*above, *([node.module] if node.module else [])])
            names |= {f"{start}.{alias.name}" for alias in node.names}
    return names


def within(name: str, packages: set[str]) -> bool:
    return any(name == package or name.startswith(f"{package}.") for package in packages)


def outsiders(path: Path, at_start: bool = False) -> set[str]:
    """First names of what a file imports."""
    return {name.split(".")[0] for name in imported(path, at_start)}


def upward(path: Path) -> set[str]:
    """What a file imports from rooms that come after its own."""
    own = RANK[room_of(name_of(path))]
    below = {name.removeprefix(f"{PACKAGE}.") for name in imported(path) if name.startswith(f"{PACKAGE}.")}
    return {name for name in below if RANK[room_of(name)] > own}


@pytest.mark.parametrize("part", PARTS)
def test_every_room_knows_only_those_before_it(part: str) -> None:
    wrong = {name_of(path): found for path in modules(part) if (found := upward(path))}
    assert not wrong


def test_the_list_has_every_room_once() -> None:
    assert len(RANK) == len(ROOMS)
    assert not {room for room in ROOMS if room not in MODULES}
    loose = {name for name in MODULES if name.count(".") == 1 and MODULES[name].name == "__init__.py"} - RANK.keys()
    assert not loose, "a folder has no place in the order"


def test_nothing_lies_loose_beside_the_rooms() -> None:
    assert {path.name for path in (ROOT / "solver").glob("*.py")} == {"__init__.py"}
    assert {path.name for path in (ROOT / "app").glob("*.py")} == {"__init__.py", "__main__.py"}
    assert {path.name for path in (ROOT / "resources").glob("*.py")} == {"__init__.py"}


@pytest.mark.parametrize("part", FORBIDDEN)
def test_nobody_knows_whom_they_should_not(part: str) -> None:
    wrong = {
        name_of(path): found
        for path in modules(part)
        if (found := {name for name in imported(path) if within(name, FORBIDDEN[part])})
    }
    assert not wrong


@pytest.mark.parametrize("part", PARTS)
def test_nothing_that_is_installed_knows_what_is_not(part: str) -> None:
    wrong = {name_of(path): found for path in modules(part) if (found := outsiders(path) & {*OUTSIDE, *PARTS})}
    assert not wrong


def test_the_walls_would_be_seen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "solver" / "io" / "x.py"
    path.parent.mkdir(parents=True)
    path.write_text(
        "import os\nfrom markerscope.solver import fit\n"
        "def f():\n    from PySide6.QtCore import Qt\n    import vtk.util\n    from ..pipeline import run\n"
        "import torch.nn\n"
    )
    monkeypatch.setattr(f"{__name__}.ROOT", tmp_path)
    assert outsiders(path) == {"os", "PySide6", "vtk", "torch", PACKAGE}
    assert outsiders(path, at_start=True) == {"os", "torch", PACKAGE}
    assert upward(path) == {"solver.fit", "solver.pipeline.run"}


def test_the_list_is_that_of_the_architecture_page() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    table = page.split("## The rooms, in order")[1].split("\n## ")[0]
    shown = re.findall(r"^\| `([\w/]+)` \|", table, re.M)
    assert tuple(place.replace("/", ".") for place in shown) == ROOMS


def test_every_place_that_the_architecture_page_names_is_there() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    named = set(re.findall(r"`(\w+(?:/\w+)+/?|\w+/|\w+/[\w/]*\w\.py)`", page))
    assert len(named) > len(ROOMS)
    assert not {name for name in named if not (ROOT / name).exists() and not (ROOT / f"{name}.py").exists()}


def test_no_module_of_the_solver_imports_heavy_libraries_at_its_start() -> None:
    wrong = {name_of(path): found for path in modules("solver") if (found := outsiders(path, True) & HEAVY)}
    assert not wrong


def loaded_by(statements: str) -> set[str]:
    """First names of the modules that a fresh Python has loaded after some statements."""
    code = f"{statements}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split())


@pytest.mark.parametrize("part", ["solver", "app/views"])
def test_importing_a_whole_room_loads_nothing_heavy(part: str) -> None:
    names = [name_of(path) for path in modules(part) if path.stem != "__main__"]
    loaded = loaded_by("\n".join(f"import {PACKAGE}.{name}" for name in names))
    assert PACKAGE in loaded and not loaded & HEAVY


def test_the_command_line_starts_without_any_library() -> None:
    assert not loaded_by("import markerscope.app.cli.main") & {*HEAVY, "numpy", "scipy"}


def test_waiting_threads_do_not_spin() -> None:
    forget = "import os; os.environ.pop('OMP_WAIT_POLICY', None)"
    loaded_by(f"{forget}; import markerscope.app.cli.main; assert os.environ['OMP_WAIT_POLICY']")
