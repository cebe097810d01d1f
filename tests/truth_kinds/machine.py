import numpy as np
import pytest

from dmplay import belief
from dmplay.core import Problem
from dmplay.errors import ImpossibleObservation
from dmplay.problems.machine_replacement import MachineReplacement
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate
from tests.truth_kinds.case import Case

PROBLEM: Problem = MachineReplacement()
TABLES = tabulate(PROBLEM)
ACTIONS = MachineReplacement.actions[0]
OBSERVATIONS = MachineReplacement.observations[0]


def model(case: Case) -> None:
    s, a = case.given["state"], ACTIONS.index(case.given["action"])
    case.close("next", TABLES.transition[s, a])
    case.close("reward", TABLES.rewards[s, a, 0])


def observation(case: Case) -> None:
    a, after = ACTIONS.index(case.given["action"]), case.given["next_state"]
    assert TABLES.observation is not None
    case.close("probabilities", TABLES.observation[a, after])


def updated(case: Case) -> belief.Posterior:
    a, o = ACTIONS.index(case.given["action"]), OBSERVATIONS.index(case.given["observation"])
    return belief.update(PROBLEM, np.array(case.given["b"], float), [a], [o])


def belief_update(case: Case) -> None:
    posterior = updated(case)
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief)


def impossible_observation(case: Case) -> None:
    with pytest.raises(ImpossibleObservation):
        updated(case)


def always_one_action(case: Case) -> None:
    a, values = ACTIONS.index(case.given["action"]), np.zeros(3)
    for _ in range(case.given["horizon"]):
        values = value_iteration.action_values(TABLES, PROBLEM.discount, values)[:, a]
    case.close("values", values)


def fully_observed_value(case: Case) -> None:
    after = value_iteration.sweep(TABLES, PROBLEM.discount, case.given["horizon"] - 1)
    q = value_iteration.action_values(TABLES, PROBLEM.discount, after)
    case.close("values", q.max(axis=1))
    case.close("q", q)


KINDS = {
    "model": model,
    "observation": observation,
    "belief_update": belief_update,
    "impossible_observation": impossible_observation,
    "always_one_action": always_one_action,
    "fully_observed_value": fully_observed_value,
}
LATER = {
    "alpha_vectors",
    "alpha_count",
    "value_grid",
    "q_values",
    "regions",
    "disjoint_manufacture_14",
}
