"""Reading and writing files: one module a format."""

from markerscope.solver.io.markers_in import list_subjects, load_markers

__all__ = ["list_subjects", "load_markers"]
