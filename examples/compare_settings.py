"""What a setting changes: here the offset between the clocks of video and markers."""

import sys
from pathlib import Path

import numpy as np

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("walk", frames=150, seed=3, out=out / "session")
files = {"markers": out / "session/markers.c3d", "prior": out / "session/prior.npz"}

found = ms.solve(**files, out=out / "found").angles
given = ms.solve(**files, offset=0.05, out=out / "given").angles
apart = np.sqrt(np.nanmean((found.degrees - given.degrees) ** 2, axis=0))
for name, rms in sorted(zip(found.names, apart, strict=True), key=lambda pair: -pair[1])[:5]:
    print(f"{name:20} {rms:5.2f} degrees RMS")
