"""Measure the start-up time, and that of Python itself and of the four dependencies."""

import subprocess
import sys
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tests.benchmarks.terminal import DMPLAY, Program, wait_for_exit
from tests.support.terminals import READY_SEQUENCE, clean_environment

DEPENDENCY_IMPORTS = "import typer, rich, numpy, prompt_toolkit"
GAME_ARGUMENTS = ("hexworld", "--seed", "7")


class StartupTime(NamedTuple):
    """Wall-clock time and processor time, in seconds."""

    clock: float
    processor: float


def _time_until_exit(*command: str) -> StartupTime:
    start_time = time.perf_counter()
    env = clean_environment(Path.cwd())
    process = subprocess.Popen(command, env=env, stdout=subprocess.DEVNULL)
    processor_seconds = wait_for_exit(process)
    if process.returncode:
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return StartupTime(time.perf_counter() - start_time, processor_seconds)


def _time_until_output(sign: bytes, *command: str) -> StartupTime:
    program = Program(command)
    wall_seconds = program.until(sign)
    return StartupTime(wall_seconds, program.close())


def _list_measurements() -> dict[str, Callable[[], StartupTime]]:
    python = sys.executable
    measurements: dict[str, Callable[[], StartupTime]] = {
        "python -c pass": lambda: _time_until_exit(python, "-c", "pass"),
        "the four imports": lambda: _time_until_exit(python, "-c", DEPENDENCY_IMPORTS),
        "--version": lambda: _time_until_exit(*DMPLAY, "--version"),
        "--help": lambda: _time_until_exit(*DMPLAY, "--help"),
        "first frame": lambda: _time_until_output(b"q quit", *DMPLAY, *GAME_ARGUMENTS),
        "keys accepted": lambda: _time_until_output(READY_SEQUENCE, *DMPLAY, *GAME_ARGUMENTS),
    }
    if find_spec("IPython"):
        measurements["IPython's prompt"] = lambda: _time_until_output(
            READY_SEQUENCE, python, "-m", "IPython", "--no-banner"
        )
    return measurements


def report(runs: int) -> None:
    """Print the medians of each measurement, and their ratios to Python and to the four imports."""
    measurements = _list_measurements()
    times: dict[str, list[StartupTime]] = {name: [] for name in measurements}
    order = list(measurements)
    for run in range(runs + 1):
        for name in order:
            sample = measurements[name]()
            if run:  # the first run warms the disk's cache and compiles
                times[name].append(sample)
        order.append(order.pop(0))  # vary which measurement precedes which
    print(f"start-up, medians of {runs} interleaved runs: ms, x python -c pass, x four imports")
    print(f"  {'':<18} {'by the clock':>23}   {'of the processor':>23}")
    for name in times:
        row = f"  {name:<18}"
        for kind in (0, 1):
            value, python_value, imports_value = (
                median(entry[kind] for entry in times[measurement])
                for measurement in (name, "python -c pass", "the four imports")
            )
            row += (
                f" {value * 1000:7.1f} {value / python_value:7.2f} {value / imports_value:7.2f}  "
            )
        print(row)
