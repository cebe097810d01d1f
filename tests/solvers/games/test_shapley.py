"""Tests of zero-sum Markov games, against matrix games solved one by one."""

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.core.arrays import Reals
from dmplay.errors import BadPolicy
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.registry.agents import load_roster
from dmplay.solvers.games import best_response_dynamics, shapley, zero_sum
from dmplay.solvers.games.shapley import solve_zero_sum
from dmplay.solvers.mdp import transition_graph
from tests.support.random_problems import RandomGame, RandomRivalGame, with_two_or_ten_seeds
from tests.support.soccer import Soccer


def backup_values(problem: RandomRivalGame, values: Reals) -> Reals:
    """Return the values of games that are one turn longer, state by state."""
    longer_values = np.zeros(5)
    for s in np.flatnonzero(~problem.terminal(np.arange(5))):
        q = problem.rewards[s, :, 0] + problem.discount * problem.transition[s] @ values
        legal_actions = np.ix_(*map(np.flatnonzero, problem.legal_mask[s]))
        (longer_values[s],) = zero_sum.solve_matrix_games(
            q.reshape(3, 3)[legal_actions][None]
        ).values
    return longer_values


@with_two_or_ten_seeds
def test_random_games_have_the_values_of_iterated_matrix_games(seeds: range) -> None:
    for seed in seeds:
        problem = RandomRivalGame(seed=seed, ends=seed % 2 == 0, discount=0.3)
        values = np.zeros(5)
        for _ in range(16):
            values = backup_values(problem, values)
        result = solve_zero_sum(problem, None)
        expected = values[result.graph.states]
        np.testing.assert_allclose(result.values_by_turns_left[-1], expected, atol=1e-8)
        assert result.gap < 1e-8
        assert result.loss_ratio == pytest.approx(2.0)
        agents = [load_agent(problem, seat, "optimal") for seat in range(2)]
        returns = rollout(problem, agents, episodes=200, seed=seed, turn_limit=12).returns[:, 0]
        assert abs(returns.mean() - values[0]) < 3 * returns.std(ddof=1) / 200**0.5 + 1e-5


def test_bounds_are_valid_if_the_work_limit_is_reached(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = RandomRivalGame(seed=10, ends=False)
    exact = solve_zero_sum(problem, None).values_by_turns_left[-1]
    monkeypatch.setattr(shapley, "WORK_LIMIT", 1.2e7)  # enough for five turns
    result = solve_zero_sum(problem, None)
    assert 1e-5 < result.gap < 1e-3
    assert np.abs(result.values_by_turns_left[-1] - exact).max() <= result.gap / 2


def test_the_turn_limit_determines_the_value() -> None:
    for seed in range(4):
        problem = RandomRivalGame(seed=seed, turns=4, discount=1.0)
        values = np.zeros(5)
        for _ in range(4):
            values = backup_values(problem, values)
        expected = f"value {values[0]:.6g} for one, "
        assert solve_problem(problem).result.startswith(expected)
        with use_solve_options(SolveOptions(turns=4)):
            assert solve_problem(
                RandomRivalGame(seed=seed, turns=9, discount=1.0)
            ).result.startswith(expected)
        optimal = load_agent(problem, 1, "optimal")
        q = optimal.action_values(optimal.initial_memory(np.zeros(1, int)))
        assert q is not None
        assert q[0][problem.legal_mask[0, 1]].max() == pytest.approx(-2 * values[0], abs=1e-7)


@pytest.mark.slow
def test_soccer_is_symmetric_and_the_optimal_policies_secure_its_value() -> None:
    field = Soccer()
    result = solve_zero_sum(field, None)
    assert len(result.graph.states) == 760  # as in the paper, without the states after a goal
    assert result.gap < 1e-8
    start_values = result.values_by_turns_left[-1][
        result.graph.find_state_indices(field, field.initial_states(2, (np.array([0, 1]),)))
    ]
    np.testing.assert_allclose(start_values, [0.21848, -0.21848], atol=1e-5)
    agents = [load_agent(field, seat, "optimal") for seat in range(2)]
    for seat, opponent in ((0, "optimal"), (1, "random")):
        pair = list(agents)
        pair[1 - seat] = load_agent(field, 1 - seat, opponent)
        returns = rollout(field, pair, episodes=100, turn_limit=30).returns[:, seat]
        error = returns.std(ddof=1) / 100**0.5
        assert abs(returns.mean()) < 3 * error if opponent == "optimal" else returns.mean() > 0.3
    report = solve_problem(field)
    assert report.method == "Shapley's iteration over 760 states, infinite horizon"
    assert report.result.startswith("value 0 for left, 0 for right at the start, error at most ")


def test_no_best_response_gains_against_the_solution() -> None:
    for seed in range(4):
        problem = RandomRivalGame(seed=seed, discount=0.8)
        explored = transition_graph.build_reachable_graph(problem)
        result = shapley.run_shapley_iteration(problem, explored, None)
        strategies = result.solve_stage_games(
            explored.nonterminal_states,
            result.build_stage_games(explored.nonterminal_states, 0.8, None),
        )
        policies = [np.zeros((len(explored.states), 3)) for _ in range(2)]
        for seat in range(2):
            policies[seat][explored.nonterminal_states] = strategies[1 + seat]
            policies[seat][np.diff(explored.action_starts) == 0, 0] = 1.0
        gains = best_response_dynamics.evaluate_policies(problem, explored, policies).regrets
        assert gains.max() < 1e-6


def test_games_that_are_not_zero_sum_are_rejected() -> None:
    assert [*load_roster(RandomGame()).agents] == ["equilibrium", "random", "search"]
    assert [*load_roster(RandomRivalGame()).agents] == [
        "optimal",
        "equilibrium",
        "random",
        "search",
    ]
    assert [*load_roster(RandomRivalGame(discount=1.0)).agents] == ["random", "search"]
    explored = transition_graph.build_reachable_graph(RandomGame())
    with pytest.raises(BadPolicy, match="got rewards that are not opposed"):
        shapley.run_shapley_iteration(RandomGame(), explored, None)
    with pytest.raises(
        BadPolicy, match="expected a discount below 1, or a turn limit \\(--turns N"
    ):
        shapley.run_shapley_iteration(RandomRivalGame(discount=1.0), explored, None)
