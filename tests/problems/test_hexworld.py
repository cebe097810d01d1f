import numpy as np
import pytest

import dmplay
from dmplay import SeededUniforms, Session
from dmplay.hexes import DIRECTIONS

PROBLEM = dmplay.load_problem("hexworld")


def walked(draw: float, action: str, at: tuple[int, int]) -> tuple[str, float]:
    """Where an action leads from a hex by one draw of nature, and what it pays."""
    hexes = PROBLEM.hexes  # type: ignore[attr-defined]
    state = np.array([hexes.index(at)])
    outcome = PROBLEM.step(state, np.array([[DIRECTIONS.index(action)]]), np.array([[draw]]))
    return PROBLEM.format_state(outcome.state[0]), float(outcome.rewards[0, 0])


def test_a_step_goes_where_it_is_aimed_in_seven_of_ten() -> None:
    for draw, place in ((0.0, "(6,2)"), (0.699, "(6,2)")):
        assert walked(draw, "w", (7, 2)) == (place, 0.0)
    ends = {walked(draw, "w", (7, 2)) for draw in np.linspace(0.7, 0.999, 20).tolist()}
    assert ends == {("(7,2)", -1.0), ("(7,1)", 0.0)}  # NW is a wall, SW is not


def test_an_exit_pays_whatever_is_done_there_and_ends_the_game() -> None:
    for place, pay in (((0, 1), 5.0), ((2, 0), -10.0), ((9, 0), 10.0)):
        for action in DIRECTIONS:
            moved, paid = walked(0.5, action, place)
            assert paid == pay
            assert PROBLEM.terminal(np.array([PROBLEM.parse_state(moved)])).all()


@pytest.mark.parametrize("settings", [{}, {"slip": 0.0}, {"bump_cost": 0.0}, {"slip": 1.0}])
def test_undiscounted_the_optimum_comes_to_an_exit_and_earns_what_it_says(
    settings: dict[str, float],
) -> None:
    problem = dmplay.load_problem("hexworld", discount=1.0, **settings)
    optimal = dmplay.load_agent(problem, 0, "optimal")
    played = dmplay.rollout(problem, [optimal], episodes=200, turn_limit=2000, seed=5)
    assert played.terminated.all()
    values = optimal.action_values((problem.enumerate_states(),))
    assert values is not None
    starts = [Session(problem, SeededUniforms(5, game)).initial_state for game in range(200)]
    wanted = values.max(axis=1)[np.array(starts)].mean()
    error = played.returns[:, 0].std() / np.sqrt(200)
    assert played.returns[:, 0].mean() == pytest.approx(wanted, abs=4 * error + 1e-6)
