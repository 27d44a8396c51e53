"""The tests. A worker has one core, so its linear algebra has one thread: more would wait for each other."""

import os
import sys

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):  # read when NumPy is loaded, and by children
    os.environ.setdefault(_threads, "1")

# where Python is told to keep no bytecode, every start of the program in a test would compile it anew
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
