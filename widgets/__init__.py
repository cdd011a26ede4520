"""Passive Qt views: each takes plain data and emits signals."""
