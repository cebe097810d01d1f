"""What a turn costs in the loops of other libraries, beside the rules and draws alone."""

from collections.abc import Callable
from statistics import median
from time import perf_counter

import numpy as np

import dmplay
from dmplay.dice import make_generator
from dmplay.gym import Env, VectorEnv
from dmplay.zoo import ParallelEnv

ROWS, TURNS = 256, 500
PROBLEMS = ("hexworld", "cart-pole", "predator-prey")

Turn = Callable[[], object]


def _bare(name: str, rows: int) -> Turn:
    """The rules and the draws alone."""
    problem = dmplay.load_problem(name)
    draw = make_generator(1).random
    s = problem.sample_initial_states(draw((rows, problem.uniform_counts.start)))
    a = np.zeros((rows, len(problem.agents)), np.int64)
    return lambda: problem.step(s, a, draw((rows, problem.uniform_counts.step)))


def _rows(name: str, dice: str) -> Turn:
    rows = VectorEnv(name, ROWS, uniforms=dice)
    rows.reset(seed=1)
    actions = rows.action_space.sample()
    return lambda: rows.step(actions)


def _one(name: str) -> Turn:
    env = Env(name)
    env.reset(seed=1)

    def turn() -> None:
        _, _, terminated, truncated, _ = env.step(0)
        if terminated or truncated:
            env.reset()

    return turn


def _together(name: str) -> Turn:
    env = ParallelEnv(name)
    env.reset(seed=1)

    def turn() -> None:
        env.step(dict.fromkeys(env.agents, 0))
        if not env.agents:
            env.reset()

    return turn


def report(runs: int) -> None:
    """Prints turns a second, in millions, and how many times as long as a bare step one takes."""
    print(f"loops of other libraries, medians of {runs} runs: million turns a second, times a step")
    for name in PROBLEMS:
        many = {
            "step": _bare(name, ROWS),
            "VectorEnv, fast dice": _rows(name, "fast"),
            "VectorEnv, recorded": _rows(name, "recorded"),
        }
        one = {"step": _bare(name, 1), "Env": _one(name), "ParallelEnv": _together(name)}
        for rows, ways in ((ROWS, many), (1, one)):
            found: dict[str, list[float]] = {way: [] for way in ways}
            for _ in range(runs):
                for way, turn in ways.items():
                    begun = perf_counter()
                    for _ in range(TURNS):
                        turn()
                    found[way].append(TURNS * rows / (perf_counter() - begun) / 1e6)
            bare = median(found["step"])
            for way, rates in found.items():
                rate = median(rates)
                told = f"{way}, {rows} row{'s' * (rows > 1)}"
                print(f"  {name:<15}{told:<32}{rate:8.4f} {bare / rate:7.1f}")
