"""Stages as data, the store of their results, and the session folder."""
