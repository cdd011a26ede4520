"""The desktop application and the command line."""

import os

# Before any library starts its threads: OpenMP threads that spin while they wait make small operations 20 times slower.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
# Many small products run side by side in our own threads: a library that splits each of them again only waits.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Qt would hand parts of every filled shape to other threads and wait for them: with our sizes the waiting takes longer.
os.environ.setdefault("QT_NO_GUI_THREADPOOL", "1")
