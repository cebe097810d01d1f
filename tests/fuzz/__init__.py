"""What nobody means, said to dmplay."""

import os

# A case has the time of its own processor: threads that wait for each other would be counted too.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
