"""The course of one game of a deterministic problem from a given start."""

from collections.abc import Iterator

import numpy as np

from dmplay.core import Percept, Policy, Problem


def course(
    problem: Problem, policy: Policy, start: list[float], cap: int
) -> Iterator[tuple[np.ndarray, float]]:
    """The state after each turn and what that turn paid, until it is terminal or `cap` is up."""
    s = np.array([start], float)
    memory = policy.begin(s)
    for _ in range(cap):
        if problem.terminal(s)[0]:
            return
        chosen = policy.choose(memory, None, np.zeros((1, policy.draws)))
        after = problem.step(s, chosen[:, None], np.zeros((1, problem.draws.step)))
        s = after.state
        memory = policy.update(memory, Percept(chosen, s, chosen[:, None], after.rewards[:, 0]))
        yield s[0], float(after.rewards[0, 0])
