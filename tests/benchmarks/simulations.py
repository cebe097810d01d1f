"""Measure the simulations per second of the tree search, for each built-in problem."""

from functools import partial
from statistics import median
from time import process_time

import numpy as np

import dmplay
from dmplay.agents.search import TreeSearch
from dmplay.core.policy import Memory
from dmplay.core.problem import make_initial_observation
from dmplay.registry.builtin_names import problem_names

SIMULATION_COUNTS = (400, 1000)  # simulations per choice
ROW_COUNTS = (1, 100)  # number of games in a batch


def report(runs: int) -> None:
    """Print a line for each problem: rates in single games, and in a batch of games."""
    print(
        f"\n{'simulations a second':<28}",
        *(f"{count} in {rows:>3}" for count, rows in _list_settings()),
    )
    for name in problem_names():
        rates = (
            f"{_measure_simulation_rate(name, simulations, rows, runs):>11,.0f}"
            for simulations, rows in _list_settings()
        )
        print(f"{name:<28}", *rates, flush=True)


def _list_settings() -> list[tuple[int, int]]:
    return [(simulations, ROW_COUNTS[0]) for simulations in SIMULATION_COUNTS] + [
        (SIMULATION_COUNTS[0], ROW_COUNTS[1])
    ]


def _measure_simulation_rate(name: str, simulations: int, rows: int, runs: int) -> float:
    """Return the simulations per processor second in the first choice of a batch of games."""
    problem = dmplay.load_problem(name)
    search = dmplay.load_agent(problem, 0, f"search:simulations={simulations}")
    assert isinstance(search, TreeSearch)
    rng = np.random.default_rng(1)
    s = problem.sample_initial_states(rng.random((rows, problem.uniform_counts.start)))
    legal = problem.legal_actions_mask(s)
    memory = search.initial_memory(make_initial_observation(problem, s, 0))
    choose = partial(_time_choice, search, memory, None if legal is None else legal[:, 0])
    choose(rng.random((rows, 1)))  # warm up: some results are cached
    return simulations * rows / median(choose(rng.random((rows, 1))) for _ in range(runs))


def _time_choice(
    search: TreeSearch, memory: Memory, legal: np.ndarray | None, u: np.ndarray
) -> float:
    """Return the processor seconds of a choice."""
    start_time = process_time()
    search.choose(memory, legal, u)
    return process_time() - start_time
