"""Which build of torch a fresh environment gets: the CPU build where a CUDA build would be 5 GB for nothing.

On Linux the ordinary torch package is the CUDA build. Where the machine has no NVIDIA device, PyTorch's own index of
CPU builds is asked first, with a short time limit; where it does not answer, pip takes the ordinary torch. Standard
library alone: this runs before anything is installed.
"""

from __future__ import annotations

import subprocess
import sys
import urllib.request
from collections.abc import Sequence
from dataclasses import dataclass
from http.client import HTTPException
from pathlib import Path

CPU_INDEX = "https://download.pytorch.org/whl/cpu"
"""PyTorch's own public index of CPU builds."""

ANSWER_S = 5.0
"""How long that index may take to answer at all."""

STALL_S = 20
"""How long its download may stand still."""

CPU_MB, CUDA_MB = 200, 2600
"""Downloads of torch 2.13.0 on Linux x86-64: the CPU build; the CUDA build with the libraries that it needs."""


@dataclass(frozen=True)
class Choice:
    """Where torch comes from.

    Attributes
    ----------
    index : address of the package index to ask first, None for pip's own
    megabytes : about how much will be downloaded for torch, 0 where it is there already
    why : one line for the user
    """

    index: str | None
    megabytes: int
    why: str


def has_nvidia(devices: Path = Path("/dev"), driver: Path = Path("/proc/driver/nvidia/version")) -> bool:
    """Whether a CUDA build could be of use: an NVIDIA device, or the driver of one."""
    return driver.exists() or any(devices.glob("nvidia[0-9]*")) or (devices / "dxg").exists()


def answers(index: str, seconds: float) -> bool:
    """Whether the index has a page of torch, within ``seconds``."""
    try:
        with urllib.request.urlopen(f"{index.rstrip('/')}/torch/", timeout=seconds) as page:
            return page.status == 200 and bool(page.read(1))
    except (OSError, ValueError, HTTPException):
        return False


def choose(
    installed: bool,
    nvidia: bool,
    platform: str = sys.platform,
    index: str = CPU_INDEX,
    seconds: float = ANSWER_S,
) -> Choice:
    """Decide where torch comes from; asks the index only where its answer matters."""
    if installed:
        return Choice(None, 0, "torch is there already and is kept")
    if not platform.startswith("linux"):
        return Choice(None, CPU_MB, "the ordinary torch of this system is the CPU build")
    if nvidia:
        return Choice(None, CUDA_MB, "there is an NVIDIA device, so torch is the CUDA build")
    if answers(index, seconds):
        return Choice(index, CPU_MB, f"no NVIDIA device, so torch is the CPU build from {index}")
    return Choice(
        None, CUDA_MB, f"{index} does not answer within {seconds:g} s, so torch is what pip finds: maybe the CUDA build"
    )


def installed_version(python: Path) -> str:
    """Version of torch in an environment, empty if it has none."""
    code = "import importlib.metadata as m; print(m.version('torch'))"
    done = subprocess.run([str(python), "-c", code], capture_output=True, text=True)
    return done.stdout.strip() if done.returncode == 0 else ""


def wanted_version(constraints: Path) -> str:
    """The version that the constraints pin."""
    lines = constraints.read_text(encoding="utf-8").splitlines()
    return next(line.split("==")[1].strip() for line in lines if line.startswith("torch=="))


def fetch_cpu_build(pip: Sequence[str | Path], version: str, index: str) -> bool:
    """Install torch alone from the index; False, with nothing changed, where the download fails or stands still."""
    line = [*pip, "install", "--no-deps", "--no-compile", "--timeout", STALL_S, "--retries", 1, "--index-url", index]
    words = [str(word) for word in (*line, f"torch=={version}")]
    return subprocess.run(words, stdin=subprocess.DEVNULL, stdout=sys.stderr).returncode == 0
