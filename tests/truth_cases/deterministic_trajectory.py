"""Games of a deterministic problem, played from fixed starts."""

from collections.abc import Iterator

import numpy as np

from dmplay.core.policy import Percept, Policy
from dmplay.core.problem import Problem


def iterate_game(
    problem: Problem, policy: Policy, start: list[float], cap: int
) -> Iterator[tuple[np.ndarray, float]]:
    """Yield the state and reward after each turn, for at most `cap` turns."""
    for states, rewards in iterate_games(problem, policy, [start], cap):
        yield states[0], float(rewards[0])


def iterate_games(
    problem: Problem, policy: Policy, starts: list[list[float]], cap: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the states and rewards of several games until all are over; finished games pay 0."""
    s = np.array(starts, float)
    memory = policy.initial_memory(s)
    for _ in range(cap):
        if problem.terminal(s).all():
            return
        chosen = policy.choose(memory, None, np.zeros((len(s), policy.uniform_count)))
        after = problem.step(s, chosen[:, None], np.zeros((len(s), problem.uniform_counts.step)))
        s = after.state
        memory = policy.update_memory(
            memory, Percept(chosen, s, chosen[:, None], after.rewards[:, 0])
        )
        yield s, after.rewards[:, 0]
