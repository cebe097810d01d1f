import numpy as np
import pytest

import dmplay
from dmplay.core.session import Session
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.collision_avoidance.agents import Optimal
from dmplay.problems.collision_avoidance.rules import ADVISED_RATES

DESCEND, NO_ADVISORY, CLIMB = range(3)
PRINTED_PROBLEM = dmplay.load_problem("collision-avoidance")
REPAIRED_PROBLEM = dmplay.load_problem("collision-avoidance", repaired=True)
NO_GUST = 0.5  # the uniform of a turn without a gust


def step_state(
    state: list[float], a: int, game: dmplay.Problem = PRINTED_PROBLEM, u: float = NO_GUST
) -> tuple[list[float], float]:
    outcome = game.step(np.array([state]), np.array([[a]]), np.array([[u]]))
    return outcome.state[0].tolist(), float(outcome.rewards[0, 0])


def test_an_advisory_turns_the_rate_by_one() -> None:
    assert step_state([100, 2, 0, 20], CLIMB) == ([102, 3, 5, 19], -0.01)
    assert step_state([100, 2, 5, 19], CLIMB) == ([102, 3, 5, 18], 0)
    assert step_state([100, 2, 0, 20], DESCEND) == ([102, 1, -5, 19], -0.01)


def test_a_rate_close_to_the_advised_one_overshoots_as_printed() -> None:
    assert step_state([0, 4.5, 5, 20], CLIMB)[0] == [4.5, 9.5, 5, 19]
    assert step_state([0, -5.5, -5, 20], DESCEND)[0] == [-5.5, -10.5, -5, 19]


def test_the_repaired_branch_levels_off_at_the_advised_rate() -> None:
    assert step_state([0, 4.5, 5, 20], CLIMB, REPAIRED_PROBLEM)[0] == [4.5, 5, 5, 19]
    assert step_state([0, -5.5, -5, 20], DESCEND, REPAIRED_PROBLEM)[0] == [-5.5, -5, -5, 19]


def test_a_rate_one_away_is_not_close() -> None:
    assert step_state([0, 4, 5, 20], CLIMB)[0] == [4, 5, 5, 19]
    assert step_state([0, 6, 5, 20], CLIMB)[0] == [6, 5, 5, 19]


def test_every_change_of_an_advisory_costs_once_reversals_included() -> None:
    state, rewards = [-60.0, 0.0, 0.0, 4.0], []
    for a in (DESCEND, DESCEND, CLIMB, NO_ADVISORY):
        state, reward = step_state(state, a)
        rewards.append(reward)
    assert rewards == [-0.01, 0, -0.01, -0.01]
    assert state == [-64, -1, 0, 0]


@pytest.mark.parametrize(("u", "gust"), [(0.0, -2), (0.25, 0), (0.749, 0), (0.75, 2)])
def test_gusts_have_probabilities_of_a_quarter_a_half_and_a_quarter(u: float, gust: int) -> None:
    assert step_state([0, 1, 0, 20], NO_ADVISORY, u=u)[0] == [1, 1 + gust, 0, 19]


def test_passing_within_50_m_costs_1_in_the_turn_at_time_0() -> None:
    assert step_state([49.9, 0, 0, 0], NO_ADVISORY)[1] == -1
    assert step_state([-49.9, 0, 0, 0], CLIMB)[1] == -1.01
    assert step_state([50, 0, 0, 0], NO_ADVISORY)[1] == 0
    assert step_state([0, 0, 0, 1], NO_ADVISORY)[1] == 0


def test_after_time_0_nothing_moves_and_nothing_is_paid() -> None:
    final_state, _ = step_state([0, 3, 5, 0], CLIMB)
    assert PRINTED_PROBLEM.terminal(np.array([final_state]))[0]
    assert step_state(final_state, DESCEND) == (final_state, 0)


def test_a_game_is_41_actions_long() -> None:
    game = Session(
        PRINTED_PROBLEM, dmplay.SeededUniforms(7), [dmplay.load_agent(PRINTED_PROBLEM, 0, "simple")]
    )
    while not game.over:
        game.advance()
    assert len(game.turns) == 41
    assert game.end_reason == "terminal"


def test_simple_acts_only_near_in_height_and_in_time() -> None:
    policy = dmplay.load_agent(PRINTED_PROBLEM, 0, "simple")
    s = np.array(
        [[49, 0, 0, 29], [-49, 0, 0, 29], [0, 0, 0, 29], [50, 0, 0, 29], [49, 0, 0, 30]], float
    )
    chosen = policy.choose(policy.initial_memory(s), None, np.zeros((5, 0)))
    assert chosen.tolist() == [CLIMB, DESCEND, DESCEND, NO_ADVISORY, NO_ADVISORY]


def test_actions_are_also_named_by_their_rates() -> None:
    actions = [
        PRINTED_PROBLEM.parse_action(0, word)
        for word in ("-5", "0", "none", "5", "no_advisory", "Climb")
    ]
    assert actions == [DESCEND, NO_ADVISORY, NO_ADVISORY, CLIMB, NO_ADVISORY, CLIMB]


def test_a_formatted_state_is_parsed_back_bit_for_bit() -> None:
    s = PRINTED_PROBLEM.sample_initial_states(np.array([[0.123456789, 0.987654321]]))[0]
    assert (PRINTED_PROBLEM.parse_state(PRINTED_PROBLEM.format_state(s)) == s).all()
    assert s[2:].tolist() == [0, 40]


def test_the_optimal_agent_alerts_late_and_hardly_ever_collides() -> None:
    optimal, simple = (
        dmplay.rollout(
            PRINTED_PROBLEM, [dmplay.load_agent(PRINTED_PROBLEM, 0, name)], episodes=5000
        )
        for name in ("optimal", "simple")
    )
    assert optimal.total_rewards.mean() > -0.006
    assert simple.total_rewards.mean() < -0.05
    policy = dmplay.load_agent(PRINTED_PROBLEM, 0, "optimal")
    head_on = np.array([[0, 0, 0, 40], [0, 0, 0, 10], [40, 0, 0, 15]], float)
    chosen = policy.choose(policy.initial_memory(head_on), None, np.zeros((3, 0)))
    # At equal height both directions have the same value, and the first is to descend.
    assert chosen.tolist() == [NO_ADVISORY, DESCEND, CLIMB]


def test_a_collision_is_discounted_by_the_seconds_before_it() -> None:
    q = collision_avoidance_grid.compute_optimal_q(
        dmplay.load_problem("collision-avoidance", discount=0.5)
    )
    level = q[:3, 1, 10, 10, NO_ADVISORY]  # at the intruder's height, without an advisory
    assert level.tolist() == [-1, -0.5, -0.25]


def test_the_values_of_a_batch_equal_those_of_single_encounters() -> None:
    policy = Optimal(PRINTED_PROBLEM, 0)
    rng = np.random.default_rng(5)
    heights, times = rng.uniform(-250, 250, (30, 1)), rng.integers(0, 45, (30, 1))
    s = np.hstack([heights, heights / 20, rng.choice(ADVISED_RATES, (30, 1)), times])
    single_values = [policy.action_values((state[None],)) for state in s]
    assert (policy.action_values((s,)) == np.concatenate(single_values)).all()
    grid = collision_avoidance_grid.make_grid_states(7)
    q = collision_avoidance_grid.compute_optimal_q(PRINTED_PROBLEM)[7].reshape(len(grid), -1)
    assert (policy.action_values((grid,)) == q).all()
