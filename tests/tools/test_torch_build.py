"""Where a fresh environment takes torch from, against a small index on the loopback address."""

from __future__ import annotations

import base64
import hashlib
import importlib.util
import os
import sys
import threading
import time
import venv as venv_module
import zipfile
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def build() -> Iterator[ModuleType]:
    name = "torch_build"
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up there
    spec.loader.exec_module(module)
    yield module
    del sys.modules[name]


class Quiet(SimpleHTTPRequestHandler):
    delay_s = 0.0

    def do_GET(self) -> None:
        time.sleep(self.delay_s)
        super().do_GET()

    def log_message(self, format: str, *args: object) -> None:
        pass


class Slow(Quiet):
    delay_s = 2.0


class Server(ThreadingHTTPServer):
    """Says nothing where a client hangs up, which it may notice in the middle of another test."""

    def handle_error(self, request: object, client_address: object) -> None:
        pass


def serve(folder: Path, handler: type[Quiet]) -> Iterator[str]:
    server = Server(("127.0.0.1", 0), partial(handler, directory=str(folder)))
    server.daemon_threads = True
    server.block_on_close = False
    threading.Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
    yield f"http://127.0.0.1:{server.server_address[1]}"
    server.shutdown()
    server.server_close()


@pytest.fixture(scope="module")
def shelf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The files of an index with one build of torch, some bytes large."""
    folder = tmp_path_factory.mktemp("index")
    page = folder / "torch"
    page.mkdir()
    wheel = page / "torch-2.13.0+cpu-py3-none-any.whl"
    files = {
        "torch/__init__.py": b"",
        "torch-2.13.0+cpu.dist-info/METADATA": b"Metadata-Version: 2.1\nName: torch\nVersion: 2.13.0+cpu\n",
        "torch-2.13.0+cpu.dist-info/WHEEL": b"Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    }
    with zipfile.ZipFile(wheel, "w") as archive:
        record = ""
        for name, content in files.items():
            archive.writestr(name, content)
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record += f"{name},sha256={digest},{len(content)}\n"
        archive.writestr("torch-2.13.0+cpu.dist-info/RECORD", record + "torch-2.13.0+cpu.dist-info/RECORD,,\n")
    (page / "index.html").write_text(f'<a href="{wheel.name.replace("+", "%2B")}">{wheel.name}</a>', encoding="utf-8")
    return folder


@pytest.fixture
def index(shelf: Path) -> Iterator[str]:
    yield from serve(shelf, Quiet)


@pytest.fixture
def slow(shelf: Path) -> Iterator[str]:
    yield from serve(shelf, Slow)


@pytest.fixture
def absent(shelf: Path) -> str:
    """The address of an index that is not there: its port was free a moment ago."""
    running = serve(shelf, Quiet)
    address = next(running)
    next(running, None)
    return address


def test_an_index_that_answers_gives_the_cpu_build(build: ModuleType, index: str) -> None:
    choice = build.choose(installed=False, nvidia=False, platform="linux", index=index)
    assert choice.index == index
    assert choice.megabytes == build.CPU_MB
    assert "\n" not in choice.why


def test_a_slow_index_is_left_for_plain_torch(build: ModuleType, slow: str) -> None:
    choice = build.choose(installed=False, nvidia=False, platform="linux", index=slow, seconds=0.2)
    assert choice.index is None
    assert choice.megabytes == build.CUDA_MB
    assert "does not answer within 0.2 s" in choice.why


def test_an_absent_index_is_left_for_plain_torch(build: ModuleType, absent: str) -> None:
    choice = build.choose(installed=False, nvidia=False, platform="linux", index=absent)
    assert choice.index is None
    assert absent in choice.why


def test_an_index_without_torch_is_left_for_plain_torch(build: ModuleType, tmp_path: Path) -> None:
    running = serve(tmp_path, Quiet)
    assert build.choose(installed=False, nvidia=False, platform="linux", index=next(running)).index is None
    next(running, None)


@pytest.mark.parametrize(
    ("installed", "nvidia", "platform", "megabytes"),
    [
        (True, False, "linux", 0),
        (False, True, "linux", 2600),
        (False, False, "darwin", 200),
        (False, False, "win32", 200),
    ],
)
def test_the_index_is_not_asked_where_its_answer_does_not_matter(
    build: ModuleType, monkeypatch: pytest.MonkeyPatch, installed: bool, nvidia: bool, platform: str, megabytes: int
) -> None:
    def asked(index: str, seconds: float) -> bool:
        raise AssertionError("the index was asked")

    monkeypatch.setattr(build, "answers", asked)
    choice = build.choose(installed, nvidia, platform)
    assert choice.index is None
    assert choice.megabytes == megabytes


def test_a_device_or_its_driver_is_found(build: ModuleType, tmp_path: Path) -> None:
    nowhere = tmp_path / "none"
    assert not build.has_nvidia(tmp_path, nowhere)
    (tmp_path / "nvidia0").touch()
    assert build.has_nvidia(tmp_path, nowhere)
    assert build.has_nvidia(nowhere, tmp_path)


def test_the_build_is_installed_from_the_index(
    build: ModuleType, index: str, absent: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in list(os.environ):
        if name.startswith("PIP_"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("PIP_CONFIG_FILE", os.devnull)
    venv = tmp_path / "venv"
    venv_module.create(venv, with_pip=False)
    python = venv / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--python", python)
    assert build.installed_version(python) == ""
    assert not build.fetch_cpu_build(pip, "2.13.0", absent)
    assert build.installed_version(python) == ""
    assert build.fetch_cpu_build(pip, "2.13.0", index)
    assert build.installed_version(python) == "2.13.0+cpu"


def test_the_version_is_the_pinned_one(build: ModuleType) -> None:
    assert build.wanted_version(ROOT / "constraints.txt") == "2.13.0"
