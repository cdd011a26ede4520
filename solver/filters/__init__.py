"""Smoothing of what was measured over time, only where it is asked for, and said in every export."""
