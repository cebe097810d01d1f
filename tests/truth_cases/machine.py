from functools import cache
from typing import Any

import numpy as np
import pytest

from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.errors import ImpossibleObservation
from dmplay.problems.machine_replacement.rules import MachineReplacement
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage
from tests.oracles.belief_regions import find_pieces
from tests.truth_cases.case import Case, map_by_kind

PROBLEM: Problem = MachineReplacement()
TABLES = tabulate(PROBLEM)
ACTIONS = MachineReplacement.actions[0]
OBSERVATIONS = MachineReplacement.observations[0]


def model(case: Case) -> None:
    s, a = case.inputs["state"], ACTIONS.index(case.inputs["action"])
    case.close("next", TABLES.transition[s, a])
    case.close("reward", TABLES.rewards[s, a, 0])


def observation(case: Case) -> None:
    a, after = ACTIONS.index(case.inputs["action"]), case.inputs["next_state"]
    assert TABLES.observation is not None
    case.close("probabilities", TABLES.observation[a, after])


def compute_posterior(case: Case) -> belief.Posterior:
    a, o = ACTIONS.index(case.inputs["action"]), OBSERVATIONS.index(case.inputs["observation"])
    return belief.update_belief(PROBLEM, np.array(case.inputs["b"], float), [a], [o])


def belief_update(case: Case) -> None:
    posterior = compute_posterior(case)
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief)


def impossible_observation(case: Case) -> None:
    with pytest.raises(ImpossibleObservation):
        compute_posterior(case)


def always_one_action(case: Case) -> None:
    a, values = ACTIONS.index(case.inputs["action"]), np.zeros(3)
    for _ in range(case.inputs["horizon"]):
        values = mdp_values.compute_action_values(TABLES, PROBLEM.discount, values)[:, a]
    case.close("values", values)


def fully_observed_value(case: Case) -> None:
    after = mdp_values.compute_finite_horizon_values(
        TABLES, PROBLEM.discount, case.inputs["horizon"] - 1
    )
    q = mdp_values.compute_action_values(TABLES, PROBLEM.discount, after)
    case.close("values", q.max(axis=1))
    case.close("q", q)


@cache
def compute_stage(horizon: int) -> AlphaVectorStage:
    after = (
        compute_stage(horizon - 1).alpha_vectors
        if horizon > 1
        else np.zeros((1, len(TABLES.transition)))
    )
    return exact_pomdp.backup_vectors(TABLES, PROBLEM.discount, after)


def name_values(row: Reals) -> dict[str, Any]:
    return dict(zip(ACTIONS, row, strict=True))


def check_alpha_vectors(case: Case) -> None:
    solution = compute_stage(case.inputs["horizon"])
    assert len(case.expect["vectors"]) == len(solution.alpha_vectors)
    for expected in case.expect["vectors"]:
        k = int(np.argmax(solution.alpha_vectors @ expected["witness"]))
        case.equal(expected["alpha"], solution.alpha_vectors[k])
        assert expected["actions"] == [
            ACTIONS[a] for a in np.flatnonzero(solution.first_action_mask[k])
        ]


def alpha_count(case: Case) -> None:
    solution = compute_stage(case.inputs["horizon"])
    assert case.expect["count"] == len(solution.alpha_vectors)
    case.close("by_action", name_values(solution.first_action_mask.sum(axis=0)))


def value_grid(case: Case) -> None:
    grid = [(i / 5, j / 5, (5 - i - j) / 5) for i in range(6) for j in range(6 - i)]
    case.close(
        "values",
        exact_pomdp.compute_belief_values(
            compute_stage(case.inputs["horizon"]).alpha_vectors, np.array(grid)
        ),
    )


def compute_action_values(horizon: int, b: list[float]) -> tuple[Reals, list[str]]:
    """Return Q of each action, and the best actions."""
    q: Reals = exact_pomdp.compute_action_values(compute_stage(horizon), np.array([b]))[0]
    return q, [ACTIONS[a] for a in np.flatnonzero(mark_best_actions(q))]


def q_values(case: Case) -> None:
    q, best = compute_action_values(case.inputs["horizon"], case.inputs["b"])
    case.close("q", name_values(q))
    assert best == case.expect["best"]


def check_regions(case: Case) -> None:
    pieces_by_action = [
        find_pieces(compute_stage(case.inputs["horizon"]), a) for a in range(len(ACTIONS))
    ]
    case.close(
        "share_of_simplex",
        name_values(
            np.array([sum(p.share for p in action_pieces) for action_pieces in pieces_by_action])
        ),
    )
    case.close(
        "connected_pieces",
        name_values(np.array([len(action_pieces) for action_pieces in pieces_by_action])),
    )


def check_disjoint_manufacture(case: Case) -> None:
    solution = compute_stage(14)
    main, small = find_pieces(solution, ACTIONS.index("manufacture"))
    if "path" in case.expect:
        for point in case.expect["path"]:
            assert compute_action_values(14, point["b"])[1] == point["best"]
    elif "corners" in case.expect:
        case.close("share_of_simplex", small.share)
        assert case.expect["separate"] == (not main.touches & small.touches)
        assert len(case.expect["corners"]) == len(small.outline)
        for corner in case.expect["corners"]:
            nearest = np.argmin(abs(small.outline - corner).max(axis=1))
            case.equal(corner, small.outline[nearest])
    else:
        q, best = compute_action_values(14, case.inputs["b"])
        case.close("q", name_values(q))
        assert best == [case.expect["best"]]
        case.close("margin", np.diff(np.sort(q))[-1])
        cell = int(np.argmax(solution.alpha_vectors @ case.inputs["b"]))
        assert cell in {"main": main, "small": small}[case.expect["region"]].cells


KINDS = map_by_kind(
    model, observation, belief_update, impossible_observation, always_one_action,
    fully_observed_value, alpha_count, value_grid, q_values, alpha_vectors=check_alpha_vectors,
    regions=check_regions, disjoint_manufacture_14=check_disjoint_manufacture,
)  # fmt: skip
LATER: set[str] = set()
