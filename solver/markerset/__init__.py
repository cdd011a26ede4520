"""Marker sets: names with their places on the body, learnt, shipped, and given to trajectories without names."""
