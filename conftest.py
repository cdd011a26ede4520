"""Tests run this tree, whatever the environment is connected to: its links are made, here and for child processes."""

from __future__ import annotations

import importlib
import os
from pathlib import Path

from tools.links import write_links

ROOT = Path(__file__).resolve().parent

_links = write_links(ROOT)
importlib.invalidate_caches()  # pytest may have looked for the folder before it was there
_paths = [str(_links), str(ROOT), os.environ.get("PYTHONPATH", "")]
os.environ["PYTHONPATH"] = os.pathsep.join(dict.fromkeys(filter(None, _paths)))
