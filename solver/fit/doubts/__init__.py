"""What speaks against a solve: one rule a file, each with its own figure, limit and sentence."""
