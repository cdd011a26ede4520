"""Which markers move rigidly together: the affinity as a matrix and the clustering as a dendrogram."""

import sys
from pathlib import Path

import matplotlib

import markerscope as ms

matplotlib.use("Agg")
from matplotlib import pyplot as plt
from scipy.cluster.hierarchy import dendrogram

out = Path(sys.argv[1])
ms.simulate("walk", frames=150, seed=6, out=out / "session")
result = ms.solve(out / "session/markers.c3d", prior=out / "session/prior.npz", out=out / "solved")
found = result.stage("segment")

figure, (left, right) = plt.subplots(1, 2, figsize=(12, 5), layout="constrained")
image = left.imshow(1000 * found.affinity[found.order][:, found.order], vmax=30, cmap="viridis_r")
figure.colorbar(image, ax=left, label="standard deviation of the distance (mm)")
left.set(title="Affinity, in the order of the dendrogram", xlabel="marker", ylabel="marker")
tree = found.linkage.copy()
tree[:, 2] *= 1000
dendrogram(tree, ax=right, color_threshold=1000 * found.cut, no_labels=True)
right.axhline(1000 * found.cut, linestyle="--", color="grey")
right.set(title="Average linkage", ylabel="mm")
figure.savefig(out / "clustering.png")
print(f"{len(set(found.clusters))} clusters; {out / 'clustering.png'}")
