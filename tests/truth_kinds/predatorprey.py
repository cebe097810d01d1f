from functools import cache

import numpy as np

import dmplay
from dmplay.chance import Reals
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import value_iteration
from dmplay.tabular import Tables, tabulate
from tests.truth_kinds.case import Case, by_kind
from tests.truth_kinds.hunts import moves


@cache
def hunt(map_: str, predators: int = 1, prey: int = 1) -> PredatorPrey:
    name = "predator-prey" if map_ == "standard" else f"predator-prey:{map_}"
    problem = dmplay.load_problem(name, predators=predators, prey=prey)
    assert isinstance(problem, PredatorPrey)
    return problem


def given(case: Case) -> tuple[PredatorPrey, np.ndarray]:
    predators, prey = case.given["predators"], case.given["prey"]
    problem = hunt(case.given["map"], len(predators), len(prey))
    assert [list(hex_) for hex_ in problem.hexes] == case.conventions["maps"][case.given["map"]]
    return problem, np.array([[problem.hexes.index(tuple(hex_)) for hex_ in predators + prey]])


def transition(case: Case) -> None:
    moves(case, *given(case))


def reward(case: Case) -> None:
    problem, s = given(case)
    agents = s.shape[1]
    for a in range(6):
        outcome = problem.step(s, np.full((1, agents), a), np.full((1, agents), 0.75))
        case.close("rewards", outcome.rewards[0])


@cache
def tables(map_: str) -> Tables:
    return tabulate(hunt(map_))


def alone(map_: str, seat: int) -> Tables:
    """What one agent faces while the other is uniformly random."""
    both = tables(map_)
    size = len(both.transition)
    transition = both.transition.reshape(size, 6, 6, size).mean(axis=2 - seat)
    rewards = both.rewards.reshape(size, 6, 6, 2).mean(axis=2 - seat)
    return Tables(transition, rewards[:, :, seat : seat + 1], None)


@cache
def random_values(map_: str, seat: int) -> Reals:
    faced = alone(map_, seat)
    uniform = np.full(faced.rewards.shape[:2], 1 / 6)
    return value_iteration.evaluate_policy(faced, hunt(map_).discount, uniform)


@cache
def best_values(map_: str, seat: int) -> Reals:
    return value_iteration.compute_optimal_q(alone(map_, seat), hunt(map_).discount)


def place(case: Case) -> int:
    problem = hunt(case.given["map"])
    hexes = [tuple(case.given["predator"]), tuple(case.given["prey"])]
    return int(problem.state_indices(np.array([[problem.hexes.index(hex_) for hex_ in hexes]]))[0])


def random_play_value(case: Case) -> None:
    for seat, name in enumerate(("predator", "prey")):
        case.close(name, random_values(case.given["map"], seat)[place(case)])


def best_response_to_random(case: Case) -> None:
    for seat, name in enumerate(("predator", "prey")):
        q = best_values(case.given["map"], seat)[place(case)]
        case.close(f"{name}_value", q.max())
        best = np.flatnonzero(value_iteration.mark_best_actions(q)) + 1
        assert best.tolist() == case.expect[f"{name}_actions"]


KINDS = by_kind(
    transition, reward, random_play_value, best_response_to_random,
)  # fmt: skip
LATER: set[str] = set()
