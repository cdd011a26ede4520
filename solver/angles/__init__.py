"""Joint angles of the fitted body, in the conventions of other programs."""
