"""Start-up, beside Python itself and the four packages."""

import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tests.benchmarks.terminal import DMPLAY, Program, processor
from tests.support.terminals import READY, clean_environment

FOUR = "import typer, rich, numpy, prompt_toolkit"
GAME = ("hexworld", "--seed", "7")


class Spent(NamedTuple):
    """Seconds by the clock and of the processor."""

    clock: float
    processor: float


def _ended(*command: str) -> Spent:
    began = time.perf_counter()
    env = clean_environment(Path.cwd())
    process = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL)
    used = processor(process)
    if process.returncode:
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return Spent(time.perf_counter() - began, used)


def _shown(sign: bytes, *command: str) -> Spent:
    program = Program(command)
    clock = program.until(sign)
    return Spent(clock, program.close())


def _ways() -> dict[str, Callable[[], Spent]]:
    python = sys.executable
    ways: dict[str, Callable[[], Spent]] = {
        "python -c pass": lambda: _ended(python, "-c", "pass"),
        "the four imports": lambda: _ended(python, "-c", FOUR),
        "--version": lambda: _ended(*DMPLAY, "--version"),
        "--help": lambda: _ended(*DMPLAY, "--help"),
        "first frame": lambda: _shown(b"q quit", *DMPLAY, *GAME),
        "keys accepted": lambda: _shown(READY, *DMPLAY, *GAME),
    }
    if find_spec("IPython"):
        ways["IPython's prompt"] = lambda: _shown(READY, python, "-m", "IPython", "--no-banner")
    return ways


def report(runs: int) -> None:
    """Prints each way's medians, and their ratios to Python and to the four imports."""
    ways = _ways()
    times: dict[str, list[Spent]] = {name: [] for name in ways}
    order = list(ways)
    for run in range(runs + 1):
        for name in order:
            spent = ways[name]()
            if run:  # the first run warms the disk's cache and compiles
                times[name].append(spent)
        order.append(order.pop(0))  # what runs after what changes
    print(f"start-up, medians of {runs} interleaved runs: ms, x python -c pass, x four imports")
    print(f"  {'':<18} {'by the clock':>23}   {'of the processor':>23}")
    for name in times:
        row = f"  {name:<18}"
        for kind in (0, 1):
            middle, bare, four = (
                median(one[kind] for one in times[which])
                for which in (name, "python -c pass", "the four imports")
            )
            row += f" {middle * 1000:7.1f} {middle / bare:7.2f} {middle / four:7.2f}  "
        print(row)
