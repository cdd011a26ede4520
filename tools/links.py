"""Make this tree's folders importable as ``markerscope``: ``python3 tools/links.py`` writes ``.links/`` beside them.

``.links/markerscope/`` holds the package's own files and a link to each folder (a junction on Windows), so that
with ``.links`` on the path Python, mypy and editors find what the wheel would hold, and nothing else: no folder of the
working directory, however it is called, comes between. The set-up connects its environment by a ``.pth`` file; another
working tree uses the same environment with ``PYTHONPATH=.links``, which goes before it. Standard library alone.
"""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

PARTS = ("app", "solver", "widgets", "resources")
"""The folders that are installed."""


def write_links(root: Path) -> Path:
    """The folder to put on the path, made or mended; several processes may do it at once."""
    folder = root / ".links"
    package = folder / "markerscope"
    package.mkdir(parents=True, exist_ok=True)
    own = {path.name for path in (root / "package").iterdir() if path.is_file()}
    for name in own:
        file, wanted = package / name, (root / "package" / name).read_bytes()
        if not file.exists() or file.read_bytes() != wanted:
            _move_in(file, lambda new, wanted=wanted: new.write_bytes(wanted))
    for part in PARTS:
        link, target = package / part, root / part
        if not _leads_to(link, target):
            _move_in(link, lambda new, target=target: _link(new, target))
    for other in package.iterdir():
        if other.name not in (*PARTS, *own, "__pycache__") and not other.name.startswith("."):
            _remove(other)
    return folder


def _leads_to(link: Path, target: Path) -> bool:
    try:
        return link.resolve(strict=True) == target.resolve(strict=True)
    except OSError:
        return False


def _move_in(place: Path, make: Callable[[Path], object]) -> None:
    """Make something under a name of this process's own and give it its place."""
    new = place.with_name(f".{place.name}-{os.getpid()}")
    _remove(new)
    make(new)
    try:
        os.replace(new, place)
    except OSError:  # a folder is there, or (on Windows) a junction
        _remove(place)
        with suppress(FileExistsError):
            os.rename(new, place)
    _remove(new)


def _link(link: Path, target: Path) -> None:
    if os.name == "nt":
        # A symbolic link needs rights that a user of Windows does not have; a junction does not.
        subprocess.run(["cmd", "/c", "mklink", "/J", str(link), str(target)], check=True, stdout=subprocess.DEVNULL)
    else:
        link.symlink_to(os.path.relpath(target, link.parent), target_is_directory=True)


def _remove(place: Path) -> None:
    """Take a link, file or folder away; what a link leads to stays."""
    with suppress(FileNotFoundError):
        if place.is_symlink() or place.is_file():
            place.unlink()
        elif os.name == "nt" and place.is_dir():
            try:
                os.rmdir(place)  # a junction goes as if it were empty
            except OSError:
                shutil.rmtree(place)
        elif place.is_dir():
            shutil.rmtree(place)


if __name__ == "__main__":
    print(write_links(Path(__file__).resolve().parents[1]))
