"""Work that records the process that runs it."""

import os
import time
from pathlib import Path


def touch_process_file(folder: Path, games: range) -> None:
    """Create a file named after the id of this process, then sleep for 50 ms."""
    (folder / str(os.getpid())).touch()
    time.sleep(0.05)
