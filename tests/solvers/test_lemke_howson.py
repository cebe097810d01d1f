"""Equilibria of bimatrix games: nobody gains by another action."""

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.chance import Reals
from dmplay.solutions.every import solve_problem
from dmplay.solvers import lemke_howson, matrix_game
from tests.support.drawn import Large


def mixed(payoffs: Reals) -> None:
    found = lemke_howson.find_equilibrium(payoffs)
    for mix in found:
        assert (mix >= 0).all()
        assert abs(mix.sum() - 1) < 1e-12
    assert matrix_game.compute_regrets(payoffs, found).max() < 1e-9


def test_nobody_gains_in_games_that_are_drawn_large_small_or_full_of_ties() -> None:
    draw = np.random.default_rng(5)
    mixed(draw.normal(size=(50, 50, 2)))
    for _ in range(60):
        shape = (*draw.integers(1, 7, 2), 2)
        mixed(draw.normal(size=shape))
        mixed(draw.integers(-1, 2, shape).astype(float))
    mixed(np.zeros((4, 3, 2)))
    first = draw.integers(-1, 2, (30, 40)).astype(float)
    mixed(np.stack([first, -first], axis=2))


@pytest.mark.parametrize("size", [1.0, 1e9])
def test_of_a_small_game_it_is_one_that_support_enumeration_lists(size: float) -> None:
    draw = np.random.default_rng(6)
    for _ in range(20):
        payoffs = size * draw.normal(size=(4, 4, 2))
        found = lemke_howson.find_equilibrium(payoffs)
        listed = matrix_game.enumerate_equilibria(payoffs)
        assert min(np.abs(one.row_strategy - found.row_strategy).max() for one in listed) < 1e-9


def test_a_large_game_is_solved_and_played() -> None:
    game = Large()
    told = solve_problem(game)
    assert told.method == "Lemke and Howson's pivoting"
    assert told.result.startswith("a Nash equilibrium of one round; by another action nobody gains")
    (row,) = told.rows
    seated = [load_agent(game, seat, "nash") for seat in range(2)]
    returns = rollout(game, seated, episodes=100, turn_limit=10).returns[:, 0] / 10
    error = returns.std(ddof=1) / 10
    assert abs(returns.mean() - float(str(row["pays agent1"]))) < 3 * error


def test_a_game_whose_ties_hide_its_equilibria_has_one_all_the_same() -> None:
    """Every action of the second is as good to it: no two supports of a size settle it."""
    payoffs = np.zeros((2, 3, 2))
    payoffs[..., 0] = [[1, 0, 0], [0, 1, 1]]
    assert (
        matrix_game.compute_regrets(payoffs, lemke_howson.find_first_equilibrium(payoffs)).max()
        < 1e-9
    )
