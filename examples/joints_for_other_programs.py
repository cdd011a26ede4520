"""Results as a pandas frame and as an xarray dataset in the layout of the movement package."""

import sys
from pathlib import Path

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("walk", frames=150, seed=8, out=out / "session")
result = ms.solve(out / "session/markers.c3d", prior=out / "session/prior.npz", out=out / "solved")

angles = result.angles.to_pandas()
print(angles[["knee_angle_l", "knee_angle_r"]].describe().round(1))
joints = result.joints.to_xarray()
print(joints.sizes)
print(joints.position.sel(keypoints="left_wrist", space="z").mean().item(), "m, the mean height of the left wrist")
print(dict(zip(result.markers.names[:5], result.markers.bones[:5], strict=True)))
