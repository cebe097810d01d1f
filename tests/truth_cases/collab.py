import re
from functools import cache

import numpy as np

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.problems.collaborative_predator_prey.rules import (
    SENSE_LABELS,
    CollaborativePredatorPrey,
)
from dmplay.solvers.mdp import sparse_mdp
from tests.truth_cases.case import Case, map_by_kind
from tests.truth_cases.hex_hunts import check_moves

BLOCK_STATE_COUNT = 2048  # states whose outcomes are enumerated at a time


@cache
def load_hunt(map_: str, predators: int = 2, sighted: bool = False) -> CollaborativePredatorPrey:
    name = "collaborative-predator-prey" + (f":{map_}" if map_ != "standard" else "")
    problem = dmplay.load_problem(name, predators=predators, sighted=sighted)
    assert isinstance(problem, CollaborativePredatorPrey)
    return problem


def read_positions(case: Case, after: str = "") -> tuple[CollaborativePredatorPrey, np.ndarray]:
    predators, prey = case.inputs[f"predators{after}"], case.inputs[f"prey{after}"]
    problem = load_hunt(case.inputs["map"], len(predators))
    assert [list(hex_) for hex_ in problem.hexes] == case.conventions["maps"][case.inputs["map"]]
    return problem, np.array([[problem.hexes.index(tuple(hex_)) for hex_ in [*predators, prey]]])


def transition(case: Case) -> None:
    check_moves(case, *read_positions(case))
    reward(case)


def reward(case: Case) -> None:
    problem, s = read_positions(case)
    predator_count = problem.predators
    for a in range(6):
        outcome = problem.step(
            s, np.full((1, predator_count), a), np.full((1, predator_count + 1), 0.75)
        )
        for paid_reward in outcome.rewards[0]:
            case.close("reward", paid_reward)


def observation(case: Case) -> None:
    """Check that each outcome with this state has the same observations, for any action."""
    problem, target = read_positions(case, "_after")
    states, is_reached = problem.enumerate_states(), False
    for block in np.split(states, range(BLOCK_STATE_COUNT, len(states), BLOCK_STATE_COUNT)):
        a = np.zeros((len(block), problem.predators), np.int64)
        p, outcome = dmplay.enumerate_outcomes(problem, block, a)
        matches = (outcome.state == target[0]).all(axis=2) & (p > 0)
        for observations in outcome.observations[matches]:
            case.close(
                "observations", [SENSE_LABELS[int(observation)] for observation in observations]
            )
        is_reached |= matches.any()
    assert is_reached
    assert case.expect["probability"] == 1


@cache
def build_model(map_: str) -> sparse_mdp.SparseMdp:
    return sparse_mdp.build_sparse_mdp(load_hunt(map_))


@cache
def evaluate_random_team(map_: str) -> Reals:
    uniform = np.full((load_hunt(map_).state_count, 36), 1 / 36)
    return sparse_mdp.evaluate_policy(build_model(map_), load_hunt(map_).discount, uniform)


@cache
def compute_optimal_q(map_: str) -> Reals:
    return sparse_mdp.compute_optimal_q(build_model(map_), load_hunt(map_).discount)


@cache
def evaluate_reactive_team(map_: str, on_prey: int, on_nothing: int) -> Reals:
    problem = load_hunt(map_)
    near = problem.get_observations(problem.enumerate_states()) == SENSE_LABELS.index("prey")
    action = np.where(near, on_prey, on_nothing) - 1
    policy = np.eye(36)[action[:, 0] * 6 + action[:, 1]]
    return sparse_mdp.evaluate_policy(build_model(map_), problem.discount, policy)


def value(case: Case) -> None:
    problem, s = read_positions(case)
    map_, state_index = case.inputs["map"], int(problem.state_indices(s)[0])
    case.close("random_team", evaluate_random_team(map_)[state_index])
    for name, expected in case.expect["reactive_teams"].items():
        actions = re.fullmatch(r"(\d) on 'prey', (\d) on 'nothing'", name)
        assert actions
        case.equal(
            expected, evaluate_reactive_team(map_, int(actions[1]), int(actions[2]))[state_index]
        )
    q = compute_optimal_q(map_)[state_index]
    case.close("centralised_optimum", q.max())
    pairs = [[int(a) // 6 + 1, int(a) % 6 + 1] for a in np.flatnonzero(mark_best_actions(q))]
    assert pairs == case.expect["optimal_joint_actions"]


def uniform_start_value(case: Case) -> None:
    map_ = case.inputs["map"]
    if case.inputs["team"].startswith("centralised optimum"):
        case.close("value", compute_optimal_q(map_).max(axis=1).mean())
    else:
        assert case.inputs["team"] == "uniformly random actions"
        case.close("value", evaluate_random_team(map_).mean())


KINDS = map_by_kind(
    transition, observation, reward, value, uniform_start_value,
)  # fmt: skip
LATER: set[str] = set()
