"""A pull of markers to palpable bony landmarks, as strong as a layout has earned it."""
