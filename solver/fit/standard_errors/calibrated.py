"""What the standard errors are multiplied by, so that they cover what they should on sessions of known truth."""

from __future__ import annotations

FACTORS = {"markers": (1.0, 1.0), "one segment": (1.0, 1.0), "video only": (1.0, 1.0)}
"""Shape and level, by what an angle rests on."""
