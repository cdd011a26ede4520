"""Outliers and gaps in marker trajectories."""
