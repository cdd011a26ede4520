"""What scripts and notebooks use, as ``import markerscope as ms``: the public names, and nothing else."""
