"""What workers are told to do in tests."""

from __future__ import annotations

import os
import time
from typing import Any

from markerscope.solver.bench.execute import Run


def figures(**changed: Any) -> dict[str, Any]:
    """The figures of a run that went well, but for what is said."""
    good = {
        "status": "done",
        "mpjpe_mm": 10.0,
        "part_mpjpe_mm": 10.0,
        "v2v_mm": 12.0,
        "right_part": True,
        "right_yaw": True,
        "right": True,
        "named": True,
        "right_bones": 1.0,
        "confidence": 0.995,
        "sync_error_s": -0.01,
        "warm_s": 1.0,
    }
    return good | changed


def answer(run: Run) -> dict[str, Any]:
    return run.about | figures(mpjpe_mm=10.0 + run.seed)


def die_at_one(run: Run) -> dict[str, Any]:
    if run.seed == 1:
        os._exit(1)
    return answer(run)


def sleep_after_one(run: Run) -> dict[str, Any]:
    if run.seed:
        time.sleep(60)
    return answer(run)
