"""The tests. A worker has one core, so its linear algebra has one thread: more would wait for each other."""

import os

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # read when NumPy is loaded, and by children
    os.environ.setdefault(_threads, "1")
