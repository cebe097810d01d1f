"""Compare the returns of a policy with its action values."""

import numpy as np
import pytest

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.evaluation.many_games import rollout


def assert_policy_earns(problem: Problem, policy: Policy, value: float, turns: int) -> None:
    """Assert that a policy's value of the start is `value`, and that its mean return agrees."""
    values = policy.action_values(policy.initial_memory(np.array([-1])))
    assert values is not None
    assert values.max() == pytest.approx(value, abs=1e-6)
    returns = rollout(problem, [policy], episodes=1500, turn_limit=turns, seed=4).returns[:, 0]
    assert abs(returns.mean() - value) < 3 * returns.std() / np.sqrt(len(returns))
