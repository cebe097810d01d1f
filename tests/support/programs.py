"""The program in a process of its own, without a terminal."""

import os
import subprocess
import sys
from pathlib import Path


def run(folder: Path, *words: str, stdin: str = "", **env: str) -> subprocess.CompletedProcess[str]:
    """Runs dmplay in a folder with its own state."""
    clean = {key: value for key, value in os.environ.items() if not key.startswith("DMPLAY")}
    return subprocess.run(
        [sys.executable, "-m", "dmplay", *words],
        cwd=folder,
        env=clean | {"XDG_STATE_HOME": str(folder / "state")} | env,
        input=stdin,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
