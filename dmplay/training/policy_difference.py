"""The learned policy beside the optimal one: where it differs, and what that costs."""

from typing import NamedTuple

import numpy as np

from dmplay.agents.learned_policy import LearnedPolicy
from dmplay.algorithms.exploration import choose_greedy
from dmplay.algorithms.features import rate_actions
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.training.checkpoints import Evaluator


class DifferentState(NamedTuple):
    """A state in which the learned action is worse than the optimal one."""

    state: str
    learned: str
    optimal: str
    loss: float  # Q* of the optimal action minus Q* of the learned one


class PolicyDifference(NamedTuple):
    """The states in which a policy is wrong, by loss, and what all of them cost from the start."""

    rows: list[DifferentState]
    state_count: int  # states in which there is something to choose
    cost: float


def compare_with_optimum(evaluator: Evaluator, policy: LearnedPolicy) -> PolicyDifference | None:
    """Return the difference of a policy from the optimum; None if the optimum is not exact."""
    mdp, values, best = evaluator.mdp, evaluator.optimal_values, evaluator.optimal_actions
    if mdp is None or values is None or best is None:
        return None
    problem, rows = evaluator.problem, np.arange(len(values))
    q = mdp.compute_action_values(values)
    weights = rate_actions(policy.weights, policy.features.activate(mdp.states))
    actions = choose_greedy(weights, np.isfinite(mdp.rewards))
    losses: Reals = np.where(mdp.terminal, 0.0, q.max(axis=1) - q[rows, actions])
    wrong = np.flatnonzero(losses > VALUE_TOLERANCE * problem.reward_scale)
    wrong = wrong[np.argsort(-losses[wrong], kind="stable")]
    different = [
        DifferentState(
            problem.format_state(mdp.states[s]),
            problem.format_action(0, int(actions[s])),
            problem.format_action(0, int(best[s])),
            float(losses[s]),
        )
        for s in wrong
    ]
    cost = evaluator.optimum[0] - evaluator.evaluate(policy) if len(wrong) else 0.0
    return PolicyDifference(different, int(np.count_nonzero(~mdp.terminal)), cost)
