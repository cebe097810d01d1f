"""Markov games of two who are opposed, against matrix games solved one by one."""

import numpy as np
import pytest

from dmplay import load_agent, rollout
from dmplay.chance import Reals
from dmplay.errors import BadPolicy
from dmplay.finding.agents import load_roster
from dmplay.policies import seeing
from dmplay.solutions.every import solve_problem
from dmplay.solutions.played import SimulationOptions, use_simulation_options
from dmplay.solvers import best_replies, graph, shapley, zero_sum
from tests.support.drawn import Pair, Rivals, some_and_ten
from tests.support.soccer import Soccer


def turn(problem: Rivals, values: Reals) -> Reals:
    """What games are worth that are a turn longer, state by state."""
    after = np.zeros(5)
    for s in np.flatnonzero(~problem.terminal(np.arange(5))):
        q = problem.rewards[s, :, 0] + problem.discount * problem.transition[s] @ values
        legal = np.ix_(*map(np.flatnonzero, problem.able[s]))
        (after[s],) = zero_sum.solve_matrix_games(q.reshape(3, 3)[legal][None]).values
    return after


@some_and_ten
def test_drawn_games_are_worth_what_their_matrix_games_are(seeds: range) -> None:
    for seed in seeds:
        problem = Rivals(seed=seed, ends=seed % 2 == 0, discount=0.3)
        values = np.zeros(5)
        for _ in range(16):
            values = turn(problem, values)
        found = seeing.solve_zero_sum(problem, None)
        wanted = values[found.graph.states]
        np.testing.assert_allclose(found.values_by_turns_left[-1], wanted, atol=1e-8)
        assert found.gap < 1e-8
        assert found.loss_ratio == pytest.approx(2.0)
        seated = [load_agent(problem, seat, "optimal") for seat in range(2)]
        returns = rollout(problem, seated, episodes=200, seed=seed, turn_limit=12).returns[:, 0]
        assert abs(returns.mean() - values[0]) < 3 * returns.std(ddof=1) / 200**0.5 + 1e-5


def test_a_game_for_which_the_work_does_not_suffice_is_worth_what_lies_between_its_bounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = Rivals(seed=10, ends=False)
    exact = seeing.solve_zero_sum(problem, None).values_by_turns_left[-1]
    monkeypatch.setattr(shapley, "WORK_LIMIT", 1.2e7)  # five turns
    found = seeing.solve_zero_sum(problem, None)
    assert 1e-5 < found.gap < 1e-3
    assert np.abs(found.values_by_turns_left[-1] - exact).max() <= found.gap / 2


def test_a_game_of_some_turns_is_worth_so_many() -> None:
    for seed in range(4):
        problem = Rivals(seed=seed, turns=4, discount=1.0)
        values = np.zeros(5)
        for _ in range(4):
            values = turn(problem, values)
        wanted = f"value {values[0]:.6g} to one, "
        assert solve_problem(problem).result.startswith(wanted)
        with use_simulation_options(SimulationOptions(turns=4)):
            assert solve_problem(Rivals(seed=seed, turns=9, discount=1.0)).result.startswith(wanted)
        first = load_agent(problem, 1, "optimal")
        q = first.action_values(first.initial_memory(np.zeros(1, int)))
        assert q is not None
        assert q[0][problem.able[0, 1]].max() == pytest.approx(-2 * values[0], abs=1e-7)


@pytest.mark.slow
def test_soccer_is_worth_the_same_to_both_and_what_they_play_secures_it() -> None:
    field = Soccer()
    found = seeing.solve_zero_sum(field, None)
    assert len(found.graph.states) == 760  # as in the paper, without those of a goal
    assert found.gap < 1e-8
    start = found.values_by_turns_left[-1][
        found.graph.find_state_indices(field, field.initial_states(2, (np.array([0, 1]),)))
    ]
    np.testing.assert_allclose(start, [0.21848, -0.21848], atol=1e-5)
    seated = [load_agent(field, seat, "optimal") for seat in range(2)]
    for seat, other in ((0, "optimal"), (1, "random")):
        pair = list(seated)
        pair[1 - seat] = load_agent(field, 1 - seat, other)
        returns = rollout(field, pair, episodes=100, turn_limit=30).returns[:, seat]
        error = returns.std(ddof=1) / 100**0.5
        assert abs(returns.mean()) < 3 * error if other == "optimal" else returns.mean() > 0.3
    told = solve_problem(field)
    assert told.method == "Shapley's iteration over 760 states, without end"
    assert told.result.startswith("value 0 to left, 0 to right at the start, at most ")


def test_by_the_best_reply_to_it_nobody_gains() -> None:
    for seed in range(4):
        problem = Rivals(seed=seed, discount=0.8)
        drawn = graph.build_reachable_graph(problem)
        found = shapley.run_shapley_iteration(problem, drawn, None)
        both = found.solve_stage_games(
            drawn.nonterminal_states, found.build_stage_games(drawn.nonterminal_states, 0.8, None)
        )
        play = [np.zeros((len(drawn.states), 3)) for _ in range(2)]
        for seat in range(2):
            play[seat][drawn.nonterminal_states] = both[1 + seat]
            play[seat][np.diff(drawn.action_starts) == 0, 0] = 1.0
        gains = best_replies.evaluate_policies(problem, drawn, play).regrets
        assert gains.max() < 1e-6


def test_those_who_are_not_opposed_are_refused() -> None:
    assert [*load_roster(Pair()).agents] == ["equilibrium", "random", "search"]
    assert [*load_roster(Rivals()).agents] == ["optimal", "equilibrium", "random", "search"]
    assert [*load_roster(Rivals(discount=1.0)).agents] == ["random", "search"]
    drawn = graph.build_reachable_graph(Pair())
    with pytest.raises(BadPolicy, match="got rewards that are not opposed"):
        shapley.run_shapley_iteration(Pair(), drawn, None)
    with pytest.raises(BadPolicy, match="expected a discount below 1, or a last turn: --turns N"):
        shapley.run_shapley_iteration(Rivals(discount=1.0), drawn, None)
