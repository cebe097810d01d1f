"""Best responses and equilibria of OpenSpiel are those that our solvers find."""

from functools import partial
from typing import Any

import numpy as np
import pyspiel
import pytest

import dmplay
from dmplay.core import checked_state_indices, initial_state_distribution
from dmplay.matrix_game import MatrixGame
from dmplay.problems.crying_baby import CryingBaby
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solvers import alpha_vectors, best_response, matrix_game, sparse
from dmplay.tabular import tabulate
from tests.oracles.spiel import Tree

CLOSE = partial(pytest.approx, rel=0, abs=1e-9)
UPDATES = 200  # of CFR+


def reached(game: Any, seat: int, others: Any) -> float:
    """What a best response earns."""
    start = game.new_initial_state()
    return float(pyspiel.TabularBestResponse(game, seat, others).value_from_state(start))


@pytest.mark.parametrize(
    ("turns", "worth"),
    [(3, -10.81), pytest.param(5, -13.46956291, marks=pytest.mark.slow)],
)
def test_a_best_response_to_nature_is_worth_what_the_plan_for_so_many_turns_is(
    turns: int, worth: float
) -> None:
    problem = CryingBaby()
    stage = alpha_vectors.solve_finite_horizon(tabulate(problem), problem.discount, turns)[-1]
    assert (stage.alpha_vectors @ problem.initial_belief).max() == CLOSE(worth)
    assert reached(Tree(problem, turns).game(), 0, {}) == CLOSE(worth)


def test_cfr_plus_comes_to_the_value_of_three_rounds_of_the_prisoners_dilemma() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    game = Tree(problem, 3).game()
    solver = pyspiel.CFRPlusSolver(game)
    for _ in range(UPDATES):
        solver.evaluate_and_update_policy()
    found = solver.average_policy()
    assert pyspiel.nash_conv(game, found) <= 0.001
    ours = [dmplay.load_agent(problem, seat, "nash") for seat in range(2)]
    played = dmplay.rollout(problem, ours, episodes=1, turn_limit=3)
    assert played.returns.tolist() == [[-9.0, -9.0]]
    worth = pyspiel.expected_returns(game.new_initial_state(), found, -1, False)
    np.testing.assert_allclose(worth, played.returns[0], atol=0.005)


@pytest.mark.parametrize(
    "name",
    [
        "prisoners-dilemma",
        "rock-paper-scissors",
        pytest.param("travelers-dilemma", marks=pytest.mark.slow),
    ],
)
def test_nobody_gains_by_leaving_our_equilibria_and_best_responses_earn_as_much(
    name: str,
) -> None:
    problem = dmplay.load_problem(name)
    assert isinstance(problem, MatrixGame)
    game = Tree(problem, 1).game()
    (profile,) = matrix_game.enumerate_equilibria(problem.payoffs)
    assert pyspiel.nash_conv(game, policy(game, profile)) == CLOSE(0)
    uniform = matrix_game.MixedProfile(*(np.full(n, 1 / n) for n in problem.action_counts))
    best = [
        values.max() for values in matrix_game.compute_response_values(problem.payoffs, uniform)
    ]
    assert [reached(game, seat, policy(game, uniform)) for seat in range(2)] == CLOSE(best)


def policy(game: Any, profile: matrix_game.MixedProfile) -> Any:
    """Strategies in a game of one turn."""
    told = {}
    state = game.new_initial_state()
    for seat, strategy in enumerate(profile):
        told[state.information_state_string(seat)] = [*enumerate(strategy.tolist())]
        state.apply_action(0)
    return pyspiel.TabularPolicy(told)


@pytest.mark.slow
def test_a_best_response_in_a_markov_game_is_worth_what_we_find() -> None:
    problem, turns, prey = PredatorPrey(hexes=((0, 0), (1, 0))), 2, 1
    game = Tree(problem, turns).game()
    chances, states = initial_state_distribution(problem)
    model = best_response.build_induced_mdp(problem, prey, [np.full((4, 6), 1 / 6)] * 2)
    values = np.zeros(4)
    for _ in range(turns):
        values = sparse.compute_action_values(model, problem.discount, values).max(axis=1)
    wanted = float(chances @ values[checked_state_indices(problem, states)])
    assert reached(game, prey, pyspiel.UniformRandomPolicy(game)) == CLOSE(wanted)
