"""The stages by the types of what they leave: ``run[FIT]`` is a ``FittedMotion``, and mypy knows it."""

from __future__ import annotations

from markerscope.solver.cleaning.clean import Cleaned
from markerscope.solver.clustering.segment import Segmentation
from markerscope.solver.core.angle_errors import AngleErrors
from markerscope.solver.core.angle_table import JointAngles
from markerscope.solver.core.landmarks import Landmarks
from markerscope.solver.core.markers import Markers
from markerscope.solver.core.prior import PosePrior
from markerscope.solver.fit.doubts.rules import Verdict
from markerscope.solver.fit.known.neutral import Neutral
from markerscope.solver.fit.known.track import Tracked
from markerscope.solver.fit.published.results import PaperLocalization, PaperSolve
from markerscope.solver.fit.results import FittedMotion, Localization, Orientation
from markerscope.solver.fit.surface import SurfaceDistance
from markerscope.solver.neural.layout_free.agnostic_fit import NetworkPoses
from markerscope.solver.pipeline.stage import StageName
from markerscope.solver.sync.offset import Sync

MARKERS = StageName[Markers]("markers")
CLEAN = StageName[Cleaned]("clean")
LANDMARKS = StageName[Landmarks | None]("landmarks")
PRIOR = StageName[PosePrior]("prior")
SYNC = StageName[Sync]("sync")
SEGMENT = StageName[Segmentation]("segment")
LOCALIZE = StageName[Localization | PaperLocalization]("localize")
ORIENT = StageName[Orientation]("orient")
FIT = StageName[FittedMotion]("fit")
NEUTRAL = StageName[Neutral]("neutral")
ANGLES = StageName[JointAngles]("angles")
ERRORS = StageName[AngleErrors | None]("errors")
SURFACE = StageName[SurfaceDistance]("surface")
CHECK = StageName[Verdict]("check")
KNOWN = StageName[Tracked]("known")
"""Of a known person alone."""
NETWORK = StageName[NetworkPoses]("network")
"""Of the method with a network alone."""
SOLVE = StageName[PaperSolve]("solve")
"""Of the published method alone."""
