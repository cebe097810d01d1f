"""What a turn costs in the loops of other libraries, beside the bare rules."""

from collections.abc import Callable
from statistics import median
from time import perf_counter

import numpy as np

import dmplay
from dmplay.dice import generator
from dmplay.gym import Env, VectorEnv

ROWS, TURNS = 256, 500


def _bare(name: str) -> Callable[[], object]:
    """The rules and the draws alone."""
    problem = dmplay.load(name)
    draw = generator(1).random
    s = problem.start(draw((ROWS, problem.draws.start)))
    a = np.zeros((ROWS, 1), np.int64)
    return lambda: problem.step(s, a, draw((ROWS, problem.draws.step)))


def _rows(name: str, dice: str) -> Callable[[], object]:
    rows = VectorEnv(name, ROWS, dice=dice)
    rows.reset(seed=1)
    actions = rows.action_space.sample()
    return lambda: rows.step(actions)


def _one(name: str) -> Callable[[], object]:
    env = Env(name)
    env.reset(seed=1)

    def turn() -> None:
        _, _, terminated, truncated, _ = env.step(0)
        if terminated or truncated:
            env.reset()

    return turn


def report(runs: int) -> None:
    """Prints turns a second, in millions."""
    print(f"loops of other libraries, medians of {runs} runs: million turns a second")
    for name in ("hexworld", "cart-pole"):
        ways = {
            f"rules, {ROWS} rows": (_bare(name), ROWS),
            f"VectorEnv fast, {ROWS} rows": (_rows(name, "fast"), ROWS),
            f"VectorEnv recorded, {ROWS} rows": (_rows(name, "recorded"), ROWS),
            "Env": (_one(name), 1),
        }
        found: dict[str, list[float]] = {way: [] for way in ways}
        for _ in range(runs):
            for way, (turn, many) in ways.items():
                begun = perf_counter()
                for _ in range(TURNS):
                    turn()
                found[way].append(TURNS * many / (perf_counter() - begun) / 1e6)
        for way, rates in found.items():
            print(f"  {name:<12}{way:<30}{median(rates):8.3f}")
