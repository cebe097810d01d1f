from itertools import product
from typing import Any

import numpy as np
import pytest

from dmplay.core import belief
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import ImpossibleObservation
from dmplay.problems.multicaregiver_crying_baby.rules import MulticaregiverCryingBaby
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.mdp import mdp_values
from tests.truth_cases.case import Case, map_by_kind

PROBLEM = MulticaregiverCryingBaby()
TABLES = tabulate(PROBLEM)
STATE_NAMES = PROBLEM.state_names
ACTIONS = PROBLEM.actions[0]
OBSERVATIONS = PROBLEM.observations[0]
JOINT_ACTIONS = list(product(ACTIONS, repeat=2))


def joint_action_index(case: Case) -> int:
    return JOINT_ACTIONS.index(tuple(case.inputs["actions"]))


def name_values(values: np.ndarray) -> dict[str, float]:
    return dict(zip(STATE_NAMES, values, strict=True))


def transition(case: Case) -> None:
    s = STATE_NAMES.index(case.inputs["state"])
    case.close("next", name_values(TABLES.transition[s, joint_action_index(case)]))


def reward(case: Case) -> None:
    case.close(
        "rewards", TABLES.rewards[STATE_NAMES.index(case.inputs["state"]), joint_action_index(case)]
    )


def observation(case: Case) -> None:
    assert TABLES.observation is not None
    order = [list(pair) for pair in product(OBSERVATIONS, repeat=2)]
    assert order == case.conventions["joint_observations"]
    after = STATE_NAMES.index(case.inputs["next_state"])
    case.close("probabilities", TABLES.observation[joint_action_index(case), after])


def compute_posterior(case: Case) -> belief.Posterior:
    b = case.inputs["b"]
    actions = [ACTIONS.index(name) for name in case.inputs["actions"]]
    observations = [OBSERVATIONS.index(name) for name in case.inputs["observations"]]
    return belief.update_belief(PROBLEM, np.array([1 - b, b]), actions, observations)


def belief_update(case: Case) -> None:
    posterior = compute_posterior(case)
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief[1])


def impossible_observation(case: Case) -> None:
    with pytest.raises(ImpossibleObservation):
        compute_posterior(case)


def evaluate_plans(plans: list[Any], s: int) -> np.ndarray:
    """Return the discounted returns of two plans from a state.

    A plan is (action, plan after crying, plan after quiet).
    """
    a = np.array([[ACTIONS.index(plan[0]) for plan in plans]])
    p, (states, rewards, observations) = enumerate_outcomes(PROBLEM, np.array([s]), a)
    total = (p[0, :, None] * rewards[0]).sum(axis=0)
    if len(plans[0]) == 1:
        return np.asarray(total)
    for weight, next_state, joint_observation in zip(p[0], states[0], observations[0], strict=True):
        if weight > 0:
            subplans = [plan[1 + o] for plan, o in zip(plans, joint_observation, strict=True)]
            total = total + PROBLEM.discount * weight * evaluate_plans(subplans, next_state)
    return np.asarray(total)


def joint_plan(case: Case) -> None:
    sated, hungry = (evaluate_plans(case.inputs["plans"], s) for s in range(2))
    b = case.inputs["b"]
    case.close("value_at_sated", sated)
    case.close("value_at_hungry", hungry)
    case.close("value_at_b", (1 - b) * sated + b * hungry)


def make_single_agent_tables(rewards: np.ndarray) -> Tables:
    """Return the tables of a single agent with joint actions and rewards `[S, A]`."""
    return TABLES._replace(rewards=rewards[:, :, None])


def always_joint_action(case: Case) -> None:
    always = np.tile(np.eye(len(JOINT_ACTIONS))[joint_action_index(case)], (2, 1))
    values_by_caregiver = {}
    for seat in range(2):
        seat_tables = make_single_agent_tables(TABLES.rewards[:, :, seat])
        values = mdp_values.evaluate_policy(seat_tables, PROBLEM.discount, always)
        values_by_caregiver[str(seat + 1)] = name_values(values)
    case.close("values_by_caregiver", values_by_caregiver)


def team_fully_observed(case: Case) -> None:
    assert case.inputs["objective"].startswith("sum of both caregivers' rewards")
    team = make_single_agent_tables(TABLES.rewards[:, :, 0] + TABLES.rewards[:, :, 1])
    q = mdp_values.compute_optimal_q(team, PROBLEM.discount)
    case.close("values", name_values(q.max(axis=1)))
    best = [[list(JOINT_ACTIONS[a]) for a in np.flatnonzero(row)] for row in mark_best_actions(q)]
    assert dict(zip(STATE_NAMES, best, strict=True)) == case.expect["best"]


def one_step_nash(case: Case) -> None:
    b = case.inputs["b"]
    payoffs = ((1 - b) * TABLES.rewards[0] + b * TABLES.rewards[1]).reshape(3, 3, 2)
    equilibria = bimatrix_game.enumerate_equilibria(payoffs)
    pure = [[ACTIONS[int(np.flatnonzero(mix)[0])] for mix in profile] for profile in equilibria]
    assert all(max(mix) == 1 for profile in equilibria for mix in profile)
    assert pure == case.expect["equilibria"]
    case.close("rewards", bimatrix_game.compute_utilities(payoffs, equilibria[0]))


KINDS = map_by_kind(
    transition, reward, observation, belief_update, impossible_observation, joint_plan,
    always_joint_action, team_fully_observed, one_step_nash,
)  # fmt: skip
LATER: set[str] = set()
