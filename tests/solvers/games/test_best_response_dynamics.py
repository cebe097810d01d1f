"""Tests of iterated best responses: regrets against the values of all deterministic policies."""

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.core.arrays import Reals
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadPolicy
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.solvers.games import best_response_dynamics
from dmplay.solvers.mdp import transition_graph
from tests.support.random_problems import RandomGame, with_two_or_ten_seeds


def compute_best_value(problem: RandomGame, other: Reals, seat: int) -> float:
    """Return the value at the start of the best policy of a seat against a mix `[5, 3]`."""
    rewards = problem.rewards[..., seat].reshape(5, 3, 3)
    joint_transition = problem.transition.reshape(5, 3, 3, 5)
    seat_rewards = np.einsum("sab,sb->sa", np.moveaxis(rewards, 1 + seat, 1), other)
    seat_transition = np.einsum("sabt,sb->sat", np.moveaxis(joint_transition, 1 + seat, 1), other)
    terminal = problem.terminal(np.arange(5))
    policies = np.array([*product(*(np.flatnonzero(row[seat]) for row in problem.legal_mask))])
    index = np.arange(5), policies
    policy_transition = np.where(terminal[:, None], 0.0, seat_transition[index])
    policy_rewards = np.where(terminal, 0.0, seat_rewards[index])[..., None]
    return float(
        np.linalg.solve(np.eye(5) - problem.discount * policy_transition, policy_rewards)[
            :, 0
        ].max()
    )


@with_two_or_ten_seeds
def test_reported_regrets_match_the_best_policy_in_random_games(seeds: range) -> None:
    pure_count = 0
    for seed in seeds:
        problem = RandomGame(seed=seed, ends=seed % 2 == 0, discount=0.3)
        result = best_response_dynamics.find_equilibrium(
            problem, transition_graph.build_reachable_graph(problem)
        )
        pure_count += result.regrets.max() < 1e-8
        assert result.regrets.max() < 0.1
        for seat in range(2):
            other = np.eye(3)[np.zeros(5, int)]
            other[result.graph.states] = result.policies[1 - seat]
            gain = compute_best_value(problem, other, seat) - result.values[0, seat]
            assert gain == pytest.approx(result.regrets[seat], abs=1e-6)
    assert pure_count >= len(seeds) / 2


@dataclass(frozen=True)
class ScaledGame(RandomGame):
    """The same random game with rewards a million times as large."""

    @cached_property
    def rewards(self) -> Reals:
        """The rewards, times one million."""
        return 1e6 * super().rewards


def test_scaling_rewards_by_a_million_does_not_slow_convergence() -> None:
    with limit_total_work(2e9):
        plain, scaled = (
            best_response_dynamics.find_equilibrium(
                problem, transition_graph.build_reachable_graph(problem)
            )
            for problem in (RandomGame(seed=0), ScaledGame(seed=0))
        )
    assert scaled.values == pytest.approx(1e6 * plain.values)
    assert scaled.regrets.max() < 1e-6


@dataclass(frozen=True)
class Dilemma(RandomGame):
    """The prisoner's dilemma in every state: the first action is to defect."""

    @cached_property
    def rewards(self) -> Reals:
        """The rewards; the third action is a copy of cooperation."""
        cooperation_row = [[0, 3], [2, 2], [2, 2]]
        table = np.array([[[1, 1], [3, 0], [3, 0]], cooperation_row, cooperation_row])
        return np.tile(table.reshape(1, 9, 2), (5, 1, 1)).astype(float)

    @cached_property
    def transition(self) -> Reals:
        """Uniform transitions, whatever the actions."""
        return np.tile(np.full(5, 0.2), (5, 9, 1))


def test_both_players_defect_and_the_report_shows_no_regret() -> None:
    dilemma = Dilemma(ends=False)
    report = solve_problem(dilemma)
    assert report.method == "best responses over 5 states, 1 round"
    expected = "value 10 for one, 10 for two at the start; gain by another policy: "
    assert report.result.startswith(expected)
    assert {row["one"] for row in report.rows} == {"a"}
    agents = [load_agent(dilemma, seat, "equilibrium") for seat in range(2)]
    returns = rollout(dilemma, agents, episodes=2, turn_limit=100).returns
    np.testing.assert_allclose(returns, 10, atol=1e-3)
    values = agents[0].action_values(agents[0].initial_memory(np.zeros(1, int)))
    assert values is not None
    np.testing.assert_allclose(values[0][dilemma.legal_mask[0, 0]].max(), 10)


def test_an_undiscounted_endless_general_sum_game_is_rejected() -> None:
    problem = RandomGame(discount=1.0)
    with pytest.raises(BadPolicy, match="expected a discount below 1"):
        best_response_dynamics.find_equilibrium(
            problem, transition_graph.build_reachable_graph(problem)
        )
