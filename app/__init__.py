"""The desktop application and the command line."""

import os

# Before any library starts its threads: OpenMP threads that spin while they wait make small operations 20 times slower.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
# Many small products run side by side in our own threads: a library that splits each of them again only waits.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
