"""Curves cut into cycles: their mean and spread, ranges and peaks, steps in space and time, scores against controls."""
