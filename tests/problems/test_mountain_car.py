from functools import cache

import numpy as np
import pytest

import dmplay
from dmplay.problems._trigonometry import compute_cosine_of_triple
from tests.truth_kinds.course import course, courses

LEFT, COAST, RIGHT = range(3)
PROBLEM = dmplay.load_problem("mountain-car")
GYM = dmplay.load_problem("mountain-car:gym")


def stepped(game: dmplay.Problem, state: list[float], a: int) -> tuple[list[float], float]:
    after = game.step(np.array([state]), np.array([[a]]), np.zeros((1, 0)))
    return after.state[0].tolist(), float(after.rewards[0, 0])


def test_the_left_wall_keeps_the_speed_and_gymnasiums_takes_it() -> None:
    (x, v), _ = stepped(PROBLEM, [-1.2, -0.07], LEFT)
    assert x == -1.2
    assert v == pytest.approx(-0.0687581)
    assert stepped(GYM, [-1.2, -0.07], LEFT)[0] == [-1.2, 0.0]


def test_the_wall_does_not_hold_a_car_that_drives_off() -> None:
    for game in (PROBLEM, GYM):
        (x, v), _ = stepped(game, [-1.2, 0.0], LEFT)  # the slope is stronger than the engine
        assert x > -1.2
        assert v > 0


def test_the_place_moves_by_the_speed_before_that_is_clamped() -> None:
    assert stepped(PROBLEM, [-0.9, 0.07], RIGHT)[0] == pytest.approx([-0.826739820, 0.07])
    assert stepped(GYM, [-0.9, 0.07], RIGHT)[0] == pytest.approx([-0.83, 0.07])


def test_the_goal_is_reached_when_the_place_is_clamped_to_it() -> None:
    after, reward = stepped(PROBLEM, [0.58, 0.05], RIGHT)
    assert after == pytest.approx([0.6, 0.05142099])
    assert reward == -1
    assert PROBLEM.terminal(np.array([after]))[0]
    assert stepped(PROBLEM, after, LEFT) == (after, 0.0)


def test_gymnasiums_goal_is_lower_and_needs_a_car_that_goes_up() -> None:
    states = np.array([[0.5, 0.0], [0.5, -0.001], [0.499, 0.07], [0.6, 0.01]])
    assert GYM.terminal(states).tolist() == [True, False, False, True]
    assert PROBLEM.terminal(states).tolist() == [False, False, False, True]


@pytest.mark.parametrize(("still", "steps"), [("coast", 218), ("left", 217), ("right", 126)])
def test_pumping_takes_as_long_as_its_first_push_says(still: str, steps: int) -> None:
    pump = dmplay.load_agent(PROBLEM, 0, f"pump:still={still}")
    turns = list(course(PROBLEM, pump, [-0.5, 0.0], 500))
    assert len(turns) == steps
    assert sum(pay for _, pay in turns) == -steps


def test_pumping_reaches_gymnasiums_goal_in_its_200_turns() -> None:
    played = dmplay.rollout(GYM, [dmplay.load_agent(GYM, 0, "pump")], episodes=500)
    assert played.terminated.all()
    assert (played.total_rewards[:, 0] == -played.turn_counts).all()


@cache
def optimal(game: dmplay.Problem) -> dmplay.Policy:
    return dmplay.load_agent(game, 0, "optimal")


FEWEST = {-0.5: 106, -0.4: 86, 0.0: 78, -1.2: 41}  # turns known, by where the car stands


def test_the_optimal_agent_takes_the_fewest_turns_known() -> None:
    agent, starts = optimal(PROBLEM), [[start, 0.0] for start in FEWEST]
    turns = -np.sum([paid for _, paid in courses(PROBLEM, agent, starts, 500)], axis=0)
    values = agent.action_values(agent.initial_memory(np.array(starts)))
    assert values is not None
    for fewest, taken, worth in zip(FEWEST.values(), turns, values.max(axis=1), strict=True):
        assert fewest <= taken <= fewest + 1
        assert -worth == pytest.approx(fewest, abs=8)


def test_a_discount_to_which_the_goal_is_faint_changes_no_turn() -> None:
    near = dmplay.load_problem("mountain-car", discount=0.9)
    assert len(list(course(near, dmplay.load_agent(near, 0, "optimal"), [-0.5, 0.0], 500))) == 106


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize("game", [PROBLEM, GYM])
def test_the_optimal_agent_comes_there_from_anywhere_before_one_who_pumps(
    game: dmplay.Problem,
) -> None:
    best, pump = (
        dmplay.rollout(game, [agent], episodes=40)
        for agent in (optimal(game), dmplay.load_agent(game, 0, "pump"))
    )
    assert best.terminated.all()
    assert (best.turn_counts <= pump.turn_counts).all()
    assert best.turn_counts.mean() < 0.9 * pump.turn_counts.mean()


def test_the_engine_alone_is_too_weak() -> None:
    right = dmplay.load_agent(PROBLEM, 0, "always-right")
    assert max(s[0] for s, _ in course(PROBLEM, right, [-0.5, 0.0], 1000)) < 0.0


def test_a_game_starts_anywhere_and_gymnasiums_in_the_valley() -> None:
    u = np.array([[0.0, 0.0], [0.5, 0.5], [0.999999999, 0.999999999]])
    assert PROBLEM.sample_initial_states(u) == pytest.approx(
        np.array([[-1.2, -0.07], [-0.3, 0.0], [0.6, 0.07]])
    )
    assert GYM.sample_initial_states(u) == pytest.approx(
        np.array([[-0.6, 0.0], [-0.5, 0.0], [-0.4, 0.0]])
    )
    assert (PROBLEM.horizon, GYM.horizon) == (None, 200)


def test_actions_have_the_names_of_a_driver_too() -> None:
    named = [PROBLEM.parse_action(0, word) for word in ("reverse", "-", "forward", "Left", "coast")]
    assert named == [LEFT, COAST, RIGHT, LEFT, COAST]


def test_a_state_is_read_back_to_the_last_bit() -> None:
    s = PROBLEM.sample_initial_states(np.array([[0.123456789, 0.987654321]]))[0]
    assert (PROBLEM.parse_state(PROBLEM.format_state(s)) == s).all()


def test_the_slope_is_the_librarys_cosine_to_the_last_bits() -> None:
    x = np.linspace(-1.2, 0.6, 10_001)
    assert np.abs(compute_cosine_of_triple(x) - np.cos(3 * x)).max() < 2e-15
