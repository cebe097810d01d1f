"""How many games a tree search simulates in a second, of each of the fifteen problems."""

from functools import partial
from statistics import median
from time import process_time

import numpy as np

import dmplay
from dmplay.core import Memory
from dmplay.finding.names import problem_names
from dmplay.policies.search import TreeSearch

EACH = (400, 1000)  # simulations of a choice
ROWS = (1, 100)  # games side by side


def report(runs: int) -> None:
    """Prints a line a problem: at a table, and where many games are played at once."""
    print(f"\n{'simulations a second':<28}", *(f"{n} in {rows:>3}" for n, rows in _kinds()))
    for name in problem_names():
        found = (f"{_speed(name, each, rows, runs):>11,.0f}" for each, rows in _kinds())
        print(f"{name:<28}", *found, flush=True)


def _kinds() -> list[tuple[int, int]]:
    return [(each, ROWS[0]) for each in EACH] + [(EACH[0], ROWS[1])]


def _speed(name: str, each: int, rows: int, runs: int) -> float:
    """Simulations a second of processor time in the first choice of some games."""
    problem = dmplay.load_problem(name)
    search = dmplay.load_agent(problem, 0, f"search:simulations={each}")
    assert isinstance(search, TreeSearch)
    luck = np.random.default_rng(1)
    s = problem.sample_initial_states(luck.random((rows, problem.uniform_counts.start)))
    legal, memory = (
        problem.legal_actions_mask(s),
        search.initial_memory(problem.initial_observation(s, 0)),
    )
    choose = partial(_seconds, search, memory, None if legal is None else legal[:, 0])
    choose(luck.random((rows, 1)))  # what is found once
    return each * rows / median(choose(luck.random((rows, 1))) for _ in range(runs))


def _seconds(search: TreeSearch, memory: Memory, legal: np.ndarray | None, u: np.ndarray) -> float:
    """The seconds that a choice takes."""
    since = process_time()
    search.choose(memory, legal, u)
    return process_time() - since
