"""Long games: what a turn costs in each command, beside reading and writing its lines alone."""

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

FEW, MANY = 1_000, 20_000
GAME = ("hexworld", "--set", "rewards=[]", "--agent", "random", "--seed", "3")
FLOOR = """
import json, sys
with open(sys.argv[1]) as file, open(sys.argv[2], "w") as out:
    for line in file:
        key, _, value = line.partition(": ")
        out.write(f"{key}: {json.dumps(json.loads(value))}\\n" if value else line)
"""


class Spent(NamedTuple):
    """Seconds of the processor, and the most memory in MB."""

    seconds: float
    memory: float


def _ways(turns: int) -> dict[str, Sequence[str]]:
    """The commands, on a game of so many turns."""
    told, out = f"{turns}.dmt", ("-o", "out", "--force")
    ways: dict[str, Sequence[str]] = {
        "lines read and written": (sys.executable, "-c", FLOOR, told, "out"),
        "record": (*DMPLAY, *GAME, "--turns", str(turns), "--quiet", *out),
        "record and tell": (*DMPLAY, *GAME, "--turns", str(turns), "--plain", *out),
        "verify": (*DMPLAY, "verify", told),
        "replay": (*DMPLAY, "replay", told, "--plain"),
        "branch": (*DMPLAY, "branch", told, "--at", str(turns - 1), "--quiet", *out),
    }
    forms = [f"--{form}" for form in ("csv", "json", "text", "cast", "svg")]
    return ways | {f"export {form}": (*DMPLAY, "export", told, form, *out) for form in forms}


def spent(command: Sequence[str], place: Path) -> Spent:
    """What a command takes; raises RuntimeError where it fails."""
    env = clean_environment(place, PYTHONPATH=str(Path.cwd()))
    quiet = subprocess.DEVNULL
    process = subprocess.Popen(command, env=env, cwd=place, stdout=quiet, stderr=quiet)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"{command} ended with {process.returncode}")
    return Spent(usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def report(runs: int) -> None:
    """Prints what a turn costs, as a multiple of the floor too, and the most memory."""
    found: dict[tuple[str, int], list[Spent]] = {}
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for turns in (FEW, MANY):
            game = (*DMPLAY, *GAME, "--turns", str(turns), "--quiet", "-o", f"{turns}.dmt")
            spent(game, place)
        for _ in range(runs):
            for turns in (FEW, MANY):
                for name, command in _ways(turns).items():
                    found.setdefault((name, turns), []).append(spent(command, place))
    print(f"long games, medians of {runs} runs: us a turn, x the floor, MB for {MANY} turns")
    floor = None
    for name in _ways(MANY):
        few, many = (median(one.seconds for one in found[name, turns]) for turns in (FEW, MANY))
        cost = (many - few) / (MANY - FEW) * 1e6
        floor = floor or cost
        memory = max(one.memory for one in found[name, MANY])
        print(f"  {name:<24}{cost:8.1f} {cost / floor:7.1f} {memory:7.0f}")
