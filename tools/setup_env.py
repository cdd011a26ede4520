"""Set up everything Markerscope needs, then run a command: ``python3 tools/setup_env.py [--dev] [COMMAND ...]``.

Makes ``.venv`` beside this folder with the versions of ``constraints.txt``, with ``--dev`` the tools for tests and
development too, connects it to this folder by the links that ``links.py`` makes, and on Debian, as root, installs the
missing system libraries; another user is shown the exact line to run. A second run finds nothing to do and is instant.
Uses the standard library alone and starts on any Python 3, so that it can say which one is needed.
"""

from __future__ import annotations

import ctypes
import hashlib
import os
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import links
import torch_build

ROOT = Path(__file__).resolve().parents[1]
VENV = ROOT / ".venv"
STAMP = VENV / "markerscope-setup"
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
SUPPORTED = ((3, 11), (3, 12))

LIBRARIES = {
    "libegl1": "libEGL.so.1",
    "libgl1": "libGL.so.1",
    "libxkbcommon0": "libxkbcommon.so.0",
    "libfontconfig1": "libfontconfig.so.1",
    "libglib2.0-0": "libglib-2.0.so.0",
    "libdbus-1-3": "libdbus-1.so.3",
    "libusb-1.0-0": "libusb-1.0.so.0",
    "libgomp1": "libgomp.so.1",
}
"""Debian package -> the library in it that Qt, VTK, Open3D or torch cannot do without."""

WINDOW_LIBRARIES = {
    "libxcb-cursor0": "libxcb-cursor.so.0",
    "libxkbcommon-x11-0": "libxkbcommon-x11.so.0",
    "libxcb-icccm4": "libxcb-icccm.so.4",
    "libxcb-keysyms1": "libxcb-keysyms.so.1",
    "libxcb-shape0": "libxcb-shape.so.0",
    "libxcb-xkb1": "libxcb-xkb.so.1",
    "libxcb-randr0": "libxcb-randr.so.0",
    "libxcb-render-util0": "libxcb-render-util.so.0",
    "libxcb-image0": "libxcb-image.so.0",
    "libxcursor1": "libXcursor.so.1",
}
"""The same for a real window on X11."""

WINDOW_PROGRAMS = {"xvfb": "Xvfb", "xauth": "xauth"}
"""What the tests open a real window with where there is no screen."""


PROGRAM_MB, DEVELOPMENT_MB = 480, 190
"""Downloads on Linux x86-64, without torch: the program and what it needs; tools for tests and development."""

WITH_TOOLS = " with development tools\n"
"""End of the stamp of an environment that holds them."""


def main(command: list[str]) -> int:
    """Set up what is missing, then run ``command`` in the environment."""
    if sys.version_info[:2] not in SUPPORTED:
        return with_supported_python(command)
    development = command[:1] == ["--dev"]
    command = command[1:] if development else command
    if not is_set_up(development):
        install_system_libraries(development)
        make_environment()
        development = development or is_set_up(True, stale=True)
        install_packages(development)
        STAMP.write_text(fingerprint(development), encoding="utf-8")
    links.write_links(ROOT)
    return run_in_environment(command) if command else 0


def say(text: str) -> None:
    """Tell what is being done, on stderr, so that a command's own output stays clean."""
    print(f"setup: {text}", file=sys.stderr, flush=True)


def run(*command: str | Path, **kwargs: object) -> None:
    """Run a step of the set-up; its failure is the end."""
    line = [str(part) for part in command]
    done = subprocess.run(line, stdin=subprocess.DEVNULL, stdout=sys.stderr, **kwargs)  # type: ignore[call-overload]
    if done.returncode:
        sys.exit(f"setup: this step failed, its own words are above: {' '.join(line)}")


def with_supported_python(command: list[str]) -> int:
    """Start again under a Python that Markerscope supports, or say how to get one."""
    names = [f"python{major}.{minor}" for major, minor in SUPPORTED]
    for name in names:
        path = shutil.which(name)
        if path and subprocess.run([path, "-c", ""], stderr=subprocess.DEVNULL).returncode == 0:
            return subprocess.call([path, __file__, *command])
    have = ".".join(str(part) for part in sys.version_info[:2])
    how = " (on Debian 12: apt-get install python3 python3-venv)" if shutil.which("apt-get") else ""
    sys.exit(f"setup: Python 3.11 or 3.12 is needed and this is {have}; install one of them{how} and run this again.")


def is_set_up(development: bool, stale: bool = False) -> bool:
    """Whether the environment holds what is asked for: one with the development tools holds the program as well.

    With ``stale`` only whether it held that once, whatever it was made from.
    """
    if not (PYTHON.exists() and STAMP.exists()):
        return False
    found = STAMP.read_text(encoding="utf-8")
    if stale:
        return not development or found.endswith(WITH_TOOLS)
    return found == fingerprint(True) or (not development and found == fingerprint(False))


def fingerprint(development: bool) -> str:
    """What the environment was made from and what for; another answer means it must be made again."""
    digest = hashlib.sha256()
    own = (Path(__file__), Path(links.__file__), Path(torch_build.__file__))
    for part in (ROOT / "pyproject.toml", ROOT / "constraints.txt", *own):
        digest.update(part.read_bytes())
    return f"{digest.hexdigest()} {ROOT} {sys.version.split()[0]}{WITH_TOOLS if development else chr(10)}"


def has_library(name: str) -> bool:
    """Whether the loader finds a shared library."""
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def install_system_libraries(development: bool) -> None:
    """Install what no Python package carries, or say how to."""
    if not sys.platform.startswith("linux"):
        return
    needed = [package for package, library in LIBRARIES.items() if not has_library(library)]
    wished = [package for package, library in WINDOW_LIBRARIES.items() if not has_library(library)]
    if development:
        wished += [package for package, program in WINDOW_PROGRAMS.items() if not shutil.which(program)]
    if not has_venv():
        needed.append(f"python3.{sys.version_info[1]}-venv")
    missing = needed + wished
    if not missing:
        return
    line = f"apt-get install -y --no-install-recommends -o APT::Keep-Downloaded-Packages=false {' '.join(missing)}"
    if not shutil.which("apt-get"):
        say(f"these system libraries seem to be missing, install what holds them: {' '.join(missing)}")
    elif os.geteuid() == 0:
        say(line)
        environment = {**os.environ, "DEBIAN_FRONTEND": "noninteractive"}
        run("apt-get", "update", "-q", env=environment)
        run(*line.split(), env=environment)
    elif needed:
        sys.exit(f"setup: system libraries are missing; run this line, then start again:\n  sudo {line}")
    else:
        say(f"no window can be opened without these; to have it:\n  sudo {line}")


def has_venv() -> bool:
    """Whether this Python can make an environment with pip in it (Debian ships that apart)."""
    code = "import ensurepip, venv"
    return subprocess.run([sys.executable, "-c", code], stderr=subprocess.DEVNULL).returncode == 0


def make_environment() -> None:
    """Make ``.venv`` with this Python, anew if what is there is broken or of another version."""
    if PYTHON.exists():
        version = f"import sys; sys.exit(sys.version_info[:2] != {tuple(sys.version_info[:2])})"
        if subprocess.run([str(PYTHON), "-c", version], stderr=subprocess.DEVNULL).returncode == 0:
            return
    if VENV.exists():
        shutil.rmtree(VENV)
    say(f"making {VENV}")
    run(sys.executable, "-m", "venv", VENV)


def install_packages(development: bool) -> None:
    """Install what Markerscope needs, and tools for tests and development if asked for, as ``constraints.txt`` says."""
    pip = (PYTHON, "-m", "pip", "--disable-pip-version-check", "--no-cache-dir")  # else every package lies here twice
    constraints = ROOT / "constraints.txt"
    run(*pip, "install", "--quiet", "--constraint", constraints, "pip", "setuptools")
    version = torch_build.wanted_version(constraints)
    there = torch_build.installed_version(PYTHON).split("+")[0] == version
    choice = torch_build.choose(there, torch_build.has_nvidia())
    tools = DEVELOPMENT_MB if development else 0
    say(choice.why)
    say(f"downloading up to {PROGRAM_MB + tools + choice.megabytes} MB, once; this takes a few minutes")
    if choice.index and not torch_build.fetch_cpu_build(pip, version, choice.index):
        say(f"the download from {choice.index} failed, so torch is what pip finds: maybe the CUDA build, some 5 GB")
    run(*pip, "uninstall", "--quiet", "--quiet", "--yes", "markerscope")  # whose finder an older set-up left
    # Python compiles the tenth of the modules that is used as it is first imported.
    run(*pip, "install", "--no-compile", "--constraint", constraints, *requirements(development))
    run(*pip, "check")
    connect()


def requirements(development: bool) -> list[str]:
    """What ``pyproject.toml`` says that the program needs, and its tests and development."""
    import tomllib  # since Python 3.11

    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"]
    return [*project["dependencies"], *(extras["test"] + extras["dev"] if development else [])]


def connect() -> None:
    """Put this tree on the environment's path, and the command ``markerscope`` among its programs.

    By a ``.pth`` file, where an editable install would put a finder, which gives way to every folder of the working
    directory that is called as the package is. ``-P`` keeps that directory away from the command altogether.
    """
    ask = [str(PYTHON), "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    packages = Path(subprocess.run(ask, capture_output=True, text=True, check=True).stdout.strip())
    (packages / "markerscope.pth").write_text(f"{links.write_links(ROOT)}\n", encoding="locale")
    if os.name == "nt":
        (BIN / "markerscope.cmd").write_text('@"%~dp0python.exe" -P -m markerscope.app %*\n', encoding="ascii")
    else:
        command = BIN / "markerscope"
        command.unlink(missing_ok=True)
        command.write_text(f'#!/bin/sh\nexec {shlex.quote(str(PYTHON))} -P -m markerscope.app "$@"\n', encoding="utf-8")
        command.chmod(0o755)


def run_in_environment(command: list[str]) -> int:
    """Run a command with the environment's programs first on the path."""
    environment = {**os.environ, "PATH": f"{BIN}{os.pathsep}{os.environ.get('PATH', '')}", "VIRTUAL_ENV": str(VENV)}
    program = shutil.which(command[0], path=environment["PATH"])
    if program is None:
        sys.exit(f"setup: there is no program called {command[0]} in {BIN}")
    if os.name == "posix":
        os.execve(program, [program, *command[1:]], environment)
    return subprocess.call([program, *command[1:]], env=environment)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
