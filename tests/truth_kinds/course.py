"""The course of games of a deterministic problem from given starts."""

from collections.abc import Iterator

import numpy as np

from dmplay.core import Percept, Policy, Problem


def course(
    problem: Problem, policy: Policy, start: list[float], cap: int
) -> Iterator[tuple[np.ndarray, float]]:
    """The state after each turn and what that turn paid, until it is terminal or `cap` is up."""
    for states, paid in courses(problem, policy, [start], cap):
        yield states[0], float(paid[0])


def courses(
    problem: Problem, policy: Policy, starts: list[list[float]], cap: int
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The same of many games at once, until the last of them is over; what is over pays no more."""
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
