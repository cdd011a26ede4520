"""Who may know whom: arrows point from ``app`` to ``widgets`` and ``solver``, and starting is quick."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
QT = {"PySide6", "PyQt6", "PyQt5", "shiboken6", "qtpy", "pyqtgraph", "superqt", "qtawesome"}
VTK = {"vtk", "vtkmodules", "pyvista", "pyvistaqt"}
FORBIDDEN = {
    "solver": {"app", "widgets", "tests", *QT, *VTK},
    "widgets": {"app", "solver", "tests"},
    "app": {"tests"},
    **{f"app/{room}": {"widgets", *QT, *VTK} for room in ("models", "actions")},
    "app/views": {*QT, *VTK},  # they make what widgets draw: its rows and colours, which are plain data
    "resources": {"app", "widgets", "tests", *QT},  # its scripts bake the body and render the embedded video
}
HEAVY = {"torch", "open3d", "cv2", "av", "ezc3d", "ai_edge_litert", "matplotlib", "jinja2", *QT, *VTK}
"""What a module may import only inside the function that needs it."""


def modules(room: str) -> list[Path]:
    return sorted((ROOT / room).rglob("*.py"))


def imported(path: Path, at_start: bool = False) -> set[str]:
    """First names of what a file imports: anywhere, or only as it is imported itself."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    if at_start:
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
    else:
        nodes = list(ast.walk(tree))
    names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and node.level == 0}
    return {name.split(".")[0] for name in names}


@pytest.mark.parametrize("room", FORBIDDEN)
def test_nobody_knows_whom_they_should_not(room: str) -> None:
    wrong = {
        str(path.relative_to(ROOT)): found for path in modules(room) if (found := imported(path) & FORBIDDEN[room])
    }
    assert not wrong


def test_the_walls_would_be_seen(tmp_path: Path) -> None:
    path = tmp_path / "x.py"
    path.write_text(
        "import os\ndef f():\n    from PySide6.QtCore import Qt\n    import vtk.util\nimport torch.nn as nn\n"
    )
    assert imported(path) == {"os", "PySide6", "vtk", "torch"}
    assert imported(path, at_start=True) == {"os", "torch"}


def test_no_module_of_the_solver_imports_heavy_libraries_at_its_start() -> None:
    wrong = {str(p.relative_to(ROOT)): found for p in modules("solver") if (found := imported(p, True) & HEAVY)}
    assert not wrong


def test_the_map_in_the_readme_is_true() -> None:
    chapter = (ROOT / "README.md").read_text(encoding="utf-8").split("## Architecture")[1].split("\n## ")[0]
    named = set(re.findall(r"`([\w/]+/|[\w/]+\.py)`", chapter))
    assert not {name for name in named if not (ROOT / name).exists()}
    rooms = {f"{path.relative_to(ROOT)}/" for path in ROOT.glob("[a-z]*/") if any(path.rglob("*.py"))}
    parts = {f"{path.relative_to(ROOT)}/" for path in ROOT.glob("solver/[a-z]*/") if any(path.glob("*.py"))}
    assert named >= rooms - {"solver/", "build/", "benchmarks/"}
    assert named >= parts - {"solver/cleaning/"}


def loaded_by(statements: str) -> set[str]:
    """First names of the modules that a fresh Python has loaded after some statements."""
    code = f"{statements}\nimport sys\nprint(*{{name.split('.')[0] for name in sys.modules}})"
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    return set(run.stdout.split())


@pytest.mark.parametrize("room", ["solver", "app/views"])
def test_importing_a_whole_room_loads_nothing_heavy(room: str) -> None:
    names = [".".join(path.relative_to(ROOT).with_suffix("").parts) for path in modules(room)]
    names = [name.removesuffix(".__init__") for name in names if not name.endswith("__main__")]
    assert not loaded_by("\n".join(f"import {name}" for name in names)) & HEAVY


def test_the_command_line_starts_without_any_library() -> None:
    assert not loaded_by("import markerscope.app.cli.main") & {*HEAVY, "numpy", "scipy"}


def test_waiting_threads_do_not_spin() -> None:
    run = "import os; os.environ.pop('OMP_WAIT_POLICY', None); import markerscope.app.cli.main; assert os.environ['OMP_WAIT_POLICY']"
    loaded_by(run)
