from functools import cache

import numpy as np

from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.tabular import tabulate
from dmplay.problems.catch.rules import DISTANCES, PROFICIENCIES, Catch
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp.bounded_search import BoundedSearch
from tests.truth_cases.case import Case, map_by_kind

PROBLEM = Catch()
OUTCOME_LABELS = PROBLEM.observations[0]
UNIFORM = [0.25] * 4


def throw_index(distance: float) -> int:
    return DISTANCES.tolist().index(distance)


def expected_reward(case: Case) -> None:
    s, a = PROFICIENCIES.index(case.inputs["s"]), throw_index(case.inputs["d"])
    case.close("catch_probability", PROBLEM.success_probabilities[s, a])
    case.close("reward", tabulate(PROBLEM).rewards[s, a, 0])
    p, outcome = enumerate_outcomes(PROBLEM, np.array([s]), np.array([[a]]))
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])
    case.close("catch_probability", p[0, OUTCOME_LABELS.index("caught")])


def compute_posterior(b: np.ndarray, distance: float, outcome: str) -> belief.Posterior:
    return belief.update_belief(
        PROBLEM, b, [throw_index(distance)], [OUTCOME_LABELS.index(outcome)]
    )


def belief_update(case: Case) -> None:
    inputs = case.inputs
    posterior = compute_posterior(np.array(inputs["b"], float), inputs["d"], inputs["outcome"])
    case.close("outcome_probability", posterior.likelihood)
    case.close("posterior", posterior.belief)


def belief_chain(case: Case) -> None:
    b, likelihood = np.array(case.inputs["b"], float), 1.0
    for distance, outcome in case.inputs["history"]:
        posterior = compute_posterior(b, distance, outcome)
        b = posterior.belief
        likelihood *= float(posterior.likelihood)
    case.close("posterior", b)
    case.close("likelihood", likelihood)


def known_proficiency(case: Case) -> None:
    s = PROFICIENCIES.index(case.inputs["s"])
    q = mdp_values.compute_optimal_q(tabulate(PROBLEM), PROBLEM.discount)[s]
    (best,) = np.flatnonzero(mark_best_actions(q))
    case.close("best_distance", DISTANCES[best])
    case.close("reward", tabulate(PROBLEM).rewards[s, best, 0])
    case.close("infinite_value", q.max())


@cache
def make_search(discount: float) -> BoundedSearch:
    return BoundedSearch(tabulate(PROBLEM), discount)


def find_best_throws(case: Case, b: list[float], horizon: int) -> tuple[Reals, list[float]]:
    """Return Q of each throw and the best distances."""
    q: Reals = make_search(case.inputs["gamma"]).compute_action_values(np.array([b]), horizon)[0]
    return q, [DISTANCES[a] for a in np.flatnonzero(mark_best_actions(q))]


def optimal_from_belief(case: Case) -> None:
    horizon = case.inputs["horizon"]
    q, best = find_best_throws(case, case.inputs.get("b", UNIFORM), horizon)
    case.close("value", q.max())
    case.close("q", q)
    assert best == case.expect["first_distance"]
    if "gap_to_second" in case.expect:
        case.close("gap_to_second", np.diff(np.sort(q))[-1])
    rewards = tabulate(PROBLEM).rewards[:, :, 0]
    discount_factors = case.inputs["gamma"] ** np.arange(horizon)
    if "proficiency_known" in case.expect:
        case.close("proficiency_known", rewards.max(axis=1).mean() * discount_factors.sum())
    if "same_throw_every_time" in case.expect:
        case.close("same_throw_every_time", rewards.mean(axis=0).max() * discount_factors.sum())


def opening(case: Case) -> None:
    distances: dict[str, float] = {}
    for key in case.expect["distance_after"]:
        b, outcomes = np.array(UNIFORM), [] if key == "start" else key.split(", ")
        for turn, outcome in enumerate(outcomes):
            b = compute_posterior(
                b, distances[", ".join(outcomes[:turn]) or "start"], outcome
            ).belief
        _, (distances[key],) = find_best_throws(
            case, b.tolist(), case.inputs["horizon"] - len(outcomes)
        )
    case.close("distance_after", distances)


KINDS = map_by_kind(
    expected_reward, belief_update, belief_chain, known_proficiency, optimal_from_belief, opening,
    optimal_from_uniform=optimal_from_belief,
)  # fmt: skip
LATER: set[str] = set()
