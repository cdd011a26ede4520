"""Outliers cut and gaps filled; what was measured stays as it is."""

import sys
from pathlib import Path

import markerscope as ms

out = Path(sys.argv[1])
ms.simulate("walk", frames=200, seed=4, lost=0.05, out=out / "session")

cleaned = ms.clean(out / "session/markers.c3d")
print(f"{len(cleaned.outliers.frame)} samples cut, {len(cleaned.fills)} gaps filled")
for fill in cleaned.fills[:5]:
    marker = cleaned.markers.labels[fill.marker]
    print(f"{marker}: frames {fill.first} to {fill.last}, expected error {1000 * fill.error:.1f} mm")
for proposal in cleaned.proposals:
    print(proposal.sentence)
