"""Compare our best responses and equilibria with those of OpenSpiel."""

from functools import partial
from typing import Any

import numpy as np
import pytest

pytest.importorskip("pyspiel", reason="needs the extra openspiel")

import pyspiel

import dmplay
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.problem import checked_state_indices, initial_state_distribution
from dmplay.core.tabular import tabulate
from dmplay.problems.crying_baby.rules import CryingBaby
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.solvers.games import bimatrix_game, induced_mdp
from dmplay.solvers.mdp import sparse_mdp
from dmplay.solvers.pomdp import exact_pomdp
from tests.oracles.openspiel_trees import GameTree

pytestmark = pytest.mark.extra("openspiel")

APPROX = partial(pytest.approx, rel=0, abs=1e-9)
CFR_PLUS_UPDATES = 200  # number of CFR+ iterations


def best_response_value(game: Any, seat: int, others: Any) -> float:
    """Return the value of a best response."""
    start = game.new_initial_state()
    return float(pyspiel.TabularBestResponse(game, seat, others).value_from_state(start))


@pytest.mark.parametrize(
    ("turns", "value"), [(3, -10.81), pytest.param(5, -13.46956291, marks=pytest.mark.slow)]
)
def test_a_best_response_to_chance_equals_the_finite_horizon_plan(turns: int, value: float) -> None:
    problem = CryingBaby()
    stage = exact_pomdp.solve_finite_horizon(tabulate(problem), problem.discount, turns)[-1]
    assert (stage.alpha_vectors @ problem.initial_belief).max() == APPROX(value)
    assert best_response_value(GameTree(problem, turns).game(), 0, {}) == APPROX(value)


def test_cfr_plus_converges_to_the_value_of_three_rounds_of_the_prisoners_dilemma() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game = GameTree(problem, 3).game()
    solver = pyspiel.CFRPlusSolver(game)
    for _ in range(CFR_PLUS_UPDATES):
        solver.evaluate_and_update_policy()
    average_policy = solver.average_policy()
    assert pyspiel.nash_conv(game, average_policy) <= 0.001
    agents = [dmplay.load_agent(problem, seat, "nash") for seat in range(2)]
    batch = dmplay.rollout(problem, agents, episodes=1, turn_limit=3)
    assert batch.returns.tolist() == [[-9.0, -9.0]]
    returns = pyspiel.expected_returns(game.new_initial_state(), average_policy, -1, False)
    np.testing.assert_allclose(returns, batch.returns[0], atol=0.005)


@pytest.mark.parametrize(
    "name",
    [
        "prisoners-dilemma",
        "rock-paper-scissors",
        pytest.param("travelers-dilemma", marks=pytest.mark.slow),
    ],
)
def test_our_equilibria_have_no_regret_and_best_responses_have_equal_values(name: str) -> None:
    problem = dmplay.load_problem(name)
    assert isinstance(problem, MatrixGame)
    game = GameTree(problem, 1).game()
    (profile,) = bimatrix_game.enumerate_equilibria(problem.payoffs)
    assert pyspiel.nash_conv(game, make_tabular_policy(game, profile)) == APPROX(0)
    uniform = bimatrix_game.MixedProfile(*(np.full(n, 1 / n) for n in problem.action_counts))
    best = [
        values.max() for values in bimatrix_game.compute_response_values(problem.payoffs, uniform)
    ]
    assert [
        best_response_value(game, seat, make_tabular_policy(game, uniform)) for seat in range(2)
    ] == APPROX(best)


def make_tabular_policy(game: Any, profile: bimatrix_game.MixedProfile) -> Any:
    """Make an OpenSpiel policy from the strategies in a game of one turn."""
    probabilities_by_state = {}
    state = game.new_initial_state()
    for seat, strategy in enumerate(profile):
        probabilities_by_state[state.information_state_string(seat)] = [
            *enumerate(strategy.tolist())
        ]
        state.apply_action(0)
    return pyspiel.TabularPolicy(probabilities_by_state)


@pytest.mark.slow
def test_a_best_response_in_a_markov_game_has_the_value_of_our_solver() -> None:
    problem, turns, prey = PredatorPrey(hexes=((0, 0), (1, 0))), 2, 1
    game = GameTree(problem, turns).game()
    chances, states = initial_state_distribution(problem)
    model = induced_mdp.build_induced_mdp(problem, prey, [np.full((4, 6), 1 / 6)] * 2)
    values = np.zeros(4)
    for _ in range(turns):
        values = sparse_mdp.compute_action_values(model, problem.discount, values).max(axis=1)
    expected_value = float(chances @ values[checked_state_indices(problem, states)])
    assert best_response_value(game, prey, pyspiel.UniformRandomPolicy(game)) == APPROX(
        expected_value
    )
