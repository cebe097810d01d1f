"""Tests of regret matching in matrix games of several players, and of the reported regrets."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest

from dmplay import Labels, load_agent, rollout
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.text import format_upper_bound
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.registry.agents import load_roster
from dmplay.solvers.games import regret_matching

PENNIES_PAYOFFS = np.zeros((2, 2, 2, 3))
# each player matches the next one; the last player mismatches the first
for joint in product(range(2), repeat=3):
    a, b, c = joint
    PENNIES_PAYOFFS[joint] = [a == b, b == c, c != a]
UNEVEN_PAYOFFS = np.arange(24.0).reshape(2, 2, 2, 3) % 5


@dataclass(frozen=True)
class ThreePennies(MatrixGame):
    """Matching pennies for three players."""

    agents = ("one", "two", "three")
    actions = (Labels(("heads", "tails")),) * 3
    payoffs = PENNIES_PAYOFFS


@dataclass(frozen=True)
class UnevenGame(ThreePennies):
    """A game in which the average strategies are not an equilibrium."""

    payoffs = UNEVEN_PAYOFFS


def test_rock_paper_scissors_variants_have_the_right_mixed_strategies() -> None:
    base_payoffs = np.array([[0.0, -1.0, 1.0], [1.0, 0.0, -1.0], [-1.0, 1.0, 0.0]])
    for win_payoff, expected in ((1.0, [1 / 3] * 3), (2.0, [0.25, 0.5, 0.25])):
        game = base_payoffs.copy()
        game[0, 2], game[2, 0] = win_payoff, -win_payoff  # rock against scissors
        result = regret_matching.find_equilibrium(np.stack([game, -game], axis=2))
        np.testing.assert_allclose(result.mixed_strategies[0], expected, atol=0.01)
        assert result.regrets.max() < 0.01


def test_computed_regrets_match_the_definition() -> None:
    rng = np.random.default_rng(3)
    for _ in range(5):
        payoffs = rng.normal(size=(2, 3, 2, 3))
        mixes = tuple(rng.dirichlet(np.ones(action_count)) for action_count in (2, 3, 2))
        gains = regret_matching.compute_regrets(payoffs, mixes)
        for seat in range(3):
            action_values = np.zeros(payoffs.shape[seat])
            for joint in product(*map(range, payoffs.shape[:-1])):
                others = [mixes[i][joint[i]] for i in range(3) if i != seat]
                action_values[joint[seat]] += np.prod(others) * payoffs[joint][seat]
            assert gains[seat] == pytest.approx(action_values.max() - mixes[seat] @ action_values)


def test_an_equilibrium_in_pure_actions_is_found_exactly() -> None:
    payoffs = np.zeros((3, 3, 3, 3))
    payoffs[2, 1, 0] = 1.0
    payoffs[0, 0, 0, 0] = -1.0
    result = regret_matching.find_equilibrium(payoffs)
    assert result.round_count == 0
    assert result.regrets.tolist() == [0, 0, 0]


def test_the_reported_regret_is_never_rounded_down() -> None:
    assert regret_matching.find_equilibrium(UNEVEN_PAYOFFS).regrets.max() == pytest.approx(
        0.20246, abs=1e-5
    )
    assert solve_problem(UnevenGame()).result.endswith(
        "no agent gains more than 0.3 by another action"
    )
    assert [
        format_upper_bound(0.2, 2),
        format_upper_bound(1e-9),
        format_upper_bound(0.20246, 2),
    ] == ["0.2", "1e-09", "0.21"]


def test_three_player_games_have_an_equilibrium_agent_and_a_reported_regret() -> None:
    game = ThreePennies()
    assert [*load_roster(game).agents] == ["equilibrium", "random", "search"]
    report = solve_problem(game)
    assert report.result == "one round; no agent gains by another action"
    assert report.rows[0]["one"] == "heads 0.5 tails 0.5"
    agents = [load_agent(game, seat, "equilibrium") for seat in range(3)]
    returns = rollout(game, agents, episodes=300, turn_limit=10).returns
    np.testing.assert_allclose(returns.mean(axis=0) / 10, 0.5, atol=0.03)
    values = agents[2].action_values(agents[2].initial_memory(np.zeros(1, int)))
    assert values is not None
    np.testing.assert_allclose(values, 0.5)
