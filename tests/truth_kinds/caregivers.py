from itertools import product
from typing import Any

import numpy as np
import pytest

from dmplay import belief
from dmplay.core import enumerate_outcomes
from dmplay.errors import ImpossibleObservation
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.solvers import matrix_game, value_iteration
from dmplay.tabular import Tables, tabulate
from tests.truth_kinds.case import Case, by_kind

PROBLEM = MulticaregiverCryingBaby()
TABLES = tabulate(PROBLEM)
STATES = PROBLEM.state_names
ACTIONS = PROBLEM.actions[0]
OBSERVATIONS = PROBLEM.observations[0]
JOINT = list(product(ACTIONS, repeat=2))


def joint(case: Case) -> int:
    return JOINT.index(tuple(case.given["actions"]))


def named(values: np.ndarray) -> dict[str, float]:
    return dict(zip(STATES, values, strict=True))


def transition(case: Case) -> None:
    s = STATES.index(case.given["state"])
    case.close("next", named(TABLES.transition[s, joint(case)]))


def reward(case: Case) -> None:
    case.close("rewards", TABLES.rewards[STATES.index(case.given["state"]), joint(case)])


def observation(case: Case) -> None:
    assert TABLES.observation is not None
    order = [list(pair) for pair in product(OBSERVATIONS, repeat=2)]
    assert order == case.conventions["joint_observations"]
    after = STATES.index(case.given["next_state"])
    case.close("probabilities", TABLES.observation[joint(case), after])


def updated(case: Case) -> belief.Posterior:
    b = case.given["b"]
    did = [ACTIONS.index(name) for name in case.given["actions"]]
    saw = [OBSERVATIONS.index(name) for name in case.given["observations"]]
    return belief.update_belief(PROBLEM, np.array([1 - b, b]), did, saw)


def belief_update(case: Case) -> None:
    posterior = updated(case)
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief[1])


def impossible_observation(case: Case) -> None:
    with pytest.raises(ImpossibleObservation):
        updated(case)


def value(plans: list[Any], s: int) -> np.ndarray:
    """The discounted returns of two plans from a state: (action, after crying, after quiet)."""
    a = np.array([[ACTIONS.index(plan[0]) for plan in plans]])
    p, (states, rewards, seen) = enumerate_outcomes(PROBLEM, np.array([s]), a)
    total = (p[0, :, None] * rewards[0]).sum(axis=0)
    if len(plans[0]) == 1:
        return np.asarray(total)
    for weight, after, each in zip(p[0], states[0], seen[0], strict=True):
        if weight > 0:
            rest = [plan[1 + o] for plan, o in zip(plans, each, strict=True)]
            total = total + PROBLEM.discount * weight * value(rest, after)
    return np.asarray(total)


def joint_plan(case: Case) -> None:
    sated, hungry = (value(case.given["plans"], s) for s in range(2))
    b = case.given["b"]
    case.close("value_at_sated", sated)
    case.close("value_at_hungry", hungry)
    case.close("value_at_b", (1 - b) * sated + b * hungry)


def for_one(rewards: np.ndarray) -> Tables:
    """The tables of one agent who chooses both actions and is paid `[S, A]`."""
    return TABLES._replace(rewards=rewards[:, :, None])


def always_joint_action(case: Case) -> None:
    always = np.tile(np.eye(len(JOINT))[joint(case)], (2, 1))
    found = {}
    for seat in range(2):
        alone = for_one(TABLES.rewards[:, :, seat])
        values = value_iteration.evaluate_policy(alone, PROBLEM.discount, always)
        found[str(seat + 1)] = named(values)
    case.close("values_by_caregiver", found)


def team_fully_observed(case: Case) -> None:
    assert case.given["objective"].startswith("sum of both caregivers' rewards")
    team = for_one(TABLES.rewards[:, :, 0] + TABLES.rewards[:, :, 1])
    q = value_iteration.compute_optimal_q(team, PROBLEM.discount)
    case.close("values", named(q.max(axis=1)))
    best = [
        [list(JOINT[a]) for a in np.flatnonzero(row)]
        for row in value_iteration.mark_best_actions(q)
    ]
    assert dict(zip(STATES, best, strict=True)) == case.expect["best"]


def one_step_nash(case: Case) -> None:
    b = case.given["b"]
    payoffs = ((1 - b) * TABLES.rewards[0] + b * TABLES.rewards[1]).reshape(3, 3, 2)
    found = matrix_game.enumerate_equilibria(payoffs)
    pure = [[ACTIONS[int(np.flatnonzero(mix)[0])] for mix in one] for one in found]
    assert all(max(mix) == 1 for one in found for mix in one)
    assert pure == case.expect["equilibria"]
    case.close("rewards", matrix_game.compute_utilities(payoffs, found[0]))


KINDS = by_kind(
    transition, reward, observation, belief_update, impossible_observation, joint_plan,
    always_joint_action, team_fully_observed, one_step_nash,
)  # fmt: skip
LATER: set[str] = set()
