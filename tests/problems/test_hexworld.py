import numpy as np
import pytest

import dmplay
from dmplay import SeededUniforms, Session
from dmplay.core.hexgrid import DIRECTIONS

PROBLEM = dmplay.load_problem("hexworld")


def step_from_hex(uniform: float, action: str, position: tuple[int, int]) -> tuple[str, float]:
    """Return the next hex and the reward of an action in a hex, for one uniform."""
    hexes = PROBLEM.hexes  # type: ignore[attr-defined]
    state = np.array([hexes.index(position)])
    outcome = PROBLEM.step(state, np.array([[DIRECTIONS.index(action)]]), np.array([[uniform]]))
    return PROBLEM.format_state(outcome.state[0]), float(outcome.rewards[0, 0])


def test_a_step_succeeds_with_a_probability_of_seven_tenths() -> None:
    for uniform, target in ((0.0, "(6,2)"), (0.699, "(6,2)")):
        assert step_from_hex(uniform, "w", (7, 2)) == (target, 0.0)
    outcomes = {
        step_from_hex(uniform, "w", (7, 2)) for uniform in np.linspace(0.7, 0.999, 20).tolist()
    }
    # the hex in the north-west is a wall, that in the south-west is not
    assert outcomes == {("(7,2)", -1.0), ("(7,1)", 0.0)}


def test_every_action_in_an_exit_pays_and_ends_the_game() -> None:
    for position, expected in (((0, 1), 5.0), ((2, 0), -10.0), ((9, 0), 10.0)):
        for action in DIRECTIONS:
            next_hex, reward = step_from_hex(0.5, action, position)
            assert reward == expected
            assert PROBLEM.terminal(np.array([PROBLEM.parse_state(next_hex)])).all()


@pytest.mark.parametrize("settings", [{}, {"slip": 0.0}, {"bump_cost": 0.0}, {"slip": 1.0}])
def test_the_undiscounted_optimum_reaches_an_exit_and_earns_its_value(
    settings: dict[str, float],
) -> None:
    problem = dmplay.load_problem("hexworld", discount=1.0, **settings)
    optimal = dmplay.load_agent(problem, 0, "optimal")
    result = dmplay.rollout(problem, [optimal], episodes=200, turn_limit=2000, seed=5)
    assert result.terminated.all()
    values = optimal.action_values((problem.enumerate_states(),))
    assert values is not None
    starts = [Session(problem, SeededUniforms(5, game)).initial_state for game in range(200)]
    expected = values.max(axis=1)[np.array(starts)].mean()
    error = result.returns[:, 0].std() / np.sqrt(200)
    assert result.returns[:, 0].mean() == pytest.approx(expected, abs=4 * error + 1e-6)
