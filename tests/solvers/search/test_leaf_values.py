"""Tests of leaf values: the values of a fully informed agent for the turns that are left."""

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import Problem
from dmplay.core.tabular import tabulate
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.search import leaf_values as rewards_ahead


def compute_leaf_values(problem: Problem, seat: int, turns_left: int) -> np.ndarray:
    leaf_values = rewards_ahead.estimate_leaf_values(problem, seat, problem.horizon)
    assert leaf_values is not None
    s = problem.enumerate_states()
    return np.asarray(leaf_values(s, (), np.full(len(s), turns_left)))


def test_leaf_values_without_a_horizon_are_the_optimal_values() -> None:
    hexworld = dmplay.load_problem("hexworld")
    optimal = mdp_values.compute_optimal_q(tabulate(hexworld), hexworld.discount).max(axis=1)
    assert compute_leaf_values(hexworld, 0, 5) == pytest.approx(optimal, abs=1e-4)


@pytest.mark.parametrize("turns_left", [0, 1, 7, 20])
def test_leaf_values_with_a_horizon_depend_on_the_turns_left(turns_left: int) -> None:
    machine = dmplay.load_problem("machine-replacement")
    expected = mdp_values.compute_finite_horizon_values(
        tabulate(machine), machine.discount, turns_left
    )
    assert compute_leaf_values(machine, 0, turns_left) == pytest.approx(expected, abs=1e-9)


def test_other_agents_act_at_random_unless_rewards_are_shared() -> None:
    baby = dmplay.load_problem("multicaregiver-crying-baby")
    tables = tabulate(baby)
    for seat in range(2):
        seat_rewards = tables.rewards[:, :, seat].reshape(2, 3, 3)
        expected = seat_rewards.mean(axis=2 - seat).max(axis=1)
        assert compute_leaf_values(baby, seat, 1) == pytest.approx(expected)
    hunt = dmplay.load_problem("collaborative-predator-prey:triangle")
    expected_best = tabulate(hunt).rewards[:, :, 0].max(axis=1)
    assert compute_leaf_values(hunt, 1, 1) == pytest.approx(expected_best)


def test_leaf_values_are_not_computed_for_large_problems() -> None:
    for name in ("2048", "mountain-car", "simple-regulator"):
        assert rewards_ahead.estimate_leaf_values(dmplay.load_problem(name), 0, None) is None
    large_hunt = dmplay.load_problem("predator-prey:circle", predators=4)
    assert rewards_ahead.estimate_leaf_values(large_hunt, 0, None) is None
