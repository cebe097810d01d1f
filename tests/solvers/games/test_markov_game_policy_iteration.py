"""Tests of equilibria between one predator and one prey."""

from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.core.tabular import tabulate
from dmplay.core.work_budget import report_progress_to
from dmplay.errors import BadParameter
from dmplay.solvers.games import markov_game_policy_iteration, zero_sum
from dmplay.solvers.mdp.mdp_values import compute_action_values


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("predator-prey", {}),
        ("predator-prey:circle", {}),
        ("predator-prey:triangle", {}),
        ("predator-prey", {"slip": 0.0, "discount": 0.99}),
        ("predator-prey:circle", {"slip": 0.05, "discount": 0.999}),
    ],
)
def test_neither_agent_gains_by_deviating(name: str, settings: dict[str, Any]) -> None:
    problem = dmplay.load_problem(name, **settings)
    result = markov_game_policy_iteration.find_equilibrium(problem)
    assert result.value_changes[-1] < 1e-9
    # The prey loses 100 where the predator gains 2, so its gap is measured in hundreds.
    assert result.regrets[0] < 1e-7 / (1 - problem.discount)
    assert result.regrets[1] < 1e-5 / (1 - problem.discount)
    for strategies in result.policies:
        np.testing.assert_allclose(strategies.sum(axis=1), 1)


def test_the_values_match_those_of_shapley_iteration() -> None:
    """Compare with Shapley's iteration of matrix games, which has a unique fixed point."""
    problem = dmplay.load_problem("predator-prey:triangle", discount=0.5)
    tables = tabulate(problem)
    values = np.zeros(9)
    for _ in range(40):
        games = compute_action_values(tables, problem.discount, values).reshape(9, 6, 6)
        values = np.array(
            [zero_sum.solve_matrix_games(payoffs[None]).values[0] for payoffs in games]
        )
    result = markov_game_policy_iteration.find_equilibrium(problem)
    np.testing.assert_allclose(result.action_values[0], values, atol=1e-9)
    np.testing.assert_allclose(result.action_values[1], -50 * (values + 2), atol=1e-7)


def test_the_iteration_reports_its_progress() -> None:
    shares: list[float] = []
    with report_progress_to(shares.append):
        markov_game_policy_iteration.find_equilibrium(dmplay.load_problem("predator-prey:triangle"))
    assert len({*shares}) >= 4
    assert shares == sorted(shares)
    assert shares[0] == 0
    assert shares[-1] == 1


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("predator-prey", {"predators": 2}, "got 3 agents"),
        ("predator-prey", {"discount": 1.0}, "below 1"),
        ("multicaregiver-crying-baby", {}, "expected 2 that both see the state"),
        ("prisoners-dilemma", {"discount": 0.9}, "rewards that are not opposed"),
        ("predator-prey", {"hexes": [[q, 0] for q in range(23)]}, "got 529 states"),
    ],
)
def test_unsupported_games_are_rejected(name: str, settings: dict[str, Any], message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        markov_game_policy_iteration.find_equilibrium(dmplay.load_problem(name, **settings))
