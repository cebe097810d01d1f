"""From a key to its frame, through a pseudo-terminal, beside a bare application."""

import sys
from itertools import cycle, islice
from statistics import median, quantiles

from tests.benchmarks.terminal import DMPLAY, Program
from tests.support.terminals import DOWN, LEFT, READY, RIGHT

STILL = "--no-motion"  # else a key would be timed to the first step of its slide
LATE = 400  # turns played before the late games are timed
GAMES = {
    "bare application": ((sys.executable, "-m", "tests.benchmarks.bare"), "x"),
    "hexworld": ((*DMPLAY, "hexworld", "--seed", "7", "--set", "rewards=[]"), "hlhl"),
    "2048": ((*DMPLAY, "2048", "--seed", "8", STILL), (LEFT, DOWN, LEFT, DOWN, RIGHT, LEFT)),
    "crying-baby": ((*DMPLAY, "crying-baby", "--seed", "7", "--turns", "9999"), "fsi"),
    "hexworld, late": ((*DMPLAY, "hexworld", "--seed", "7", "--set", "rewards=[]"), "hlhl"),
    "crying-baby, late": ((*DMPLAY, "crying-baby", "--seed", "7", "--turns", "9999"), "fsi"),
}


def report(keys: int) -> None:
    """Prints median and 95th percentile of the time, and the median of the bytes."""
    programs = {name: Program(command) for name, (command, _) in GAMES.items()}
    try:
        for name, program in programs.items():
            program.until(READY)
            program.settle()
            if name.endswith("late"):
                for key in islice(cycle(GAMES[name][1]), LATE):
                    program.press(key.encode())
        found: dict[str, list[tuple[float, int]]] = {name: [] for name in GAMES}
        turns = {name: cycle(keys_) for name, (_, keys_) in GAMES.items()}
        for _ in range(keys):
            for name, program in programs.items():
                found[name].append(program.press(next(turns[name]).encode()))
    finally:
        for program in programs.values():
            program.close()
    print(f"key to frame, {keys} interleaved keys each: median ms, 95th percentile ms, bytes a key")
    for name, samples in found.items():
        times = [seconds * 1000 for seconds, _ in samples]
        late = quantiles(times, n=20)[-1]
        bytes_ = median(count for _, count in samples)
        print(f"  {name:<18} {median(times):7.2f} {late:7.2f} {bytes_:7.0f}")
    print(f"  (late: after {LATE} turns)")
