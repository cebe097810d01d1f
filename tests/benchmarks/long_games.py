"""Measure the cost per turn of each command on long games, and of only reading and writing the
lines.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import NamedTuple

from tests.benchmarks.terminal import DMPLAY
from tests.support.terminals import clean_environment

SHORT_TURNS, LONG_TURNS = 1_000, 20_000
GAME_ARGUMENTS = ("hexworld", "--set", "rewards=[]", "--agent", "random", "--seed", "3")
BASELINE_SCRIPT = """
import json, sys
with open(sys.argv[1]) as file, open(sys.argv[2], "w") as out:
    for line in file:
        key, _, value = line.partition(": ")
        out.write(f"{key}: {json.dumps(json.loads(value))}\\n" if value else line)
"""


class ResourceUsage(NamedTuple):
    """Processor time in seconds and peak memory in MB."""

    seconds: float
    memory: float


def _list_commands(turns: int) -> dict[str, Sequence[str]]:
    """Return the commands to measure on a game with this number of turns, by name."""
    transcript, output_options = f"{turns}.dmt", ("-o", "out", "--force")
    commands: dict[str, Sequence[str]] = {
        "lines read and written": (sys.executable, "-c", BASELINE_SCRIPT, transcript, "out"),
        "record": (*DMPLAY, *GAME_ARGUMENTS, "--turns", str(turns), "--quiet", *output_options),
        "record and tell": (
            *DMPLAY,
            *GAME_ARGUMENTS,
            "--turns",
            str(turns),
            "--plain",
            *output_options,
        ),
        "verify": (*DMPLAY, "verify", transcript),
        "replay": (*DMPLAY, "replay", transcript, "--plain"),
        "branch": (
            *DMPLAY,
            "branch",
            transcript,
            "--at",
            str(turns - 1),
            "--quiet",
            *output_options,
        ),
    }
    format_options = [
        f"--{format_option}" for format_option in ("csv", "json", "text", "cast", "svg")
    ]
    return commands | {
        f"export {format_option}": (*DMPLAY, "export", transcript, format_option, *output_options)
        for format_option in format_options
    }


def measure_command(command: Sequence[str], folder: Path) -> ResourceUsage:
    """Run a command and measure it; raise RuntimeError if it fails."""
    env = clean_environment(folder, PYTHONPATH=str(Path.cwd()))
    devnull = subprocess.DEVNULL
    process = subprocess.Popen(command, env=env, cwd=folder, stdout=devnull, stderr=devnull)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return ResourceUsage(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def report(runs: int) -> None:
    """Print the time per turn, its ratio to the baseline, and the peak memory."""
    usages: dict[tuple[str, int], list[ResourceUsage]] = {}
    with tempfile.TemporaryDirectory() as folder:
        folder_path = Path(folder)
        for turns in (SHORT_TURNS, LONG_TURNS):
            game = (
                *DMPLAY,
                *GAME_ARGUMENTS,
                "--turns",
                str(turns),
                "--quiet",
                "-o",
                f"{turns}.dmt",
            )
            measure_command(game, folder_path)
        for _ in range(runs):
            for turns in (SHORT_TURNS, LONG_TURNS):
                for name, command in _list_commands(turns).items():
                    usages.setdefault((name, turns), []).append(
                        measure_command(command, folder_path)
                    )
    print(f"long games, medians of {runs} runs: us a turn, x the floor, MB for {LONG_TURNS} turns")
    baseline = None
    for name in _list_commands(LONG_TURNS):
        short_seconds, long_seconds = (
            median(usage.seconds for usage in usages[name, turns])
            for turns in (SHORT_TURNS, LONG_TURNS)
        )
        cost = (long_seconds - short_seconds) / (LONG_TURNS - SHORT_TURNS) * 1e6
        baseline = baseline or cost
        memory = max(usage.memory for usage in usages[name, LONG_TURNS])
        print(f"  {name:<24}{cost:8.1f} {cost / baseline:7.1f} {memory:7.0f}")
