import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.core import Labels, Problem
from dmplay.errors import ImpossibleObservation
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate
from tests.truth_kinds.case import Case

STATES = ("sated", "hungry")
PROBLEM: Problem = dmplay.load("crying-baby")
ACTIONS = PROBLEM.actions[0]
assert isinstance(ACTIONS, Labels)
OBSERVATIONS = (PROBLEM.observations or ())[0]


def named(values: np.ndarray) -> dict[str, float]:
    return dict(zip(STATES, values, strict=True))


def model(case: Case) -> None:
    s, a = STATES.index(case.given["state"]), ACTIONS.index(case.given["action"])
    tables = tabulate(PROBLEM)
    case.close("next", named(tables.transition[s, a]))
    case.close("reward", tables.rewards[s, a, 0])


def observation(case: Case) -> None:
    tables = tabulate(PROBLEM)
    assert tables.observation is not None
    a, after = ACTIONS.index(case.given["action"]), STATES.index(case.given["next_state"])
    seen = dict(zip(OBSERVATIONS, tables.observation[a, after], strict=True))
    case.close("observation", seen)


def updated(b: float, action: str, seen: str) -> belief.Posterior:
    before = np.array([1 - b, b])
    return belief.update(PROBLEM, before, [ACTIONS.index(action)], [OBSERVATIONS.index(seen)])


def belief_update(case: Case) -> None:
    given = case.given
    if case.expect["observation_probability"] == 0:
        with pytest.raises(ImpossibleObservation):
            updated(given["b"], given["action"], given["observation"])
        return
    posterior = updated(given["b"], given["action"], given["observation"])
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief[1])


def belief_chain(case: Case) -> None:
    b, likelihood, posteriors = case.given["b"], 1.0, []
    for action, seen in case.given["history"]:
        posterior = updated(b, action, seen)
        b = posterior.belief[1]
        likelihood *= posterior.likelihood
        posteriors.append(b)
    case.close("posteriors", posteriors)
    case.close("likelihood", likelihood)


def always_one_action(case: Case) -> None:
    tables = tabulate(PROBLEM)
    always = np.tile(np.eye(3)[ACTIONS.index(case.given["action"])], (2, 1))
    case.close("values", named(value_iteration.evaluate(tables, PROBLEM.discount, always)))


KINDS = {
    "model": model,
    "observation": observation,
    "belief_update": belief_update,
    "belief_chain": belief_chain,
    "always_one_action": always_one_action,
}
LATER = {
    "finite_horizon",
    "finite_horizon_q",
    "singing",
    "infinite_horizon",
    "infinite_horizon_policy",
}
