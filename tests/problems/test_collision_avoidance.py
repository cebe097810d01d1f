import numpy as np
import pytest

import dmplay
from dmplay.policies.collision_avoidance import Optimal
from dmplay.problems.collision_avoidance import ADVISED_RATES
from dmplay.session import Session
from dmplay.solvers import collision_grid

DESCEND, NO_ADVISORY, CLIMB = range(3)
LITERAL = dmplay.load_problem("collision-avoidance")
REPAIRED = dmplay.load_problem("collision-avoidance", repaired=True)
CALM = 0.5  # of the draws, the one without a gust


def stepped(
    state: list[float], a: int, game: dmplay.Problem = LITERAL, u: float = CALM
) -> tuple[list[float], float]:
    after = game.step(np.array([state]), np.array([[a]]), np.array([[u]]))
    return after.state[0].tolist(), float(after.rewards[0, 0])


def test_an_advisory_turns_the_rate_by_one() -> None:
    assert stepped([100, 2, 0, 20], CLIMB) == ([102, 3, 5, 19], -0.01)
    assert stepped([100, 2, 5, 19], CLIMB) == ([102, 3, 5, 18], 0)
    assert stepped([100, 2, 0, 20], DESCEND) == ([102, 1, -5, 19], -0.01)


def test_a_rate_close_to_the_advised_one_overshoots_as_printed() -> None:
    assert stepped([0, 4.5, 5, 20], CLIMB)[0] == [4.5, 9.5, 5, 19]
    assert stepped([0, -5.5, -5, 20], DESCEND)[0] == [-5.5, -10.5, -5, 19]


def test_the_repaired_branch_levels_off_at_the_advised_rate() -> None:
    assert stepped([0, 4.5, 5, 20], CLIMB, REPAIRED)[0] == [4.5, 5, 5, 19]
    assert stepped([0, -5.5, -5, 20], DESCEND, REPAIRED)[0] == [-5.5, -5, -5, 19]


def test_a_rate_one_away_is_not_close() -> None:
    assert stepped([0, 4, 5, 20], CLIMB)[0] == [4, 5, 5, 19]
    assert stepped([0, 6, 5, 20], CLIMB)[0] == [6, 5, 5, 19]


def test_every_change_of_an_advisory_is_paid_for_its_reversal_once() -> None:
    state, paid = [-60.0, 0.0, 0.0, 4.0], []
    for a in (DESCEND, DESCEND, CLIMB, NO_ADVISORY):
        state, reward = stepped(state, a)
        paid.append(reward)
    assert paid == [-0.01, 0, -0.01, -0.01]
    assert state == [-64, -1, 0, 0]


@pytest.mark.parametrize(("u", "gust"), [(0.0, -2), (0.25, 0), (0.749, 0), (0.75, 2)])
def test_gusts_come_a_quarter_a_half_and_a_quarter_of_the_time(u: float, gust: int) -> None:
    assert stepped([0, 1, 0, 20], NO_ADVISORY, u=u)[0] == [1, 1 + gust, 0, 19]


def test_passing_within_50_m_is_paid_for_in_the_turn_at_time_0() -> None:
    assert stepped([49.9, 0, 0, 0], NO_ADVISORY)[1] == -1
    assert stepped([-49.9, 0, 0, 0], CLIMB)[1] == -1.01
    assert stepped([50, 0, 0, 0], NO_ADVISORY)[1] == 0
    assert stepped([0, 0, 0, 1], NO_ADVISORY)[1] == 0


def test_after_time_0_nothing_moves_and_nothing_is_paid() -> None:
    after, _ = stepped([0, 3, 5, 0], CLIMB)
    assert LITERAL.terminal(np.array([after]))[0]
    assert stepped(after, DESCEND) == (after, 0)


def test_a_game_is_41_actions_long() -> None:
    game = Session(LITERAL, dmplay.SeededUniforms(7), [dmplay.load_agent(LITERAL, 0, "simple")])
    while not game.over:
        game.advance()
    assert len(game.turns) == 41
    assert game.end_reason == "terminal"


def test_simple_acts_only_near_in_height_and_in_time() -> None:
    policy = dmplay.load_agent(LITERAL, 0, "simple")
    s = np.array(
        [[49, 0, 0, 29], [-49, 0, 0, 29], [0, 0, 0, 29], [50, 0, 0, 29], [49, 0, 0, 30]], float
    )
    chosen = policy.choose(policy.initial_memory(s), None, np.zeros((5, 0)))
    assert chosen.tolist() == [CLIMB, DESCEND, DESCEND, NO_ADVISORY, NO_ADVISORY]


def test_actions_are_named_by_their_rates_too() -> None:
    named = [
        LITERAL.parse_action(0, word) for word in ("-5", "0", "none", "5", "no_advisory", "Climb")
    ]
    assert named == [DESCEND, NO_ADVISORY, NO_ADVISORY, CLIMB, NO_ADVISORY, CLIMB]


def test_a_state_is_read_back_to_the_last_bit() -> None:
    s = LITERAL.sample_initial_states(np.array([[0.123456789, 0.987654321]]))[0]
    assert (LITERAL.parse_state(LITERAL.format_state(s)) == s).all()
    assert s[2:].tolist() == [0, 40]


def test_the_optimal_agent_alerts_late_and_hardly_ever_collides() -> None:
    optimal, simple = (
        dmplay.rollout(LITERAL, [dmplay.load_agent(LITERAL, 0, name)], episodes=5000)
        for name in ("optimal", "simple")
    )
    assert optimal.total_rewards.mean() > -0.006
    assert simple.total_rewards.mean() < -0.05
    policy = dmplay.load_agent(LITERAL, 0, "optimal")
    head_on = np.array([[0, 0, 0, 40], [0, 0, 0, 10], [40, 0, 0, 15]], float)
    chosen = policy.choose(policy.initial_memory(head_on), None, np.zeros((3, 0)))
    # At the same height both ways out are worth the same: the first is to descend.
    assert chosen.tolist() == [NO_ADVISORY, DESCEND, CLIMB]


def test_a_collision_is_discounted_by_the_seconds_before_it() -> None:
    q = collision_grid.compute_optimal_q(dmplay.load_problem("collision-avoidance", discount=0.5))
    level = q[:3, 1, 10, 10, NO_ADVISORY]  # at the intruder's height, without an advisory
    assert level.tolist() == [-1, -0.5, -0.25]


def test_encounters_at_different_times_are_worth_what_each_is_alone() -> None:
    policy = Optimal(LITERAL, 0)
    rng = np.random.default_rng(5)
    far, late = rng.uniform(-250, 250, (30, 1)), rng.integers(0, 45, (30, 1))
    s = np.hstack([far, far / 20, rng.choice(ADVISED_RATES, (30, 1)), late])
    alone = [policy.action_values((one[None],)) for one in s]
    assert (policy.action_values((s,)) == np.concatenate(alone)).all()
    grid = collision_grid.make_grid_states(7)
    q = collision_grid.compute_optimal_q(LITERAL)[7].reshape(len(grid), -1)
    assert (policy.action_values((grid,)) == q).all()
