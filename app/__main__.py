"""``python -m markerscope.app`` is the same as ``markerscope``."""

from __future__ import annotations

import multiprocessing
import sys

from markerscope.app.cli.main import main

if __name__ == "__main__":
    multiprocessing.freeze_support()  # in a frozen application a worker process begins here, and must not open a window
    sys.exit(main())
