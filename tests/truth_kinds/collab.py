import re
from functools import cache

import numpy as np

import dmplay
from dmplay.chance import Reals
from dmplay.problems.collaborative_predator_prey import SENSE_LABELS, CollaborativePredatorPrey
from dmplay.solvers import sparse
from dmplay.solvers.value_iteration import mark_best_actions
from tests.truth_kinds.case import Case, by_kind
from tests.truth_kinds.hunts import moves

BLOCK = 2048  # states whose outcomes are listed at a time


@cache
def hunt(map_: str, predators: int = 2, sighted: bool = False) -> CollaborativePredatorPrey:
    name = "collaborative-predator-prey" + (f":{map_}" if map_ != "standard" else "")
    problem = dmplay.load_problem(name, predators=predators, sighted=sighted)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


def given(case: Case, after: str = "") -> tuple[CollaborativePredatorPrey, np.ndarray]:
    predators, prey = case.given[f"predators{after}"], case.given[f"prey{after}"]
    problem = hunt(case.given["map"], len(predators))
    assert [list(hex_) for hex_ in problem.hexes] == case.conventions["maps"][case.given["map"]]
    return problem, np.array([[problem.hexes.index(tuple(hex_)) for hex_ in [*predators, prey]]])


def transition(case: Case) -> None:
    moves(case, *given(case))
    reward(case)


def reward(case: Case) -> None:
    problem, s = given(case)
    many = problem.predators
    for a in range(6):
        outcome = problem.step(s, np.full((1, many), a), np.full((1, many + 1), 0.75))
        for paid in outcome.rewards[0]:
            case.close("reward", paid)


def observation(case: Case) -> None:
    """Every outcome that leads to this state shows the same, whatever was done."""
    problem, after = given(case, "_after")
    states, found = problem.enumerate_states(), False
    for block in np.split(states, range(BLOCK, len(states), BLOCK)):
        a = np.zeros((len(block), problem.predators), np.int64)
        p, outcome = dmplay.enumerate_outcomes(problem, block, a)
        leads = (outcome.state == after[0]).all(axis=2) & (p > 0)
        for seen in outcome.observations[leads]:
            case.close("observations", [SENSE_LABELS[int(one)] for one in seen])
        found |= leads.any()
    assert found
    assert case.expect["probability"] == 1


@cache
def model(map_: str) -> sparse.SparseMdp:
    return sparse.build_sparse_mdp(hunt(map_))


@cache
def random_team(map_: str) -> Reals:
    uniform = np.full((hunt(map_).state_count, 36), 1 / 36)
    return sparse.evaluate_policy(model(map_), hunt(map_).discount, uniform)


@cache
def optimum(map_: str) -> Reals:
    return sparse.compute_optimal_q(model(map_), hunt(map_).discount)


@cache
def reactive_team(map_: str, on_prey: int, on_nothing: int) -> Reals:
    problem = hunt(map_)
    near = problem.observe(problem.enumerate_states()) == SENSE_LABELS.index("prey")
    action = np.where(near, on_prey, on_nothing) - 1
    policy = np.eye(36)[action[:, 0] * 6 + action[:, 1]]
    return sparse.evaluate_policy(model(map_), problem.discount, policy)


def value(case: Case) -> None:
    problem, s = given(case)
    map_, place = case.given["map"], int(problem.state_indices(s)[0])
    case.close("random_team", random_team(map_)[place])
    for name, told in case.expect["reactive_teams"].items():
        found = re.fullmatch(r"(\d) on 'prey', (\d) on 'nothing'", name)
        assert found
        case.equal(told, reactive_team(map_, int(found[1]), int(found[2]))[place])
    q = optimum(map_)[place]
    case.close("centralised_optimum", q.max())
    pairs = [[int(a) // 6 + 1, int(a) % 6 + 1] for a in np.flatnonzero(mark_best_actions(q))]
    assert pairs == case.expect["optimal_joint_actions"]


def uniform_start_value(case: Case) -> None:
    map_ = case.given["map"]
    if case.given["team"].startswith("centralised optimum"):
        case.close("value", optimum(map_).max(axis=1).mean())
    else:
        assert case.given["team"] == "uniformly random actions"
        case.close("value", random_team(map_).mean())


KINDS = by_kind(
    transition, observation, reward, value, uniform_start_value,
)  # fmt: skip
LATER: set[str] = set()
