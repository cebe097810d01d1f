import numpy as np

from dmplay import belief
from dmplay.core import exact
from dmplay.problems.catch import DISTANCES, PROFICIENCIES, Catch
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate
from tests.truth_kinds.case import Case

PROBLEM = Catch()
OUTCOMES = PROBLEM.observations[0]


def throw(distance: float) -> int:
    return DISTANCES.tolist().index(distance)


def expected_reward(case: Case) -> None:
    s, a = PROFICIENCIES.index(case.given["s"]), throw(case.given["d"])
    case.close("catch_probability", PROBLEM.catches[s, a])
    case.close("reward", tabulate(PROBLEM).rewards[s, a, 0])
    p, outcome = exact(PROBLEM, np.array([s]), np.array([[a]]))
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])
    case.close("catch_probability", p[0, OUTCOMES.index("caught")])


def updated(b: np.ndarray, distance: float, outcome: str) -> belief.Posterior:
    return belief.update(PROBLEM, b, [throw(distance)], [OUTCOMES.index(outcome)])


def belief_update(case: Case) -> None:
    given = case.given
    posterior = updated(np.array(given["b"], float), given["d"], given["outcome"])
    case.close("outcome_probability", posterior.likelihood)
    case.close("posterior", posterior.belief)


def belief_chain(case: Case) -> None:
    b, likelihood = np.array(case.given["b"], float), 1.0
    for distance, outcome in case.given["history"]:
        posterior = updated(b, distance, outcome)
        b = posterior.belief
        likelihood *= posterior.likelihood
    case.close("posterior", b)
    case.close("likelihood", likelihood)


def known_proficiency(case: Case) -> None:
    s = PROFICIENCIES.index(case.given["s"])
    q = value_iteration.optimal(tabulate(PROBLEM), PROBLEM.discount)[s]
    (best,) = np.flatnonzero(value_iteration.best(q))
    case.close("best_distance", DISTANCES[best])
    case.close("reward", tabulate(PROBLEM).rewards[s, best, 0])
    case.close("infinite_value", q.max())


KINDS = {
    "expected_reward": expected_reward,
    "belief_update": belief_update,
    "belief_chain": belief_chain,
    "known_proficiency": known_proficiency,
}
LATER = {"optimal_from_uniform", "optimal_from_belief", "opening"}
