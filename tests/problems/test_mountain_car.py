from functools import cache

import numpy as np
import pytest

import dmplay
from dmplay.core.trigonometry import compute_cosine_of_triple
from tests.truth_cases.deterministic_trajectory import iterate_game, iterate_games

LEFT, COAST, RIGHT = range(3)
PROBLEM = dmplay.load_problem("mountain-car")
GYM_PROBLEM = dmplay.load_problem("mountain-car:gym")


def step_state(game: dmplay.Problem, state: list[float], a: int) -> tuple[list[float], float]:
    outcome = game.step(np.array([state]), np.array([[a]]), np.zeros((1, 0)))
    return outcome.state[0].tolist(), float(outcome.rewards[0, 0])


def test_the_left_wall_keeps_the_speed_except_in_gymnasium() -> None:
    (x, v), _ = step_state(PROBLEM, [-1.2, -0.07], LEFT)
    assert x == -1.2
    assert v == pytest.approx(-0.0687581)
    assert step_state(GYM_PROBLEM, [-1.2, -0.07], LEFT)[0] == [-1.2, 0.0]


def test_a_car_can_leave_the_left_wall() -> None:
    for game in (PROBLEM, GYM_PROBLEM):
        (x, v), _ = step_state(game, [-1.2, 0.0], LEFT)  # the slope is stronger than the engine
        assert x > -1.2
        assert v > 0


def test_the_position_changes_by_the_unclamped_speed_except_in_gymnasium() -> None:
    assert step_state(PROBLEM, [-0.9, 0.07], RIGHT)[0] == pytest.approx([-0.826739820, 0.07])
    assert step_state(GYM_PROBLEM, [-0.9, 0.07], RIGHT)[0] == pytest.approx([-0.83, 0.07])


def test_the_goal_is_reached_when_the_position_is_clamped_to_it() -> None:
    next_state, reward = step_state(PROBLEM, [0.58, 0.05], RIGHT)
    assert next_state == pytest.approx([0.6, 0.05142099])
    assert reward == -1
    assert PROBLEM.terminal(np.array([next_state]))[0]
    assert step_state(PROBLEM, next_state, LEFT) == (next_state, 0.0)


def test_the_goal_of_gymnasium_is_lower_and_requires_a_nonnegative_speed() -> None:
    states = np.array([[0.5, 0.0], [0.5, -0.001], [0.499, 0.07], [0.6, 0.01]])
    assert GYM_PROBLEM.terminal(states).tolist() == [True, False, False, True]
    assert PROBLEM.terminal(states).tolist() == [False, False, False, True]


@pytest.mark.parametrize(("still", "steps"), [("coast", 218), ("left", 217), ("right", 126)])
def test_the_turns_of_pumping_depend_on_its_first_push(still: str, steps: int) -> None:
    pump = dmplay.load_agent(PROBLEM, 0, f"pump:still={still}")
    turns = list(iterate_game(PROBLEM, pump, [-0.5, 0.0], 500))
    assert len(turns) == steps
    assert sum(reward for _, reward in turns) == -steps


def test_pumping_reaches_the_goal_of_gymnasium_within_200_turns() -> None:
    result = dmplay.rollout(GYM_PROBLEM, [dmplay.load_agent(GYM_PROBLEM, 0, "pump")], episodes=500)
    assert result.terminated.all()
    assert (result.total_rewards[:, 0] == -result.turn_counts).all()


@cache
def make_optimal_agent(game: dmplay.Problem) -> dmplay.Policy:
    return dmplay.load_agent(game, 0, "optimal")


# the fewest known number of turns, by start position
FEWEST_TURNS = {-0.5: 106, -0.4: 86, 0.0: 78, -1.2: 41}


def test_the_optimal_agent_takes_the_fewest_turns_known() -> None:
    agent, starts = make_optimal_agent(PROBLEM), [[start, 0.0] for start in FEWEST_TURNS]
    turns = -np.sum([rewards for _, rewards in iterate_games(PROBLEM, agent, starts, 500)], axis=0)
    values = agent.action_values(agent.initial_memory(np.array(starts)))
    assert values is not None
    for fewest, turn_count, value in zip(
        FEWEST_TURNS.values(), turns, values.max(axis=1), strict=True
    ):
        assert fewest <= turn_count <= fewest + 1
        assert -value == pytest.approx(fewest, abs=8)


def test_a_strong_discount_does_not_change_the_optimal_path() -> None:
    discounted = dmplay.load_problem("mountain-car", discount=0.9)
    assert (
        len(
            list(
                iterate_game(
                    discounted, dmplay.load_agent(discounted, 0, "optimal"), [-0.5, 0.0], 500
                )
            )
        )
        == 106
    )


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("game", [PROBLEM, GYM_PROBLEM])
def test_the_optimal_agent_reaches_the_goal_no_later_than_pump(game: dmplay.Problem) -> None:
    optimal_result, pump_result = (
        dmplay.rollout(game, [agent], episodes=40)
        for agent in (make_optimal_agent(game), dmplay.load_agent(game, 0, "pump"))
    )
    assert optimal_result.terminated.all()
    assert (optimal_result.turn_counts <= pump_result.turn_counts).all()
    assert optimal_result.turn_counts.mean() < 0.9 * pump_result.turn_counts.mean()


def test_the_engine_alone_is_too_weak() -> None:
    right = dmplay.load_agent(PROBLEM, 0, "always-right")
    assert max(s[0] for s, _ in iterate_game(PROBLEM, right, [-0.5, 0.0], 1000)) < 0.0


def test_a_game_starts_anywhere_but_in_the_valley_in_gymnasium() -> None:
    u = np.array([[0.0, 0.0], [0.5, 0.5], [0.999999999, 0.999999999]])
    assert PROBLEM.sample_initial_states(u) == pytest.approx(
        np.array([[-1.2, -0.07], [-0.3, 0.0], [0.6, 0.07]])
    )
    assert GYM_PROBLEM.sample_initial_states(u) == pytest.approx(
        np.array([[-0.6, 0.0], [-0.5, 0.0], [-0.4, 0.0]])
    )
    assert (PROBLEM.horizon, GYM_PROBLEM.horizon) == (None, 200)


def test_actions_have_driving_terms_as_aliases() -> None:
    actions = [
        PROBLEM.parse_action(0, word) for word in ("reverse", "-", "forward", "Left", "coast")
    ]
    assert actions == [LEFT, COAST, RIGHT, LEFT, COAST]


def test_a_formatted_state_is_parsed_back_bit_for_bit() -> None:
    s = PROBLEM.sample_initial_states(np.array([[0.123456789, 0.987654321]]))[0]
    assert (PROBLEM.parse_state(PROBLEM.format_state(s)) == s).all()


def test_the_slope_matches_the_cosine_of_numpy_to_the_last_bits() -> None:
    x = np.linspace(-1.2, 0.6, 10_001)
    assert np.abs(compute_cosine_of_triple(x) - np.cos(3 * x)).max() < 2e-15
