"""Rewards ahead: the values of who sees all, for as many turns as are left."""

import numpy as np
import pytest

import dmplay
from dmplay.core import Problem
from dmplay.solvers import rewards_ahead, value_iteration
from dmplay.tabular import tabulate


def ahead(problem: Problem, seat: int, left: int) -> np.ndarray:
    found = rewards_ahead.estimate_leaf_values(problem, seat, problem.horizon)
    assert found is not None
    s = problem.enumerate_states()
    return np.asarray(found(s, (), np.full(len(s), left)))


def test_without_a_horizon_they_are_the_optimal_values() -> None:
    hexworld = dmplay.load_problem("hexworld")
    optimal = value_iteration.compute_optimal_q(tabulate(hexworld), hexworld.discount).max(axis=1)
    assert ahead(hexworld, 0, 5) == pytest.approx(optimal, abs=1e-4)


@pytest.mark.parametrize("left", [0, 1, 7, 20])
def test_with_a_horizon_they_are_those_of_the_turns_left(left: int) -> None:
    machine = dmplay.load_problem("machine-replacement")
    swept = value_iteration.compute_finite_horizon_values(tabulate(machine), machine.discount, left)
    assert ahead(machine, 0, left) == pytest.approx(swept, abs=1e-9)


def test_the_others_act_at_random_unless_they_share_the_reward() -> None:
    baby = dmplay.load_problem("multicaregiver-crying-baby")
    tables = tabulate(baby)
    for seat in range(2):
        mine = tables.rewards[:, :, seat].reshape(2, 3, 3)
        random = mine.mean(axis=2 - seat).max(axis=1)
        assert ahead(baby, seat, 1) == pytest.approx(random)
    hunt = dmplay.load_problem("collaborative-predator-prey:triangle")
    best = tabulate(hunt).rewards[:, :, 0].max(axis=1)
    assert ahead(hunt, 1, 1) == pytest.approx(best)


def test_they_are_not_found_where_that_would_take_long() -> None:
    for name in ("2048", "mountain-car", "simple-regulator"):
        assert rewards_ahead.estimate_leaf_values(dmplay.load_problem(name), 0, None) is None
    many = dmplay.load_problem("predator-prey:circle", predators=4)
    assert rewards_ahead.estimate_leaf_values(many, 0, None) is None
