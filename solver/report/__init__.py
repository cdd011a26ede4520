"""What a solve leaves in its folder: motion, angles, markers, the report."""
