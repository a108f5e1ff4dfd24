"""Before NumPy is loaded: one thread a process, since the tests run one process a core."""

import os

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")

# The name of its entry point too, so that it is loaded once where the package is installed.
pytest_plugins = ["drake_aerial.testing"]
