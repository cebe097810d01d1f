"""Policy iteration: its formulas, its order of steps, and its last step against the solvers."""

from itertools import pairwise

import numpy as np
import pytest

from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import StateValues, Step, WatchRequest
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.registry.problems import load_problem
from dmplay.solvers.mdp import mdp_values
from tests.support.formulas import assert_formula_adds_up

ALGORITHM = find_algorithm("policy-iteration")


def picture_of(step: Step) -> StateValues:
    """Return the first picture of a step."""
    assert isinstance(step.pictures[0], StateValues)
    return step.pictures[0]


@pytest.mark.parametrize("name", ["hexworld", "hexworld:straight-line"])
def test_the_last_policy_has_the_values_of_the_fast_solver(name: str) -> None:
    problem = load_problem(name)
    q = mdp_values.compute_optimal_q(tabulate(problem), problem.discount)
    *_, last = ALGORITHM.iterate_steps(WatchRequest(problem))
    picture = picture_of(last)
    assert picture.values == pytest.approx(q.max(axis=1), abs=1e-9)
    assert picture.actions is not None
    rows = np.arange(len(q) - 1)
    assert q[rows, picture.actions[:-1]] == pytest.approx(q[:-1].max(axis=1), abs=1e-9)


def test_evaluation_and_improvement_alternate_until_no_action_is_better() -> None:
    start, *steps = ALGORITHM.iterate_steps(WatchRequest(load_problem("hexworld")))
    titles = [f"{kind} {n}" for n in range(1, 6) for kind in ("evaluation", "improvement")]
    assert [start.title, *(step.title for step in steps)] == ["start", *titles]
    assert steps[-1].sentences == (
        "A better action is found in 0 of 25 states.",
        "No action is better than the policy's, so the policy is optimal.",
    )


def test_each_policy_is_at_least_as_good_as_the_one_before() -> None:
    _, *steps = ALGORITHM.iterate_steps(WatchRequest(load_problem("hexworld")))
    evaluations = [picture_of(step).values for step in steps[::2]]
    for before, after in pairwise(evaluations):
        assert (after >= before - 1e-9).all()


def test_the_first_policy_goes_east_and_its_values_are_those_of_its_linear_equations() -> None:
    problem = load_problem("hexworld")
    _, evaluation, *_ = ALGORITHM.iterate_steps(WatchRequest(problem))
    east = np.zeros((25, 6))
    east[:, 0] = 1.0
    exact = mdp_values.evaluate_policy(tabulate(problem), problem.discount, east)
    assert picture_of(evaluation).values == pytest.approx(exact, abs=1e-12)


def test_every_formula_adds_up() -> None:
    _, *steps = ALGORITHM.iterate_steps(WatchRequest(load_problem("hexworld")))
    assert len(steps) == 10
    for step in steps:
        assert_formula_adds_up(step.formula)


def test_a_game_with_a_turn_limit_is_told_that_these_values_have_none() -> None:
    problem = load_problem("hexworld")
    session = Session(problem, SeededUniforms(7), turn_limit=5)
    start, *_ = ALGORITHM.iterate_steps(WatchRequest(problem, session=session))
    assert start.sentences[-1] == (
        "Your game has a turn limit; the values here are for a game without one."
    )


def test_it_needs_a_discount_below_1_and_a_list_of_states() -> None:
    undiscounted = load_problem("hexworld", discount=1.0)
    assert ALGORITHM.explain_misfit(undiscounted) == (
        "its discount is 1, and a policy may never end; it needs a discount below 1"
    )
    car = load_problem("mountain-car", discount=0.99)
    assert ALGORITHM.explain_misfit(car) == (
        "its states are real numbers; it needs a list of states"
    )
