import numpy as np

import dmplay
from dmplay import hexes
from dmplay.problems.hexworld import HexWorld
from dmplay.solvers import value_iteration
from dmplay.tabular import tabulate
from tests.truth_kinds.case import Case, by_kind, reached


def world(case: Case) -> HexWorld:
    name = case.given["map"].replace("_", "-")
    problem = dmplay.load_problem("hexworld" if name == "hexworld" else f"hexworld:{name}")
    assert isinstance(problem, HexWorld)
    return problem


def optimal(problem: HexWorld) -> np.ndarray:
    return value_iteration.compute_optimal_q(tabulate(problem), problem.discount)


def follow(problem: HexWorld, policy: np.ndarray) -> np.ndarray:
    return value_iteration.evaluate_policy(tabulate(problem), problem.discount, policy)


def uniform(problem: HexWorld) -> np.ndarray:
    return np.full((problem.state_count, 6), 1 / 6)


def best(q: np.ndarray) -> list[int]:
    return [int(a) + 1 for a in np.flatnonzero(value_iteration.mark_best_actions(q))]


def transition(case: Case) -> None:
    problem = world(case)
    s, a = np.array([case.given["state"] - 1]), np.array([[case.given["action"] - 1]])
    if case.given["hex"] is not None:
        assert list(problem.hexes[s[0]]) == case.given["hex"]
    p, outcome = dmplay.enumerate_outcomes(problem, s, a)
    case.close("next", reached(p[0], [str(k + 1) for k in outcome.state[0]]))
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])


def neighbours(case: Case) -> None:
    case.close("in_action_order", [list(hex_) for hex_ in hexes.hex_neighbours(case.given["hex"])])


def distance(case: Case) -> None:
    case.close("distance", hexes.hex_distance(case.given["a"], case.given["b"]))


def random_policy_value(case: Case) -> None:
    problem = world(case)
    case.close("value", follow(problem, uniform(problem))[case.given["state"] - 1])


def always_one_action_value(case: Case) -> None:
    problem = world(case)
    always = np.tile(np.eye(6)[case.given["action"] - 1], (problem.state_count, 1))
    case.close("values", follow(problem, always))


def uniform_start_return(case: Case) -> None:
    problem = world(case)
    values = optimal(problem).max(axis=1)[:-1]
    if case.given["policy"] != "optimal":
        assert case.given["policy"] == "uniformly random actions"
        values = follow(problem, uniform(problem))[:-1]
    exits = [hex_ for hex_, _ in problem.rewards]
    ordinary = [hex_ not in exits for hex_ in problem.hexes]
    case.close("over_all_hexes", values.mean())
    case.close("over_ordinary_hexes", values[ordinary].mean())


def sweeps(case: Case) -> None:
    problem = world(case)
    u = value_iteration.compute_finite_horizon_values(
        tabulate(problem), problem.discount, case.given["sweeps"]
    )
    case.close("values", u)


def optimum(case: Case) -> None:
    q = optimal(world(case))[case.given["state"] - 1]
    case.close("value", q.max())
    case.close("q", q)
    assert best(q) == case.expect["actions"]


def custom_map(case: Case) -> None:
    given = case.given
    problem = dmplay.load_problem(
        "hexworld",
        hexes=given["hexes"],
        rewards=given["rewards"],
        slip=1 - given["p_intended"],
        bump_cost=-given["bump"],
        discount=given["gamma"],
    )
    assert isinstance(problem, HexWorld)
    q = optimal(problem)
    case.close("values", q.max(axis=1))
    assert [best(row) for row in q[:-1]] == case.expect["actions"]
    case.close("random_policy_values", follow(problem, uniform(problem)))


KINDS = by_kind(
    transition, neighbours, distance, random_policy_value, always_one_action_value,
    uniform_start_return, custom_map, value_iteration=sweeps, optimal=optimum,
)  # fmt: skip
LATER: set[str] = set()
