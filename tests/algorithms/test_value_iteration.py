"""Value iteration: its formulas, and its last step against the fast solvers."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from dmplay.algorithms.finite_mdp import build_finite_mdp
from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import Curve, StateValues, Step, WatchRequest
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.problems.collision_avoidance import grid as collision_avoidance_grid
from dmplay.problems.mountain_car.agents import Optimal
from dmplay.registry.problems import load_problem
from dmplay.solvers.mdp import grid_value_iteration, mdp_values
from tests.support.formulas import assert_formula_adds_up
from tests.support.user_problems import Key

ITERATE = find_algorithm("value-iteration").iterate_steps
CORRIDOR = """discount: 0.5
values: reward
states: left right
actions: stay go
T: stay identity
T: go
0.25 0.75
0 1
R: go : left : right : * 8
"""


def last_values(problem: Problem, iterations: int | None = None) -> StateValues:
    """Return the values of the last step."""
    *_, last = ITERATE(WatchRequest(problem, iterations=iterations))
    picture, _ = last.pictures
    assert isinstance(picture, StateValues)
    return picture


def picture_of(step: Step) -> StateValues:
    """Return the first picture of a step."""
    assert isinstance(step.pictures[0], StateValues)
    return step.pictures[0]


@pytest.mark.parametrize("name", ["hexworld", "hexworld:straight-line"])
def test_many_sweeps_lead_to_the_values_of_the_fast_solver(name: str) -> None:
    problem = load_problem(name)
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    last = last_values(problem, iterations=400)
    exact = q.max(axis=1) * (np.arange(len(q)) < len(q) - 1)
    assert last.values == pytest.approx(exact, abs=1e-9)
    assert last.actions is not None
    for state, action in enumerate(last.actions[:-1]):
        assert q[state, action] == pytest.approx(q[state].max(), abs=1e-9)
    assert last.actions[-1] == -1, "no action in the terminal state"


def test_the_sweeps_stop_within_the_error_that_the_last_step_states() -> None:
    problem = load_problem("hexworld")
    exact = mdp_values.compute_optimal_q(tabulate(problem), problem.discount).max(axis=1)
    *_, last = ITERATE(WatchRequest(problem))
    assert last.sentences[0] == (
        "The sweeps end: later changes sum to at most 0.9 x residual / (1 - 0.9), "
        "so V without a turn limit is within 0.0004."
    )
    assert np.abs(picture_of(last).values - exact).max() <= 0.0004


def test_sweep_k_gives_the_values_of_a_game_with_k_turns_left() -> None:
    problem = load_problem("hexworld")
    for sweep, step in enumerate(ITERATE(WatchRequest(problem, iterations=6))):
        exact = mdp_values.compute_finite_horizon_values(tabulate(problem), 0.9, sweep)
        assert picture_of(step).values == pytest.approx(exact, abs=1e-12)


@pytest.mark.parametrize("name", ["hexworld", "mountain-car", "collision-avoidance"])
def test_every_formula_adds_up(name: str) -> None:
    start, *sweeps = ITERATE(WatchRequest(load_problem(name), iterations=12))
    assert not start.formula
    for step in sweeps:
        assert_formula_adds_up(step.formula)


def test_the_second_sweep_of_hex_world_as_in_a_calculation_by_hand() -> None:
    *_, second = ITERATE(WatchRequest(load_problem("hexworld"), iterations=2))
    assert second.title == "sweep 2"
    assert second.formula == "V(8,1) = -0.3 + 0.9 (0.7 x 10 + 0.3 x 0) = 6"


def test_the_counts_leave_out_the_end_of_the_game_and_ties_are_named() -> None:
    start, first, *_ = ITERATE(WatchRequest(load_problem("hexworld"), iterations=2))
    assert start.sentences[-1] == "After the end of the game (1 state, not drawn), V stays 0."
    assert first.sentences[1:4] == (
        "16 of 24 values changed, by at most 10 (called the residual).",
        "The formula is for e in (2,0), one of 2 states where V changed most; all actions are "
        "equally good.",
        "V = reward now + discount 0.9 x sum of (probability x old V of the next state).",
    )
    changed = picture_of(first).changed
    assert changed is not None
    assert int(changed.sum()) == 16


def test_the_formula_is_about_the_state_of_the_game() -> None:
    problem = load_problem("hexworld")
    session = Session(problem, SeededUniforms(7))
    *_, last = ITERATE(WatchRequest(problem, session=session))
    assert last.formula.startswith(f"V{problem.format_state(session.state)} = ")
    assert "the state of the game" in last.sentences[-1]


def test_the_formula_of_a_car_in_a_game_is_about_the_nearest_grid_point() -> None:
    problem = load_problem("mountain-car")
    session = Session(problem, SeededUniforms(7))
    *_, last = ITERATE(WatchRequest(problem, session=session, iterations=2))
    picture = picture_of(last)
    assert picture.focus is not None
    distance = np.abs(picture.states[picture.focus] - session.state)
    assert (distance <= [0.0151, 0.00126]).all()
    assert "the grid point nearest to the state of the game" in last.sentences[-1]


def test_a_game_with_a_turn_limit_names_the_sweep_that_is_about_it() -> None:
    problem = load_problem("hexworld")
    session = Session(problem, SeededUniforms(7), turn_limit=5)
    session.advance([0])
    start, *_ = ITERATE(WatchRequest(problem, session=session))
    assert start.sentences[-1] == (
        "Your game has 4 turns left: its values are those of sweep 4, or of the last sweep if that "
        "comes first."
    )


def test_the_car_has_the_values_of_the_fast_solver_on_the_same_grid() -> None:
    problem = load_problem("mountain-car")
    grid = grid_value_iteration.RectangularGrid((-1.2, -0.07), (0.6, 0.07), (61, 57))
    solution = grid_value_iteration.run_grid_value_iteration(problem, grid)
    assert last_values(problem).values == pytest.approx(solution.values, abs=1e-9)


def test_the_grid_of_the_car_is_coarser_than_that_of_its_agent_but_similar() -> None:
    problem = load_problem("mountain-car")
    last = last_values(problem)
    q = Optimal(problem, 0).action_values((last.states,))
    is_similar = np.abs(last.values - q.max(axis=1)) < 12
    assert is_similar.mean() > 0.95


def test_collision_avoidance_has_the_values_of_backward_induction() -> None:
    problem = load_problem("collision-avoidance")
    tables = collision_avoidance_grid.compute_optimal_q(problem)
    last = last_values(problem)
    times = last.states[:, 3].astype(int)
    exact = collision_avoidance_grid.interpolate_values(tables, times, last.states).max(axis=1)
    assert last.values == pytest.approx(exact, abs=1e-9)


def test_the_residual_of_hex_world_never_grows_faster_than_the_discount_allows() -> None:
    *_, last = ITERATE(WatchRequest(load_problem("hexworld")))
    curve = last.pictures[1]
    assert isinstance(curve, Curve)
    assert curve.label == "residual"
    for before, after in pairwise(curve.numbers):
        assert after <= 0.9 * before + 1e-12


def test_a_problem_file_of_a_user_works(tmp_path: Path) -> None:
    file = tmp_path / "corridor.mdp"
    file.write_text(CORRIDOR)
    problem = load_problem(str(file))
    last = last_values(problem, iterations=60)
    # V(left) = 0.75 x 8 + 0.5 (0.25 V(left) + 0.75 x 0), so V(left) = 6 / 0.875.
    assert last.values == pytest.approx([6 / 0.875, 0.0], abs=1e-9)


@pytest.mark.parametrize(
    ("name", "obstacle"),
    [
        ("crying-baby", "the algorithm needs a state that the agent sees, but the state is hidden"),
        ("predator-prey", "several agents choose; it plans for one agent"),
        ("simple-regulator", "its actions are real numbers; it needs a list of actions"),
        ("cart-pole", "its state is 4 real numbers; a grid needs two numbers with bounds"),
        ("2048", "it has too many states to list"),
    ],
)
def test_a_problem_that_does_not_fit_gets_the_reason(name: str, obstacle: str) -> None:
    assert find_algorithm("value-iteration").explain_misfit(load_problem(name)) == obstacle


def test_an_illegal_action_has_no_value() -> None:
    problem = Key()
    mdp = build_finite_mdp(problem)
    q = mdp.compute_action_values(np.zeros(len(mdp.states)))
    assert (np.isfinite(q) == problem.legal_actions_mask(mdp.states)[:, 0]).all()
