"""A body that does not fall on the person in the picture."""

from __future__ import annotations

from markerscope.solver.fit.doubts.doubt import Doubt, Evidence

SHARE = 0.012
"""Of the image's longer side."""


def off_the_picture(seen: Evidence) -> Doubt | None:
    """Say that the fitted body is not where the video shows the person."""
    limit = SHARE * max(seen.image_size)
    if not seen.reprojection > limit > 0:
        return None
    return Doubt(
        "off the picture",
        f"The fitted body is {seen.reprojection:.0f} px from the person in the picture (median; up to {limit:.0f} px "
        "are usual): check that the video is of this movement and its offset, that it is not mirrored, and that the "
        "camera stood still.",
        value=seen.reprojection,
        limit=limit,
    )
