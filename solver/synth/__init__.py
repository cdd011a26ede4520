"""Sessions of known truth: a body outside the shape basis, markers on its skin, and what a capture does to them."""

from markerscope.solver.synth.body import vary_body
from markerscope.solver.synth.capture import Corruption, corrupt
from markerscope.solver.synth.demo_motion import demo_motion
from markerscope.solver.synth.motion import Motion
from markerscope.solver.synth.placement import MARKERS_PER_BONE, Placement, marker_paths, place_markers
from markerscope.solver.synth.retarget import retarget

__all__ = [
    "MARKERS_PER_BONE",
    "Corruption",
    "Motion",
    "Placement",
    "corrupt",
    "demo_motion",
    "marker_paths",
    "place_markers",
    "retarget",
    "vary_body",
]
