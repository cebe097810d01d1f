"""Tests of equilibria of bimatrix games by the Lemke-Howson algorithm."""

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.core.arrays import Reals
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.solvers.games import bimatrix_game, lemke_howson
from tests.support.random_problems import Large


def assert_finds_equilibrium(payoffs: Reals) -> None:
    profile = lemke_howson.find_equilibrium(payoffs)
    for mix in profile:
        assert (mix >= 0).all()
        assert abs(mix.sum() - 1) < 1e-12
    assert bimatrix_game.compute_regrets(payoffs, profile).max() < 1e-9


def test_random_games_of_all_sizes_and_with_ties_have_no_regret() -> None:
    rng = np.random.default_rng(5)
    assert_finds_equilibrium(rng.normal(size=(50, 50, 2)))
    for _ in range(60):
        shape = (*rng.integers(1, 7, 2), 2)
        assert_finds_equilibrium(rng.normal(size=shape))
        assert_finds_equilibrium(rng.integers(-1, 2, shape).astype(float))
    assert_finds_equilibrium(np.zeros((4, 3, 2)))
    first = rng.integers(-1, 2, (30, 40)).astype(float)
    assert_finds_equilibrium(np.stack([first, -first], axis=2))


@pytest.mark.parametrize("scale", [1.0, 1e9])
def test_small_games_have_an_equilibrium_that_support_enumeration_lists(scale: float) -> None:
    rng = np.random.default_rng(6)
    for _ in range(20):
        payoffs = scale * rng.normal(size=(4, 4, 2))
        profile = lemke_howson.find_equilibrium(payoffs)
        all_profiles = bimatrix_game.enumerate_equilibria(payoffs)
        assert (
            min(
                np.abs(candidate.row_strategy - profile.row_strategy).max()
                for candidate in all_profiles
            )
            < 1e-9
        )


def test_a_large_game_is_solved_and_played() -> None:
    game = Large()
    report = solve_problem(game)
    assert report.method == "Lemke-Howson algorithm"
    assert report.result.startswith("a Nash equilibrium of one round; no agent gains")
    (row,) = report.rows
    agents = [load_agent(game, seat, "nash") for seat in range(2)]
    returns = rollout(game, agents, episodes=100, turn_limit=10).returns[:, 0] / 10
    error = returns.std(ddof=1) / 10
    assert abs(returns.mean() - float(str(row["pays agent1"]))) < 3 * error


def test_a_degenerate_game_still_has_an_equilibrium() -> None:
    """The second player is indifferent, so that no two supports of equal size settle the game."""
    payoffs = np.zeros((2, 3, 2))
    payoffs[..., 0] = [[1, 0, 0], [0, 1, 1]]
    assert (
        bimatrix_game.compute_regrets(payoffs, lemke_howson.find_first_equilibrium(payoffs)).max()
        < 1e-9
    )
