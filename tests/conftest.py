"""Before NumPy is loaded: one thread a process, since the tests run one process a core."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
