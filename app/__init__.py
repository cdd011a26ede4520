"""The desktop application and the command line."""

import os

# Before any library starts its threads: OpenMP threads that spin while they wait make small operations 20 times slower.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
