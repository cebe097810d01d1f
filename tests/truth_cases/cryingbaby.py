from functools import cache

import numpy as np
import pytest

import dmplay
from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem
from dmplay.core.tabular import Tables, tabulate
from dmplay.errors import ImpossibleObservation
from dmplay.problems.crying_baby.rules import CryingBaby
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from dmplay.solvers.pomdp.upper_envelope import compute_upper_envelope
from tests.truth_cases.case import Case, map_by_kind

STATE_NAMES = ("sated", "hungry")
PROBLEM: Problem = dmplay.load_problem("crying-baby")
ACTIONS = CryingBaby.actions[0]
OBSERVATIONS = CryingBaby.observations[0]


def name_values(values: np.ndarray) -> dict[str, float]:
    return dict(zip(STATE_NAMES, values, strict=True))


def model(case: Case) -> None:
    s, a = STATE_NAMES.index(case.inputs["state"]), ACTIONS.index(case.inputs["action"])
    case.close("next", name_values(load_tables().transition[s, a]))
    case.close("reward", load_tables().rewards[s, a, 0])


def observation(case: Case) -> None:
    observation_model = load_tables().observation
    assert observation_model is not None
    a, after = ACTIONS.index(case.inputs["action"]), STATE_NAMES.index(case.inputs["next_state"])
    distribution = dict(zip(OBSERVATIONS, observation_model[a, after], strict=True))
    case.close("observation", distribution)


def compute_posterior(b: float, action: str, observation: str) -> belief.Posterior:
    prior = np.array([1 - b, b])
    return belief.update_belief(
        PROBLEM, prior, [ACTIONS.index(action)], [OBSERVATIONS.index(observation)]
    )


def belief_update(case: Case) -> None:
    inputs = case.inputs
    if case.expect["observation_probability"] == 0:
        with pytest.raises(ImpossibleObservation):
            compute_posterior(inputs["b"], inputs["action"], inputs["observation"])
        return
    posterior = compute_posterior(inputs["b"], inputs["action"], inputs["observation"])
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief[1])


def belief_chain(case: Case) -> None:
    b, likelihood, posteriors = case.inputs["b"], 1.0, []
    for action, observation in case.inputs["history"]:
        posterior = compute_posterior(b, action, observation)
        b = posterior.belief[1]
        likelihood *= float(posterior.likelihood)
        posteriors.append(b)
    case.close("posteriors", posteriors)
    case.close("likelihood", likelihood)


def always_one_action(case: Case) -> None:
    always = np.tile(np.eye(3)[ACTIONS.index(case.inputs["action"])], (2, 1))
    case.close(
        "values", name_values(mdp_values.evaluate_policy(load_tables(), PROBLEM.discount, always))
    )


@cache
def load_tables(discount: float = 0.9) -> Tables:
    return tabulate(dmplay.load_problem("crying-baby", discount=discount))


@cache
def compute_stage(horizon: int, discount: float = 0.9) -> AlphaVectorStage:
    after = compute_stage(horizon - 1, discount).alpha_vectors if horizon > 1 else np.zeros((1, 2))
    return exact_pomdp.backup_vectors(load_tables(discount), discount, after)


@cache
def compute_infinite_stage() -> AlphaVectorStage:
    return exact_pomdp.solve_infinite_horizon(load_tables(), PROBLEM.discount)


def make_beliefs(hungry: list[float]) -> np.ndarray:
    return np.column_stack([1 - np.array(hungry), hungry])


def hungry_interval(corners: np.ndarray) -> list[float]:
    return [corners[:, 1].min(), corners[:, 1].max()]


def find_best_intervals(stage_solution: AlphaVectorStage) -> dict[str, list[list[float]]]:
    """Return the maximal intervals of P(hungry) in which each action is best."""
    cells = compute_upper_envelope(stage_solution.alpha_vectors)
    intervals: dict[str, list[list[float]]] = {}
    for a, name in enumerate(ACTIONS):
        vector_indices = np.flatnonzero(stage_solution.first_action_mask[:, a])
        merged: list[list[float]] = []
        for low, high in sorted(
            hungry_interval(cells.corner_beliefs[cells.touching_vectors[:, k]])
            for k in vector_indices
        ):
            if merged and low <= merged[-1][1] + 1e-9:
                merged[-1][1] = high
            else:
                merged.append([low, high])
        intervals[name] = merged
    return intervals


def find_least_regret(stage_solution: AlphaVectorStage, action: str) -> tuple[float, float]:
    """Return the least V(b) - Q(b, action), and the smallest P(hungry) that attains it.

    The difference is linear between the corners of V and of Q.
    """
    plans = stage_solution.plans_by_action[ACTIONS.index(action)]
    corners = [
        compute_upper_envelope(vectors).corner_beliefs
        for vectors in (stage_solution.alpha_vectors, plans.alpha_vectors)
    ]
    b = make_beliefs(sorted(np.vstack(corners)[:, 1]))
    regret = exact_pomdp.compute_belief_values(
        stage_solution.alpha_vectors, b
    ) - exact_pomdp.compute_belief_values(plans.alpha_vectors, b)
    first = np.flatnonzero(regret <= regret.min() + 1e-10)[0]
    return regret[first], b[first, 1]


def check_vectors(case: Case, stage_solution: AlphaVectorStage) -> None:
    """Check the vectors in any order, each with its actions and interval."""
    cells = compute_upper_envelope(stage_solution.alpha_vectors)
    assert len(case.expect["vectors"]) == len(stage_solution.alpha_vectors)
    for expected in case.expect["vectors"]:
        k = int(np.argmin(abs(stage_solution.alpha_vectors - expected["alpha"]).max(axis=1)))
        case.equal(expected["alpha"], stage_solution.alpha_vectors[k])
        assert expected["actions"] == [
            ACTIONS[a] for a in np.flatnonzero(stage_solution.first_action_mask[k])
        ]
        if "interval" in expected:
            case.equal(
                expected["interval"],
                hungry_interval(cells.corner_beliefs[cells.touching_vectors[:, k]]),
            )


def finite_horizon(case: Case) -> None:
    solution = compute_stage(case.inputs["horizon"])
    assert len(solution.alpha_vectors) == case.expect["count"]
    check_vectors(case, solution)
    hungry = [float(b) for b in case.expect["values"]]
    values = exact_pomdp.compute_belief_values(solution.alpha_vectors, make_beliefs(hungry))
    case.close("values", dict(zip(case.expect["values"], values, strict=True)))
    case.close("optimal", find_best_intervals(solution))


def check_action_values(case: Case, stage_solution: AlphaVectorStage) -> Reals:
    q: Reals = exact_pomdp.compute_action_values(stage_solution, make_beliefs([case.inputs["b"]]))[
        0
    ]
    case.close("q", dict(zip(ACTIONS, q, strict=True)))
    assert case.expect["best"] == [ACTIONS[a] for a in np.flatnonzero(mark_best_actions(q))]
    return q


def finite_horizon_q(case: Case) -> None:
    check_action_values(case, compute_stage(case.inputs["horizon"]))


def singing(case: Case) -> None:
    solution = compute_stage(case.inputs["horizon"], case.inputs["gamma"])
    intervals = find_best_intervals(solution)["sing"]
    assert bool(intervals) == case.expect["optimal_somewhere"]
    case.close("intervals", intervals)
    if "smallest_loss" in case.expect:
        regret, hungry = find_least_regret(solution, "sing")
        case.close("smallest_loss", regret)
        case.close("at", hungry)


def infinite_horizon(case: Case) -> None:
    q = check_action_values(case, compute_infinite_stage())
    case.close("value", q.max())


def infinite_horizon_policy(case: Case) -> None:
    solution = compute_infinite_stage()
    if "vectors" in case.expect:
        check_vectors(case, solution)
    elif "belief" in case.expect:
        (ignored,) = find_best_intervals(solution)["ignore"]
        (fed,) = find_best_intervals(solution)["feed"]
        case.close("belief", ignored[1])
        case.close("belief", fed[0])
    else:
        regret, hungry = find_least_regret(solution, "sing")
        case.close("loss", regret)
        case.close("b", hungry)


KINDS = map_by_kind(
    model, observation, belief_update, belief_chain, always_one_action, finite_horizon,
    finite_horizon_q, singing, infinite_horizon, infinite_horizon_policy,
)  # fmt: skip
LATER: set[str] = set()
