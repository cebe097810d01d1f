"""What it costs to solve a problem that somebody brings: seconds, and the most memory."""

import tempfile
from pathlib import Path
from statistics import median

from tests.benchmarks.long import spent
from tests.benchmarks.terminal import DMPLAY

SUPPORT = Path(__file__).parent.parent / "support"
FIELD, ROWS = (f"{SUPPORT / 'field.py'}:{name}" for name in ("Field", "InRows"))
SOLVED = {
    "field of 10^4 cells, 4 actions": (FIELD, "--set", "side=100"),
    "field of 10^5 cells": (FIELD, "--set", "side=316"),
    "field of 10^6 cells": (FIELD, "--set", "side=1000"),
    "field of 10^6 cells, as rows": (ROWS, "--set", "side=1000"),
    "tic-tac-toe": (f"{SUPPORT / 'toe.py'}:Toe",),
    "soccer, 4 x 5": (f"{SUPPORT / 'soccer.py'}:Soccer",),
    "bimatrix game, 50 x 50": (f"{SUPPORT / 'drawn.py'}:Large",),
}


def report(runs: int) -> None:
    """Prints the median of each."""
    print("\ndmplay solve: seconds of the processor, MB")
    with tempfile.TemporaryDirectory() as folder:
        for name, words in SOLVED.items():
            found = [spent((*DMPLAY, "solve", *words), Path(folder)) for _ in range(runs)]
            seconds, memory = (median(part) for part in zip(*found, strict=True))
            print(f"  {name:<32}{seconds:>8.1f}{memory:>8.0f}", flush=True)
