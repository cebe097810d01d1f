import numpy as np

import dmplay
from dmplay.core import hexgrid
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.tabular import tabulate
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.solvers.mdp import mdp_values
from tests.truth_cases.case import Case, map_by_kind, sum_probabilities


def load_world(case: Case) -> HexWorld:
    name = case.inputs["map"].replace("_", "-")
    problem = dmplay.load_problem("hexworld" if name == "hexworld" else f"hexworld:{name}")
    assert isinstance(problem, HexWorld)
    return problem


def compute_optimal_q(problem: HexWorld) -> np.ndarray:
    return mdp_values.compute_optimal_q(tabulate(problem), problem.discount)


def evaluate_policy(problem: HexWorld, policy: np.ndarray) -> np.ndarray:
    return mdp_values.evaluate_policy(tabulate(problem), problem.discount, policy)


def make_uniform_policy(problem: HexWorld) -> np.ndarray:
    return np.full((problem.state_count, 6), 1 / 6)


def list_best_actions(q: np.ndarray) -> list[int]:
    return [int(a) + 1 for a in np.flatnonzero(mark_best_actions(q))]


def transition(case: Case) -> None:
    problem = load_world(case)
    s, a = np.array([case.inputs["state"] - 1]), np.array([[case.inputs["action"] - 1]])
    if case.inputs["hex"] is not None:
        assert list(problem.hexes[s[0]]) == case.inputs["hex"]
    p, outcome = dmplay.enumerate_outcomes(problem, s, a)
    case.close("next", sum_probabilities(p[0], [str(k + 1) for k in outcome.state[0]]))
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])


def neighbours(case: Case) -> None:
    case.close(
        "in_action_order", [list(hex_) for hex_ in hexgrid.hex_neighbours(case.inputs["hex"])]
    )


def distance(case: Case) -> None:
    case.close("distance", hexgrid.hex_distance(case.inputs["a"], case.inputs["b"]))


def random_policy_value(case: Case) -> None:
    problem = load_world(case)
    case.close(
        "value", evaluate_policy(problem, make_uniform_policy(problem))[case.inputs["state"] - 1]
    )


def always_one_action_value(case: Case) -> None:
    problem = load_world(case)
    always = np.tile(np.eye(6)[case.inputs["action"] - 1], (problem.state_count, 1))
    case.close("values", evaluate_policy(problem, always))


def uniform_start_return(case: Case) -> None:
    problem = load_world(case)
    values = compute_optimal_q(problem).max(axis=1)[:-1]
    if case.inputs["policy"] != "optimal":
        assert case.inputs["policy"] == "uniformly random actions"
        values = evaluate_policy(problem, make_uniform_policy(problem))[:-1]
    exits = [hex_ for hex_, _ in problem.rewards]
    ordinary = [hex_ not in exits for hex_ in problem.hexes]
    case.close("over_all_hexes", values.mean())
    case.close("over_ordinary_hexes", values[ordinary].mean())


def check_sweeps(case: Case) -> None:
    problem = load_world(case)
    u = mdp_values.compute_finite_horizon_values(
        tabulate(problem), problem.discount, case.inputs["sweeps"]
    )
    case.close("values", u)


def check_optimal(case: Case) -> None:
    q = compute_optimal_q(load_world(case))[case.inputs["state"] - 1]
    case.close("value", q.max())
    case.close("q", q)
    assert list_best_actions(q) == case.expect["actions"]


def make_custom_map(case: Case) -> HexWorld:
    """Return the hex world of a case with a map of its own."""
    inputs = case.inputs
    problem = dmplay.load_problem(
        "hexworld",
        hexes=inputs["hexes"],
        rewards=inputs["rewards"],
        slip=1 - inputs["p_intended"],
        bump_cost=-inputs["bump"],
        discount=inputs["gamma"],
    )
    assert isinstance(problem, HexWorld)
    return problem


def custom_map(case: Case) -> None:
    problem = make_custom_map(case)
    q = compute_optimal_q(problem)
    case.close("values", q.max(axis=1))
    assert [list_best_actions(row) for row in q[:-1]] == case.expect["actions"]
    case.close("random_policy_values", evaluate_policy(problem, make_uniform_policy(problem)))


KINDS = map_by_kind(
    transition, neighbours, distance, random_policy_value, always_one_action_value,
    uniform_start_return, custom_map, value_iteration=check_sweeps, optimal=check_optimal,
)  # fmt: skip
LATER: set[str] = set()
