"""The exact return of a policy that acts on its belief, by the tree of its observations."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate

BELIEF_DECIMALS = 10  # beliefs that agree in these decimals have one value


def compute_exact_return(problem: Problem, policy: Policy, belief: Reals, turns: int) -> float:
    """Return the expected return of a policy whose memory is its belief `[S]`."""
    tables = tabulate(problem)
    values: dict[tuple[int, bytes], float] = {}

    def compute_value(belief: Reals, turns: int) -> float:
        if not turns:
            return 0.0
        key = turns, belief.round(BELIEF_DECIMALS).tobytes()
        if key not in values:
            a = int(policy.choose((belief[None],), None, np.zeros((1, 0)))[0])
            future = sum(
                p * compute_value(posterior, turns - 1)
                for p, posterior in list_posteriors(tables, belief, a)
            )
            values[key] = float(belief @ tables.rewards[:, a, 0] + problem.discount * future)
        return values[key]

    return compute_value(belief, turns)


def list_posteriors(tables: Tables, belief: Reals, a: int) -> list[tuple[float, Reals]]:
    """Return the probability of each possible observation, and the belief after it."""
    joint = (belief @ tables.transition[:, a])[:, None] * tables.observation_model[a]  # [S', O]
    columns = [column for column in joint.T if column.sum() > 0]
    return [(float(column.sum()), column / column.sum()) for column in columns]
