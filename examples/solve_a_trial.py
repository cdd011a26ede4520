"""Markers and poses to joint angles. With a video of your own: solve("trial.c3d", video="trial.mp4", out=...)."""

import sys
from pathlib import Path

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("walk", frames=150, seed=1, out=out / "session")


def progress(fraction: float, text: str) -> None:
    print(f"\r{100 * fraction:3.0f} %  {text:60}", end="", file=sys.stderr)


result = ms.solve(out / "session/markers.c3d", prior=out / "session/prior.npz", out=out / "solved", progress=progress)

print(f"\n{result.angles}")
print(f"confidence {result.confidence:.2f}; {len(result.warnings)} warnings")
for warning in result.warnings:
    print(f"- {warning}")
knee = result.angles["knee_angle_r"]
print(f"the right knee bends between {knee.min():.0f} and {knee.max():.0f} degrees")
