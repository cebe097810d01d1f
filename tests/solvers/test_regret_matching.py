"""Simple games of many: what nobody can better, and how much it could."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from dmplay import Labels, load_agent, rollout
from dmplay.describe import format_upper_bound
from dmplay.finding.agents import load_roster
from dmplay.matrix_game import MatrixGame
from dmplay.solutions.every import solve_problem
from dmplay.solvers import regret_matching

PENNIES = np.zeros((2, 2, 2, 3))
for joint in product(range(2), repeat=3):  # each wants to be like the next, the last unlike
    a, b, c = joint
    PENNIES[joint] = [a == b, b == c, c != a]
UNEVEN = np.arange(24.0).reshape(2, 2, 2, 3) % 5


@dataclass(frozen=True)
class Three(MatrixGame):
    """Three pennies."""

    agents = ("one", "two", "three")
    actions = (Labels(("heads", "tails")),) * 3
    payoffs = PENNIES


@dataclass(frozen=True)
class Uneven(Three):
    """A game in which what all play on average is no equilibrium."""

    payoffs = UNEVEN


def test_hands_are_thrown_a_third_of_the_time() -> None:
    hands = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
    for wins, wanted in ((1.0, [1 / 3] * 3), (2.0, [0.25, 0.5, 0.25])):
        game = hands.copy()
        game[0, 2], game[2, 0] = wins, -wins  # rock against scissors
        found = regret_matching.find_equilibrium(np.stack([game, -game], axis=2))
        np.testing.assert_allclose(found.mixed_strategies[0], wanted, atol=0.01)
        assert found.regrets.max() < 0.01


def test_what_could_be_gained_is_what_it_says() -> None:
    draw = np.random.default_rng(3)
    for _ in range(5):
        payoffs = draw.normal(size=(2, 3, 2, 3))
        mixes = tuple(draw.dirichlet(np.ones(many)) for many in (2, 3, 2))
        gains = regret_matching.compute_regrets(payoffs, mixes)
        for seat in range(3):
            earned = np.zeros(payoffs.shape[seat])
            for joint in product(*map(range, payoffs.shape[:-1])):
                others = [mixes[i][joint[i]] for i in range(3) if i != seat]
                earned[joint[seat]] += np.prod(others) * payoffs[joint][seat]
            assert gains[seat] == pytest.approx(earned.max() - mixes[seat] @ earned)


def test_an_equilibrium_in_pure_actions_is_found_exactly() -> None:
    payoffs = np.zeros((3, 3, 3, 3))
    payoffs[2, 1, 0] = 1.0
    payoffs[0, 0, 0, 0] = -1.0
    found = regret_matching.find_equilibrium(payoffs)
    assert found.round_count == 0
    assert found.regrets.tolist() == [0, 0, 0]


def test_what_could_be_gained_is_told_no_smaller_than_it_is() -> None:
    assert regret_matching.find_equilibrium(UNEVEN).regrets.max() == pytest.approx(
        0.20246, abs=1e-5
    )
    assert solve_problem(Uneven()).result.endswith("nobody gains more than 0.3")
    assert [
        format_upper_bound(0.2, 2),
        format_upper_bound(1e-9),
        format_upper_bound(0.20246, 2),
    ] == ["0.2", "1e-09", "0.21"]


def test_three_are_advised_and_told_how_near_they_are() -> None:
    game = Three()
    assert [*load_roster(game).agents] == ["equilibrium", "random", "search"]
    told = solve_problem(game)
    assert told.result == "one round; by another action nobody gains anything"
    assert told.rows[0]["one"] == "heads 0.5 tails 0.5"
    seated = [load_agent(game, seat, "equilibrium") for seat in range(3)]
    returns = rollout(game, seated, episodes=300, turn_limit=10).returns
    np.testing.assert_allclose(returns.mean(axis=0) / 10, 0.5, atol=0.03)
    values = seated[2].action_values(seated[2].initial_memory(np.zeros(1, int)))
    assert values is not None
    np.testing.assert_allclose(values, 0.5)
