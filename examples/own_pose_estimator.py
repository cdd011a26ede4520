"""Poses of a program of your own, written as an npz file in AMASS layout, instead of those read off a video."""

import sys
from pathlib import Path

import numpy as np

import markerscope as ms

out = Path(sys.argv[1])
session = ms.simulate("walk", frames=150, seed=5, out=out / "session")

# What an estimator gives: SMPL pose vectors (T, 72) rad, root first in the camera's frame, and its frame rate.
with np.load(out / "session/prior.npz") as made:
    poses, rate = made["poses"], float(made["mocap_frame_rate"])
np.savez(out / "poses.npz", poses=poses, trans=np.zeros((len(poses), 3)), betas=np.zeros(10), mocap_frame_rate=rate)

result = ms.solve(out / "session/markers.c3d", prior=out / "poses.npz", out=out / "solved")
print(f"{result.angles}, confidence {result.confidence:.2f}")
