"""The 24-joint body that everything is fitted to."""
