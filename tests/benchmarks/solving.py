"""Measure the processor time and peak memory of solving user-defined problems."""

import tempfile
from pathlib import Path
from statistics import median

from tests.benchmarks.long_games import measure_command
from tests.benchmarks.terminal import DMPLAY

SUPPORT_FOLDER = Path(__file__).parent.parent / "support"
FIELD_PROBLEM, ROW_FIELD_PROBLEM = (
    f"{SUPPORT_FOLDER / 'grid_field.py'}:{name}" for name in ("Field", "InRows")
)
PROBLEM_ARGUMENTS = {
    "field of 10^4 cells, 4 actions": (FIELD_PROBLEM, "--set", "side=100"),
    "field of 10^5 cells": (FIELD_PROBLEM, "--set", "side=316"),
    "field of 10^6 cells": (FIELD_PROBLEM, "--set", "side=1000"),
    "field of 10^6 cells, as rows": (ROW_FIELD_PROBLEM, "--set", "side=1000"),
    "tic-tac-toe": (f"{SUPPORT_FOLDER / 'tic_tac_toe.py'}:Toe",),
    "soccer, 4 x 5": (f"{SUPPORT_FOLDER / 'soccer.py'}:Soccer",),
    "bimatrix game, 50 x 50": (f"{SUPPORT_FOLDER / 'random_problems.py'}:Large",),
}


def report(runs: int) -> None:
    """Print the median time and memory of each problem."""
    print("\ndmplay solve: seconds of the processor, MB")
    with tempfile.TemporaryDirectory() as folder:
        for name, arguments in PROBLEM_ARGUMENTS.items():
            usages = [
                measure_command((*DMPLAY, "solve", *arguments), Path(folder)) for _ in range(runs)
            ]
            seconds, memory = (median(values) for values in zip(*usages, strict=True))
            print(f"  {name:<32}{seconds:>8.1f}{memory:>8.0f}", flush=True)
