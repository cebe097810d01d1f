"""Start-up, beside Python itself and the four packages."""

import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from statistics import median

from tests.benchmarks.terminal import DMPLAY, Program
from tests.terminals import READY, clean_environment

FOUR = "import typer, rich, numpy, prompt_toolkit"
GAME = ("hexworld", "--seed", "7")


def _ended(*command: str) -> float:
    began = time.perf_counter()
    env = clean_environment(Path.cwd())
    subprocess.run(command, env=env, stdout=subprocess.DEVNULL, check=True)
    return time.perf_counter() - began


def _shown(sign: bytes, *command: str) -> float:
    program = Program(command)
    try:
        return program.until(sign)
    finally:
        program.close()


def _ways() -> dict[str, Callable[[], float]]:
    python = sys.executable
    ways: dict[str, Callable[[], float]] = {
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
    """Prints each way's median, and its ratios to Python and to the four imports."""
    ways = _ways()
    times: dict[str, list[float]] = {name: [] for name in ways}
    order = list(ways)
    for run in range(runs + 1):
        for name in order:
            seconds = ways[name]()
            if run:  # the first run warms the disk's cache and compiles
                times[name].append(seconds)
        order.append(order.pop(0))  # what runs after what changes
    medians = {name: median(found) for name, found in times.items()}
    bare, four = medians["python -c pass"], medians["the four imports"]
    print(f"start-up, medians of {runs} interleaved runs: ms, x python -c pass, x four imports")
    for name, seconds in medians.items():
        print(f"  {name:<18} {seconds * 1000:7.1f} {seconds / bare:7.2f} {seconds / four:7.2f}")
