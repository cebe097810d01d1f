from functools import cache

import numpy as np

import dmplay
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.tabular import Tables, tabulate
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.solvers.mdp import mdp_values
from tests.truth_cases.case import Case, map_by_kind
from tests.truth_cases.hex_hunts import check_moves


@cache
def load_hunt(map_: str, predators: int = 1, prey: int = 1) -> PredatorPrey:
    name = "predator-prey" if map_ == "standard" else f"predator-prey:{map_}"
    problem = dmplay.load_problem(name, predators=predators, prey=prey)
    assert isinstance(problem, PredatorPrey)
    return problem


def read_positions(case: Case) -> tuple[PredatorPrey, np.ndarray]:
    predators, prey = case.inputs["predators"], case.inputs["prey"]
    problem = load_hunt(case.inputs["map"], len(predators), len(prey))
    assert [list(hex_) for hex_ in problem.hexes] == case.conventions["maps"][case.inputs["map"]]
    return problem, np.array([[problem.hexes.index(tuple(hex_)) for hex_ in predators + prey]])


def transition(case: Case) -> None:
    check_moves(case, *read_positions(case))


def reward(case: Case) -> None:
    problem, s = read_positions(case)
    agents = s.shape[1]
    for a in range(6):
        outcome = problem.step(s, np.full((1, agents), a), np.full((1, agents), 0.75))
        case.close("rewards", outcome.rewards[0])


@cache
def load_tables(map_: str) -> Tables:
    return tabulate(load_hunt(map_))


def make_seat_tables(map_: str, seat: int) -> Tables:
    """Return the tables of one agent against a uniformly random opponent."""
    joint_tables = load_tables(map_)
    state_count = len(joint_tables.transition)
    transition = joint_tables.transition.reshape(state_count, 6, 6, state_count).mean(axis=2 - seat)
    rewards = joint_tables.rewards.reshape(state_count, 6, 6, 2).mean(axis=2 - seat)
    return Tables(transition, rewards[:, :, seat : seat + 1], None)


@cache
def compute_random_values(map_: str, seat: int) -> Reals:
    seat_tables = make_seat_tables(map_, seat)
    uniform = np.full(seat_tables.rewards.shape[:2], 1 / 6)
    return mdp_values.evaluate_policy(seat_tables, load_hunt(map_).discount, uniform)


@cache
def compute_best_q(map_: str, seat: int) -> Reals:
    return mdp_values.compute_optimal_q(make_seat_tables(map_, seat), load_hunt(map_).discount)


def state_index(case: Case) -> int:
    problem = load_hunt(case.inputs["map"])
    hexes = [tuple(case.inputs["predator"]), tuple(case.inputs["prey"])]
    return int(problem.state_indices(np.array([[problem.hexes.index(hex_) for hex_ in hexes]]))[0])


def random_play_value(case: Case) -> None:
    for seat, name in enumerate(("predator", "prey")):
        case.close(name, compute_random_values(case.inputs["map"], seat)[state_index(case)])


def best_response_to_random(case: Case) -> None:
    for seat, name in enumerate(("predator", "prey")):
        q = compute_best_q(case.inputs["map"], seat)[state_index(case)]
        case.close(f"{name}_value", q.max())
        best = np.flatnonzero(mark_best_actions(q)) + 1
        assert best.tolist() == case.expect[f"{name}_actions"]


KINDS = map_by_kind(
    transition, reward, random_play_value, best_response_to_random,
)  # fmt: skip
LATER: set[str] = set()
