"""Work that tells who does it."""

import os
import time
from pathlib import Path


def noted(folder: Path, games: range) -> None:
    """Leaves a file named for its process, and takes a moment."""
    (folder / str(os.getpid())).touch()
    time.sleep(0.05)
