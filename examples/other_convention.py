"""The same trial in another convention, and counted from a pose within it: only the last stages are computed again."""

import sys
from pathlib import Path

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("squat", frames=150, seed=2, out=out / "session")
files = {"markers": out / "session/markers.c3d", "prior": out / "session/prior.npz", "out": out / "solved"}

usual = ms.solve(**files)
isb = ms.solve(**files, convention="isb")
try:
    relative = ms.solve(**files, neutral=(0.0, 0.2))
    print(f"{relative.angles.zero}: {relative.angles.zero_pose}")
except ms.InputError as error:  # the person moves in that span
    print(f"no neutral pose: {error}")
print(f"{usual.angles.title}: {', '.join(usual.angles.names[:4])}, ...")
print(f"{isb.angles.title}: {', '.join(isb.angles.names[:4])}, ...")
