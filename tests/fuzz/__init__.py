"""A fuzzer of the command line."""

import os

# A case is limited in processor time, which would include threads that wait for one another.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
