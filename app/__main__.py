"""``python -m markerscope.app`` is the same as ``markerscope``."""

from __future__ import annotations

import sys

from markerscope.app.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
