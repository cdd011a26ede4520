"""Monocular reconstructions of other programs as pose priors."""

from markerscope.solver.io.priors.load import load_prior

__all__ = ["load_prior"]
