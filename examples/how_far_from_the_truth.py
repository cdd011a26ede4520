"""A synthetic session, solved, and judged against the truth that made it (which no solver reads)."""

import sys
from pathlib import Path

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("reach", frames=150, seed=7, markers=30, out=out / "session")
result = ms.solve(out / "session/markers.c3d", prior=out / "session/prior.npz", out=out / "solved")
errors = ms.evaluate(result, out / "session/reference.npz")
print(f"joints {errors['mpjpe_mm']:.1f} mm, skin to markers {errors['m2s_mm']:.1f} mm")
