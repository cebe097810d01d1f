"""Measure the time from a key to its frame through a pseudo-terminal, and in a bare application."""

import sys
from itertools import cycle, islice
from statistics import median, quantiles

from tests.benchmarks.terminal import DMPLAY, Program
from tests.support.terminals import DOWN, LEFT, READY_SEQUENCE, RIGHT

NO_MOTION_OPTION = "--no-motion"  # an animation would be timed only to its first step
LATE_GAME_TURNS = 400  # number of turns played before a late game is timed
COMMANDS_AND_KEYS = {
    "bare application": ((sys.executable, "-m", "tests.benchmarks.bare_application"), "x"),
    "hexworld": ((*DMPLAY, "hexworld", "--seed", "7", "--set", "rewards=[]"), "hlhl"),
    "2048": (
        (*DMPLAY, "2048", "--seed", "8", NO_MOTION_OPTION),
        (LEFT, DOWN, LEFT, DOWN, RIGHT, LEFT),
    ),
    "crying-baby": ((*DMPLAY, "crying-baby", "--seed", "7", "--turns", "9999"), "fsi"),
    "hexworld, late": ((*DMPLAY, "hexworld", "--seed", "7", "--set", "rewards=[]"), "hlhl"),
    "crying-baby, late": ((*DMPLAY, "crying-baby", "--seed", "7", "--turns", "9999"), "fsi"),
}


def report(presses: int) -> None:
    """Print the median and 95th percentile of the time, and the median number of bytes."""
    programs = {name: Program(command) for name, (command, _) in COMMANDS_AND_KEYS.items()}
    try:
        for name, program in programs.items():
            program.until(READY_SEQUENCE)
            program.settle()
            if name.endswith("late"):
                for key in islice(cycle(COMMANDS_AND_KEYS[name][1]), LATE_GAME_TURNS):
                    program.press(key.encode())
        samples_by_name: dict[str, list[tuple[float, int]]] = {
            name: [] for name in COMMANDS_AND_KEYS
        }
        key_cycles = {name: cycle(keys_) for name, (_, keys_) in COMMANDS_AND_KEYS.items()}
        for _ in range(presses):
            for name, program in programs.items():
                samples_by_name[name].append(program.press(next(key_cycles[name]).encode()))
    finally:
        for program in programs.values():
            program.close()
    print(
        f"key to frame, {presses} interleaved keys each: median ms, 95th percentile ms, bytes a key"
    )
    for name, samples in samples_by_name.items():
        times = [seconds * 1000 for seconds, _ in samples]
        percentile_95 = quantiles(times, n=20)[-1]
        bytes_ = median(count for _, count in samples)
        print(f"  {name:<18} {median(times):7.2f} {percentile_95:7.2f} {bytes_:7.0f}")
    print(f"  (late: after {LATE_GAME_TURNS} turns)")
