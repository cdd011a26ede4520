"""Markers that move rigidly together."""
